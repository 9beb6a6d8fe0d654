"""The dialog in which an algorithm runs, and what it offers afterwards."""
