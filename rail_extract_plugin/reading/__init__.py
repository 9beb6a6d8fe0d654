"""Inputs: point clouds, rasters and line layers, as the core takes them."""
