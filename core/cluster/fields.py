"""Fields of the results, the same that QGIS gets."""

from __future__ import annotations

import numpy as np

RAIL_FIELDS = {
    "rail_id": np.int32,
    "class_code": np.int32,
    "length_m": float,
    "points": np.int32,
    "resid_mm": float,
    "sigma_mm": float,
    "bridged_m": float,
}
CENTERLINE_FIELDS = {
    "track_id": np.int32,
    "class_code": np.int32,
    "left_ids": str,
    "right_ids": str,
    "length_m": float,
    "gauge_mm": float,
    "gaugesd_mm": float,
    "cant_mm": float,
    "cantmax_mm": float,
    "bridged_m": float,
}
"""Names and types, each name that of the attribute of `RailLine` or `Centerline` it holds."""
