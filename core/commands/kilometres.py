"""Kilometres of features along axes, for the commands that take an axis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyogrio
import shapely

from ..clouds.crs import is_geographic, parse_crs, unit_in_plan
from ..design_places import are_places
from ..errors import CrsError, MissingError, ParameterError
from ..files.geopackage import geometries_in
from ..jobs.places import FAR, NOWHERE, Places, without_places
from ..jobs.shared import DECREASING
from ..kilometres.axes import (
    AXIS_IN_DEGREES,
    NAME_FIELDS,
    AxisLine,
    PlacedAxes,
    Post,
    Start,
    check_jumps,
    km_of,
    make_axes,
    post_field,
)
from ..kilometres.stationing import Jump
from .files import FileValues
from .vectors import LAYER, Features, explained


def _with_measures(features: Features, file: str) -> Features:
    """Return the features of a GeoPackage with the M values of their geometries, which GDAL's arrays lack."""
    path, _, layer = file.partition(LAYER)
    if Path(path).suffix.lower() != ".gpkg":
        return features
    stored = geometries_in(Path(path), layer or str(pyogrio.list_layers(path)[0, 0]))
    return replace(features, shapes=shapely.from_wkb([stored.get(int(number)) for number in features.ids]))


def read_axes(values: FileValues, plane: str | None) -> PlacedAxes:
    """Read the axes that values state.

    Parameters
    ----------
    values : FileValues
        With AXIS and what goes with it.
    plane : str or None
        Coordinate system in which kilometres are measured; else it is that of the axis.

    Raises
    ------
    CrsError, ParameterError, RailExtractError
        A file lacks what it should state, or they contradict each other.
    """
    features = _with_measures(values.features("AXIS"), values["AXIS"])
    crs_wkt = plane or features.crs_wkt
    if crs_wkt and is_geographic(parse_crs(crs_wkt)):
        raise CrsError(AXIS_IN_DEGREES)
    unit_m = unit_in_plan(crs_wkt)
    lines = list(_axis_lines(features, crs_wkt, unit_m))
    if not lines:
        raise MissingError("AXIS", "line")
    start_km = values["START_KM"]
    start = None if start_km is None else Start(start_km, values["DIRECTION"] == DECREASING)
    filled = values.filled
    posts = _posts(values.features("POSTS"), values["POST_FIELD"], crs_wkt, unit_m) if filled("POSTS") else []
    jumps = _jumps(values.features("JUMPS")) if filled("JUMPS") else []
    return PlacedAxes(make_axes(lines, start, posts, jumps), unit_m, values["FORMAT"])


def places_of(features: Features, plane: str | None) -> Places:
    """Return where features count in the plane of axes.

    Raises
    ------
    RailExtractError
        None has a geometry.
    """
    shapes, count = features.in_plane(plane), len(features.ids)
    empty = np.array([shape is None or shape.is_empty for shape in shapes], dtype=bool)
    if count and empty.all():
        raise without_places(features.option)
    lost = ~are_places(shapely.bounds(shapes), unit_in_plan(plane)) & ~empty
    with explained(features.option):
        xy = np.array([FAR if far else _place(shape) for shape, far in zip(shapes, lost)]).reshape(-1, 2)
    vertices, owner = shapely.get_coordinates(shapes, return_index=True)
    are_points = all(shape is None or "Point" in shape.geom_type for shape in shapes)
    return Places(features.ids.tolist(), xy, vertices, owner, are_points, features)


def _place(shape: shapely.Geometry | None) -> np.ndarray:
    """Return where a feature counts, (2,): half way along a line, inside a polygon, in the mean of points."""
    if shape is None or shape.is_empty:
        return NOWHERE
    if "Line" in shape.geom_type:
        shape = shapely.line_interpolate_point(shapely.line_merge(shape), 0.5, normalized=True)
    elif "Polygon" in shape.geom_type:
        shape = shapely.point_on_surface(shape)
    return np.array(shapely.get_coordinates(shapely.centroid(shape))[0])


def _axis_lines(features: Features, crs_wkt: str | None, unit_m: float) -> Iterator[AxisLine]:
    """Yield the parts of all lines that have a length."""
    named = next((name for name in NAME_FIELDS if name in features.columns), None)
    for row, shape, moved in zip(features.rows(), features.shapes, features.in_plane(crs_wkt)):
        for part, placed in zip(shapely.get_parts(shape), shapely.get_parts(moved)):
            if part.geom_type == "LineString" and part.length != 0:  # that of a damaged line is not a number
                m = shapely.get_coordinates(part, include_m=True)[:, 2]
                yield AxisLine(str((named and row[named]) or ""), shapely.get_coordinates(placed) * unit_m, m)


def _posts(features: Features, field: str | None, crs_wkt: str | None, unit_m: float) -> list[Post]:
    """Return the posts."""
    name = field or post_field(features.columns)
    if name not in features.columns:
        raise ParameterError(f"POSTS has no field {name}: it has {', '.join(features.columns)}.")
    rows = features.rows()
    found = [
        Post(xy * unit_m, km_of(rows[number][name], name, "POSTS", int(features.ids[number])))
        for number, place in features.parts(crs_wkt, "Point")
        for xy in shapely.get_coordinates(place)
    ]
    if not found:
        raise MissingError("POSTS", "point")
    return found


def _jumps(features: Features) -> list[Jump]:
    """Return the jumps of a table."""
    check_jumps(features.columns)
    return [
        Jump(*(km_of(row[name], name, "JUMPS", int(feature)) for name in ("km_back", "km_ahead")))
        for feature, row in zip(features.ids, features.rows())
    ]
