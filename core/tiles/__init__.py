"""Clouds of any size: squares of a tiling, and points on disk, sorted into them."""
