"""Features of vector files with their fields, for the commands that take lines, tables and axes."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Optional

import numpy as np
import pyogrio
import shapely

from ..alignment.cant_of_rails import cant_of_rails
from ..alignment.elements import Alignment
from ..alignment.measured import Track, stations_by_track, with_cant
from ..alignment.placed_axes import AXIS_IN_DEGREES, NAME_FIELDS, PlacedAxes, check_jumps, km_of, post_field
from ..alignment.stationing import Jump
from ..alignment.stations import Axes, AxisLine, Post, Start, make_axes
from ..alignment.table import alignments, check_table, frame_of
from ..clouds.crs import import_pyproj, is_geographic, name_of, parse_crs, same_plane, units
from ..comparison.tracks import SurveyedLine
from ..disk import Destination
from ..errors import CrsError, MissingError, ParameterError
from ..fields import EXTENT_FIELDS, STATION_FIELDS, UNKNOWN_IN_METRES, Field
from ..frame import ORIGIN_STEP, LocalFrame
from ..output.geopackage import geometries_in
from ..output.writing import as_os_error, column_of
from ..progress import Progress
from ..rails import Kilometres, RailLine

LAYER = "|layername="
"""What separates a file from the layer in it, as QGIS writes it."""


@dataclass(frozen=True)
class Features:
    """Features of a layer.

    Attributes
    ----------
    option : str
        Option that named the file, for messages.
    crs_wkt : str or None
    ids : (n,) int array
    shapes : (n,) object array
        Geometries; None where there is none.
    columns : dict of str to (n,) array
        Values by the name of the field.
    """

    option: str
    crs_wkt: Optional[str]
    ids: np.ndarray
    shapes: np.ndarray
    columns: dict[str, np.ndarray]

    def rows(self) -> list[dict[str, Any]]:
        """Return the values of each feature; None where a field is empty."""
        return [
            {name: _plain(values[number]) for name, values in self.columns.items()} for number in range(len(self.ids))
        ]

    @property
    def system(self) -> tuple[Optional[str], float, float]:
        """Coordinate system, and its units in plan and in height, metres.

        Raises
        ------
        CrsError
            It is in degrees.
        """
        if self.crs_wkt is None:
            return None, 1.0, 1.0
        crs = parse_crs(self.crs_wkt)
        if is_geographic(crs):
            raise CrsError(
                f"{self.option} is in degrees ({name_of(crs)}), where lengths can't be measured: reproject it, for "
                "example to the UTM zone of the place."
            )
        return (self.crs_wkt, *units(crs))

    def lines(self) -> tuple[list[tuple[int, dict[str, Any], np.ndarray]], LocalFrame]:
        """Return feature id, values and vertices, (n, 3) local metres, of each line; z is NaN without heights.

        Raises
        ------
        CrsError
            The lines are in degrees.
        ParameterError
            There are none.
        """
        found = [
            (int(feature), row, _vertices(part))
            for feature, row, shape in zip(self.ids, self.rows(), self.shapes)
            for part in shapely.get_parts(shape)
            if part.geom_type == "LineString" and part.length > 0
        ]
        if not found:
            raise MissingError(self.option, "line")
        crs_wkt, horizontal_unit_m, vertical_unit_m = self.system
        middle = np.median(np.concatenate([xyz for _, _, xyz in found]), axis=0)
        origin = np.round(np.nan_to_num(middle) / ORIGIN_STEP) * ORIGIN_STEP
        frame = LocalFrame(origin, horizontal_unit_m, vertical_unit_m, crs_wkt)
        return [(feature, row, frame.to_local(xyz)) for feature, row, xyz in found], frame

    def in_plane(self, crs_wkt: Optional[str]) -> np.ndarray:
        """Return the geometries in another coordinate system."""
        if not (crs_wkt and self.crs_wkt):
            return self.shapes
        change = import_pyproj().Transformer.from_crs(parse_crs(self.crs_wkt), parse_crs(crs_wkt), always_xy=True)
        return shapely.transform(self.shapes, lambda xy: np.column_stack(change.transform(*xy.T)))


def read_features(file: str, option: str) -> Features:
    """Read the features of a file; pyogrio drops M values.

    Parameters
    ----------
    file : str
        A vector file; `FILE|layername=NAME` names a layer, else its first one is read.
    option : str
        Option that names it.

    Raises
    ------
    ParameterError
        It can't be read.
    """
    path, _, layer = file.partition(LAYER)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of the M values, which only an axis needs
            meta, ids, shapes, values = pyogrio.raw.read(Path(path), layer=layer or None, return_fids=True)
        found = shapely.from_wkb(shapes) if shapes is not None else np.full(len(ids), None)
    except (RuntimeError, ValueError, shapely.errors.ShapelyError) as error:
        raise ParameterError(
            f"{option} {file} can't be read as a vector file: give a GeoPackage or a table."
        ) from error
    return Features(option, meta["crs"], ids, found, dict(zip(meta["fields"].tolist(), values)))


def _with_measures(features: Features, file: str) -> Features:
    """Return the features of a GeoPackage with the M values of their geometries, which GDAL's arrays lack."""
    path, _, layer = file.partition(LAYER)
    if Path(path).suffix.lower() != ".gpkg":
        return features
    stored = geometries_in(Path(path), layer or str(pyogrio.list_layers(path)[0, 0]))
    return replace(features, shapes=shapely.from_wkb([stored.get(int(number)) for number in features.ids]))


