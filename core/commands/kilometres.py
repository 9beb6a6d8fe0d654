"""Kilometres of features along axes, for the commands that take an axis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import shapely

from ..clouds.crs import is_geographic, parse_crs, units
from ..design_places import are_places
from ..disk import Destination
from ..errors import CrsError, MissingError, ParameterError
from ..fields import EXTENT_FIELDS, STATION_FIELDS, Field
from ..files.geopackage import geometries_in
from ..files.writing import column_of, write_table
from ..jobs.shared import DECREASING
from ..kilometres.axes import (
    AXIS_IN_DEGREES,
    NAME_FIELDS,
    Axes,
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
from ..progress import Progress
from ..rails import Kilometres
from .vectors import LAYER, Features, explained, read_features

FAR = np.full(2, np.inf)
"""Place of a feature that is not on the map."""


def _with_measures(features: Features, file: str) -> Features:
    """Return the features of a GeoPackage with the M values of their geometries, which GDAL's arrays lack."""
    path, _, layer = file.partition(LAYER)
    if Path(path).suffix.lower() != ".gpkg":
        return features
    stored = geometries_in(Path(path), layer or str(pyogrio.list_layers(path)[0, 0]))
    return replace(features, shapes=shapely.from_wkb([stored.get(int(number)) for number in features.ids]))


def read_axes(given: Mapping[str, Any], places: str | None, plane: str | None = None) -> tuple[PlacedAxes, str | None]:
    """Read the axes that values state; also return the coordinate system of their plane.

    Parameters
    ----------
    given : mapping
        With AXIS and what goes with it.
    places : str or None
        Coordinate system of what is to be located.
    plane : str, optional
        Coordinate system of the plane; else it is that of the axis, or of the places if the axis is in degrees.

    Raises
    ------
    CrsError, ParameterError, RailExtractError
        A file lacks what it should state, or they contradict each other.
    """
    features = _with_measures(read_features(given["AXIS"], "AXIS"), given["AXIS"])
    stated_systems = [one for one in (plane, features.crs_wkt, places) if one]
    crs_wkt = next((one for one in stated_systems if not is_geographic(parse_crs(one))), None)
    if crs_wkt is None and stated_systems:
        raise CrsError(AXIS_IN_DEGREES)
    unit_m = units(parse_crs(crs_wkt))[0] if crs_wkt else 1.0
    lines = list(_axis_lines(features, crs_wkt, unit_m))
    if not lines:
        raise MissingError("AXIS", "line")
    start_km, posts_file, jumps = (given[name] for name in ("START_KM", "POSTS", "JUMPS"))
    start = None if start_km is None else Start(start_km, given["DIRECTION"] == DECREASING)
    posts = _posts(read_features(posts_file, "POSTS"), given["POST_FIELD"], crs_wkt, unit_m) if posts_file else []
    made = make_axes(lines, start, posts, _jumps(read_features(jumps, "JUMPS")) if jumps else [])
    return PlacedAxes(Axes(made.axes, made.notices), unit_m, given["FORMAT"]), crs_wkt


def located(
    features: Features, axes: PlacedAxes, crs_wkt: str | None, progress: Progress
) -> tuple[tuple[Field, ...], list[Any]]:
    """Find the kilometres of features; return their fields, and the values of each.

    Parameters
    ----------
    crs_wkt : str or None
        Of the plane of the axes.
    """
    shapes = features.in_plane(crs_wkt)
    bounds = shapely.bounds(shapes)
    far = ~are_places(bounds, axes.unit_m) & ~np.array(
        [shape is None or shape.is_empty for shape in shapes], dtype=bool
    )
    with explained(features.option):
        places = np.array([FAR if lost else _place(shape) for shape, lost in zip(shapes, far)]).reshape(-1, 2)
    known = axes.on_map(places, features.ids.tolist(), progress)
    kilometres = Kilometres.empty(len(shapes))
    kilometres.put(known, axes.locate(places[known], progress))
    columns = [getattr(kilometres, field.name) for field in STATION_FIELDS]
    if all(shape is None or "Point" in shape.geom_type for shape in shapes):
        return STATION_FIELDS, columns
    xy, numbers = shapely.get_coordinates(shapes, return_index=True)
    xy, numbers = xy[known[numbers]], numbers[known[numbers]]
    extents, km = np.full((len(shapes), 2), np.nan), axes.kilometres(xy, progress).km
    np.fmin.at(extents[:, 0], numbers, km)
    np.fmax.at(extents[:, 1], numbers, km)
    return (*STATION_FIELDS, *EXTENT_FIELDS), [*columns, *extents.T]


def _place(shape: shapely.Geometry | None) -> np.ndarray:
    """Return where a feature counts, (2,): half way along a line, inside a polygon, in the mean of points."""
    if shape is None or shape.is_empty:
        return np.full(2, np.nan)
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


def write_copy(
    destination: Destination, source: Features, fields: Sequence[Field], columns: Sequence[Sequence[Any]]
) -> None:
    """Write the features of a layer with further fields into a GeoPackage.

    Parameters
    ----------
    columns : sequence of sequence
        Values of each further field, one per feature.
    """
    own = {field.name for field in fields}
    written: dict[str, tuple[np.ndarray, np.ndarray | None]] = {
        name: (values, None) for name, values in source.columns.items() if name not in own
    }
    for field, values in zip(fields, columns):
        written[field.name] = column_of(field, [field.value(value) for value in values])
    kinds = {shape.geom_type for shape in source.shapes if shape is not None}
    shapes = np.array([shapely.to_wkb(shape, output_dimension=4) for shape in source.shapes], dtype=object)
    with destination.replacing() as new:
        write_table(new, "stations", shapes, kinds.pop() if len(kinds) == 1 else "Unknown", written, source.crs_wkt)
