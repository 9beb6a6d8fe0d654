"""Results as layers, and the files that hold them: GeoPackage, DXF, CSV, GeoTIFF, and those of design software."""