def read_tracks(
    lines: str, quality: Optional[str], rails: Optional[str], option: str = "LINES"
) -> tuple[list[Track], LocalFrame]:
    """Read centerlines with their cant: from the track geometry, else from the rails; `option` names the lines.

    Raises
    ------
    CrsError, ParameterError
        A file has no lines, lacks a field, or states the cant of other tracks.
    """
    found, frame = read_features(lines, option).lines()
    tracks = [(_whole(row.get("track_id"), feature), xyz) for feature, row, xyz in found]
    if quality is not None:
        features = read_features(quality, "--quality")
        stations = stations_by_track(features.rows(), features.columns, "--quality")
        return with_cant(tracks, stations, "--quality", option), frame
    shapes = [] if rails is None else [xyz for _, _, xyz in _lines_in(read_features(rails, "--rails"), frame)]
    return [
        Track(number, xyz, cant_of_rails(xyz, shapes), np.zeros(len(xyz), dtype=bool)) for number, xyz in tracks
    ], frame


def read_elements(file: str, option: str, crs: Optional[str] = None) -> list[Alignment]:
    """Read the alignments of an element table; `crs` is that of a table without geometries.

    Raises
    ------
    CrsError, ParameterError, RailExtractError
        It is not an element table, an element is wrong, or it is in degrees.
    """
    found = read_features(file, option)
    check_table(found.columns, option)
    rows = found.rows()
    stated = found.crs_wkt or (parse_crs(crs).to_wkt() if crs else None)
    known = Features(option, stated, found.ids, found.shapes, found.columns)
    return alignments(rows, frame_of(rows, known.system, option))


def read_survey(file: str, option: str, frame: Optional[LocalFrame]) -> tuple[list[SurveyedLine], LocalFrame]:
    """Read the lines of a survey with their standard errors, in a frame or in one of their own.

    A line's number is its `rail_id`, else its `track_id`, else the id of its feature. With a `track_id` only, it is a
    centerline.
    """
    features = read_features(file, option)
    found, own = features.lines()
    if frame is not None:
        found, own = _lines_in(features, frame), frame
    named = next((name for name in ("rail_id", "track_id") if name in features.columns), "")
    return [
        SurveyedLine(
            _whole(row.get(named), feature),
            xyz,
            _number(row.get("sigma_mm")) / 1000,
            _number(row.get("sigmaz_mm")) / 1000,
            named != "track_id",
        )
        for feature, row, xyz in found
    ], own


def read_rails(file: str, option: str, frame: LocalFrame) -> list[RailLine]:
    """Read rails with their standard errors, in a frame."""
    return [
        RailLine(
            xyz,
            _whole(row.get("rail_id"), feature),
            _whole(row.get("class_code"), 0),
            _number(row.get("points")),
            _number(row.get("resid_mm")),
            _number(row.get("sigma_mm")),
            _number(row.get("bridged_m")),
            sigmaz_mm=_number(row.get("sigmaz_mm")),
        )
        for feature, row, xyz in _lines_in(read_features(file, option), frame)
    ]


