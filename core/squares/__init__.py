"""Clouds of any size: squares with overlap, points on disk, and lines joined across borders."""
