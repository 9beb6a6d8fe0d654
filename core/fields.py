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
    meaning : str
        For the guide's reference.
    decimals : int
        Of a float: further ones would only show what no scanner resolves.
    """

    name: str
    kind: type
    meaning: str
    decimals: int = 0

    def value(self, known: Any) -> int | float | str | None:
        """Give what is written for an attribute: numbers with their decimals, ids with commas, None for NaN."""
        if self.kind is str:
            return ",".join(map(str, known))
        if self.kind is int:
            return int(known)
        # The sum makes a zero of the negative one that rounding leaves.
        return round(float(known), self.decimals) + 0.0 if math.isfinite(known) else None


CLASS_CODE = Field("class_code", int, "class of the points")
LENGTH = Field("length_m", float, "length in space, metres", 3)
BRIDGED = Field("bridged_m", float, "plan length without points, metres; of a track, where a rail has none", 2)
SIGMA = Field("sigma_mm", float, "standard error of the line across, millimetres", 2)
"""With two decimals, for along dense clouds it is a few tenths of a millimetre."""

RAIL_FIELDS = (
    Field("rail_id", int, "number of the rail, from west to east by where it begins"),
    CLASS_CODE,
    LENGTH,
    Field("points", int, "points on the head that support the line"),
    Field("resid_mm", float, "spread of these points across the line, millimetres rms", 1),
    SIGMA,
    BRIDGED,
)
CENTERLINE_FIELDS = (
    Field("track_id", int, "number of the track, from west to east by where it begins"),
    CLASS_CODE,
    Field("left_ids", str, "rail_id of the rails on the left, in their order, with commas"),
    Field("right_ids", str, "the same on the right"),
    LENGTH,
    Field("gauge_mm", float, "mean gauge, millimetres", 1),
    Field("gaugesd_mm", float, "standard deviation of the gauge along the track, millimetres", 1),
    Field("cant_mm", float, "mean cant, left minus right, millimetres", 1),
    Field("cantmax_mm", float, "cant that is largest in size, with its sign, millimetres", 1),
    BRIDGED,
)
QUALITY_FIELDS = (
    Field("track_id", int, "number of the track"),
    Field("chainage_m", float, "plan distance from the beginning of its centerline, metres", 2),
    Field("gauge_mm", float, "gauge, millimetres", 1),
    Field("cant_mm", float, "cant, left minus right, millimetres", 1),
    Field("twist_mm", float, "change of cant over 3 m, millimetres; empty at the ends", 1),
    Field("radius_m", float, "radius in plan, metres, positive to the left; empty above 10 km", 1),
    Field("grade_pm", float, "gradient over 10 m, per mille, positive uphill", 2),
    SIGMA,
    Field("points", int, "points on both rails that are nearest to this place"),
    Field("bridged", int, "1 where, for most of the step, a rail has no points or is not there"),
)
"""Of a `TrackGeometry` the first is one value and the others are profiles."""