def read_axes(
    axis: str,
    start: Optional[Start],
    posts: Optional[str],
    field: Optional[str],
    jumps: Optional[str],
    notation: str,
    systems: tuple[Optional[str], Optional[str]],
) -> tuple[PlacedAxes, Optional[str]]:
    """Read axes with what states their kilometres; also return the coordinate system of their plane.

    Parameters
    ----------
    axis, posts, jumps : str or None
        Files.
    start : Start, optional
    field : str, optional
        Field of the posts with the kilometre.
    notation : str
        One of `km_text.NOTATIONS`.
    systems : (str or None, str or None)
        Coordinate system of the plane, if it is not that of the axis, and of the places, for an axis in degrees or
        without one.

    Raises
    ------
    CrsError, ParameterError, RailExtractError
        A file lacks what it should state, or they contradict each other.
    """
    features = _with_measures(read_features(axis, "AXIS"), axis)
    plane, places = systems
    stated_systems = [one for one in (plane, features.crs_wkt, places) if one]
    crs_wkt = next((one for one in stated_systems if not is_geographic(parse_crs(one))), None)
    if crs_wkt is None and stated_systems:
        raise CrsError(AXIS_IN_DEGREES)
    unit_m = units(parse_crs(crs_wkt))[0] if crs_wkt else 1.0
    lines = list(_axis_lines(features, crs_wkt, unit_m))
    if not lines:
        raise MissingError("AXIS", "line")
    stated = [] if posts is None else _posts(read_features(posts, "POSTS"), field, crs_wkt, unit_m)
    made = make_axes(lines, start, stated, [] if jumps is None else _jumps(read_features(jumps, "JUMPS")))
    return PlacedAxes(Axes(made.axes, made.notices), unit_m, notation), crs_wkt


@dataclass(frozen=True)
class Located:
    """Kilometres of the features of a layer.

    Attributes
    ----------
    fields : tuple of Field
        `STATION_FIELDS`; of lines and polygons also `EXTENT_FIELDS`.
    columns : list of sequences
        Values of each field.
    known : int
        Number of features with a kilometre.
    """

    fields: tuple[Field, ...]
    columns: list[Any]
    known: int


def located(features: Features, axes: PlacedAxes, crs_wkt: Optional[str], progress: Progress) -> Located:
    """Find the kilometres of features.

    Parameters
    ----------
    features : Features
    axes : PlacedAxes
    crs_wkt : str or None
        Of the plane of the axes.
    progress : Progress
    """
    shapes = features.in_plane(crs_wkt)
    places = np.array([_place(shape) for shape in shapes]).reshape(-1, 2)
    known = np.isfinite(places).all(axis=1)
    kilometres = Kilometres.empty(len(shapes))
    kilometres.put(known, axes.locate(places[known], progress))
    columns = [getattr(kilometres, field.name) for field in STATION_FIELDS]
    count = int(np.isfinite(kilometres.km).sum())
    if all(shape is None or "Point" in shape.geom_type for shape in shapes):
        return Located(STATION_FIELDS, columns, count)
    xy, numbers = shapely.get_coordinates(shapes, return_index=True)
    extents, km = np.full((len(shapes), 2), np.nan), axes.kilometres(xy, progress).km
    np.fmin.at(extents[:, 0], numbers, km)
    np.fmax.at(extents[:, 1], numbers, km)
    return Located((*STATION_FIELDS, *EXTENT_FIELDS), [*columns, *extents.T], count)


def _place(shape: Optional[shapely.Geometry]) -> np.ndarray:
    """Return where a feature counts, (2,): half way along a line, inside a polygon, in the mean of points."""
    if shape is None or shape.is_empty:
        return np.full(2, np.nan)
    if "Line" in shape.geom_type:
        shape = shapely.line_interpolate_point(shapely.line_merge(shape), 0.5, normalized=True)
    elif "Polygon" in shape.geom_type:
        shape = shapely.point_on_surface(shape)
    return np.array(shapely.get_coordinates(shapely.centroid(shape))[0])


