"""The steps on one square of a cloud, and lines joined across the borders of squares."""
