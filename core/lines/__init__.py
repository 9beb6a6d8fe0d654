"""Polylines: smoothing that keeps curves and nodes, and the fewest vertices that still show them."""
