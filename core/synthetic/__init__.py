"""Track layouts, their corruption into training rasters, and 3D scenes with exact truth."""
