"""Reads the inputs: point clouds, rasters and line layers, in the types that the core expects."""
