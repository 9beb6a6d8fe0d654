"""Tracks: pairs of rails at gauge, their centerlines and their geometry."""
