"""Rasters of rail cells become polylines: closing, parity fix, veinerization, pruning, tracing, joining."""
