"""What layers of results state, the same in QGIS and from the command `extract`: names, types and decimals."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

UNKNOWN_IN_METRES = 'LOCAL_CS["Undefined Cartesian SRS",UNIT["metre",1]]'
"""Stated in outputs without a coordinate system, because GDAL else calls a GeoPackage's coordinates degrees."""


@dataclass(frozen=True)
class Field:
    """A column of a result.

    Attributes
    ----------
    name : str
        That of the attribute of `RailLine`, `Centerline` or `TrackGeometry` it holds; ten characters at most, so that
        a shapefile does not cut it. It ends in its unit.
    kind : type
        int, float or str.
    decimals : int
        Of a float: further ones would only show what no scanner resolves.
    """

    name: str
    kind: type
    decimals: int = 0

    def value(self, known: Any) -> int | float | str | None:
        """Give what is written for an attribute: numbers with their decimals, ids with commas, None for NaN."""
        if self.kind is str:
            return ",".join(map(str, known))
        if self.kind is int:
            return int(known)
        # The sum makes a zero of the negative one that rounding leaves.
        return round(float(known), self.decimals) + 0.0 if math.isfinite(known) else None


CLASS_CODE = Field("class_code", int)
LENGTH = Field("length_m", float, 3)
BRIDGED = Field("bridged_m", float, 2)
SIGMA = Field("sigma_mm", float, 2)
"""With two decimals, for along dense clouds it is a few tenths of a millimetre."""

RAIL_FIELDS = (
    Field("rail_id", int),
    CLASS_CODE,
    LENGTH,
    Field("points", int),
    Field("resid_mm", float, 1),
    SIGMA,
    BRIDGED,
)
CENTERLINE_FIELDS = (
    Field("track_id", int),
    CLASS_CODE,
    Field("left_ids", str),
    Field("right_ids", str),
    LENGTH,
    Field("gauge_mm", float, 1),
    Field("gaugesd_mm", float, 1),
    Field("cant_mm", float, 1),
    Field("cantmax_mm", float, 1),
    BRIDGED,
)
QUALITY_FIELDS = (
    Field("track_id", int),
    Field("chainage_m", float, 2),
    Field("gauge_mm", float, 1),
    Field("cant_mm", float, 1),
    Field("twist_mm", float, 1),
    Field("radius_m", float, 1),
    Field("grade_pm", float, 2),
    SIGMA,
    Field("points", int),
    Field("bridged", int),
)
"""Of a `TrackGeometry` the first is one value and the others are profiles."""
