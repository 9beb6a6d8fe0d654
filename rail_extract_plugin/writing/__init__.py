"""Outputs: layers, files, styles and the report."""
