"""The laboratory: training rasters, 3D scenes with exact truth, the ruler, and training.

It belongs to the repository and not to the plugin that users install.
"""
