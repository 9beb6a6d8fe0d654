"""The laboratory beside the product: training rasters, 3D scenes with exact truth, the ruler, and training."""
