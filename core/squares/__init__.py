"""Clouds of any size: squares with overlap, points on disk, lines joined across borders."""
