"""Rail points in raw clouds, by geometry alone (docs/classification.md)."""
