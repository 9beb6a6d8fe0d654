"""The science of Rail Extract: no QGIS, no GDAL, everything in float64 metres from a local origin."""
