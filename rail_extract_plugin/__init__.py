"""The QGIS side of Rail Extract: the only package that imports qgis."""
