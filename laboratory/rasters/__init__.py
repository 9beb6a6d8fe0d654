"""Training rasters: random track layouts, drawn without errors and as a scanner shows them."""
