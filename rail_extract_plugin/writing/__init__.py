"""Writes the outputs: layers, files, styles and the report."""
