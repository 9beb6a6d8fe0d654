"""Kilometres along a line, and of places beside it."""