def _axis_lines(features: Features, crs_wkt: Optional[str], unit_m: float) -> Sequence[AxisLine]:
    """Return the parts of all lines that have a length."""
    named = next((name for name in NAME_FIELDS if name in features.columns), None)
    made = []
    for row, shape, moved in zip(features.rows(), features.shapes, features.in_plane(crs_wkt)):
        for part, placed in zip(shapely.get_parts(shape), shapely.get_parts(moved)):
            if part.geom_type == "LineString" and part.length > 0:
                m = shapely.get_coordinates(part, include_m=True)[:, 2]
                made.append(AxisLine(str((named and row[named]) or ""), shapely.get_coordinates(placed) * unit_m, m))
    return made


def _posts(features: Features, field: Optional[str], crs_wkt: Optional[str], unit_m: float) -> list[Post]:
    """Return the posts."""
    name = field or post_field(features.columns)
    if name not in features.columns:
        raise ParameterError(f"POSTS has no field {name}: it has {', '.join(features.columns)}.")
    found = [
        Post(xy * unit_m, km_of(row[name], name, "POSTS", int(feature)))
        for feature, row, shape in zip(features.ids, features.rows(), features.in_plane(crs_wkt))
        for part in shapely.get_parts(shape)
        if part.geom_type == "Point"
        for xy in shapely.get_coordinates(part)
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


def _lines_in(features: Features, frame: LocalFrame) -> list[tuple[int, dict[str, Any], np.ndarray]]:
    """Return the lines in a frame.

    Raises
    ------
    CrsError
        Their coordinate system is another one.
    """
    found, own = features.lines()
    shift = shift_between(features.option, own, frame)
    return [(feature, row, xyz + shift) for feature, row, xyz in found]


def shift_between(option: str, own: LocalFrame, frame: LocalFrame) -> np.ndarray:
    """Return what moves places, (3,) metres, of the lines that an option names into another frame.

    Raises
    ------
    CrsError
        Their coordinate system is another one.
    """
    if own.crs_wkt and frame.crs_wkt and not same_plane(own.crs_wkt, frame.crs_wkt, tuple(frame.origin[:2])):
        names = (name_of(parse_crs(wkt)) for wkt in (own.crs_wkt, frame.crs_wkt))
        raise CrsError(
            f"{option} is in {next(names)} but the other lines in {next(names)}: give both in the same coordinate "
            "system."
        )
    return own.shift_to(frame)


def _vertices(line: shapely.LineString) -> np.ndarray:
    """Return the vertices of a line, (n, 3), without those that repeat the one before."""
    xyz = shapely.get_coordinates(line, include_z=True)
    if not np.isfinite(xyz[:, 2]).all():
        xyz[:, 2] = np.nan
    return xyz[np.append(True, np.any(np.diff(xyz[:, :2], axis=0) != 0, axis=1))]


def _plain(value: Any) -> Any:
    """Return a value of a field; None where it is empty."""
    value = value.item() if isinstance(value, np.generic) else value
    return None if value is None or value != value else value


def _number(value: Any) -> float:
    return float(value) if isinstance(value, (int, float)) else math.nan


def _whole(value: Any, default: int) -> int:
    return int(value) if isinstance(value, (int, float)) and float(value).is_integer() else default


def write_copy(
    destination: Destination, source: Features, fields: Sequence[Field], columns: Sequence[Sequence[Any]]
) -> None:
    """Write the features of a layer with further fields into a GeoPackage.

    Parameters
    ----------
    destination : Destination
    source : Features
    fields : sequence of Field
    columns : sequence of sequence
        Values of each further field, one per feature.
    """
    further = [column_of(field, [field.value(value) for value in values]) for field, values in zip(fields, columns)]
    kept = {name: values for name, values in source.columns.items() if name not in {field.name for field in fields}}
    kinds = {shape.geom_type for shape in source.shapes if shape is not None}
    with destination.replacing() as new, as_os_error():
        pyogrio.raw.write(
            str(new),
            layer="stations",
            driver="GPKG",
            geometry=np.array([shapely.to_wkb(shape, output_dimension=4) for shape in source.shapes], dtype=object),
            geometry_type=kinds.pop() if len(kinds) == 1 else "Unknown",
            field_data=[*kept.values(), *(column for column, _ in further)],
            field_mask=[*(None for _ in kept), *(empty for _, empty in further)],
            fields=[*kept, *(field.name for field in fields)],
            crs=source.crs_wkt or UNKNOWN_IN_METRES,
            nan_as_null=True,
        )
