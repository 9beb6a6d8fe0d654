"""Training of FRPDF on synthetic rasters, and its evaluation."""
