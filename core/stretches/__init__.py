"""Clouds of any size: squares that are worked on one after another, and their lines made whole again."""
