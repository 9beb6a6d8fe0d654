"""What QGIS's windows show after a run: the report, and the dock in which findings are reviewed."""
