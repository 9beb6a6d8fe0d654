"""Classified clouds of tracks with exact truth."""
