"""Training rasters: random track layouts, drawn as they are and as a scanner distorts them."""
