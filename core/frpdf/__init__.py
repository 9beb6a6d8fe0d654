"""FRPDF, the network that cleans rail rasters: its layers, its weights, its engines and its two passes."""
