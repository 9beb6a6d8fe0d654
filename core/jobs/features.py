"""What jobs read from vector layers, checked in one place: lines, guides, seeds, masks, axes, tables, and places.

QGIS reads layers itself, the command line and Python with pyogrio and shapely; both provide a `FeatureSource`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..airborne.survey import GuideLine, gauge_of
from ..clouds.crs import parse_crs, title_of, unit_in_plan
from ..clouds.mask import Mask
from ..design_places import are_places, check_line, check_places
from ..errors import CrsError, MissingError, ParameterError, RailExtractError
from ..kilometres.axes import (
    AHEAD,
    BACK,
    NAME_FIELDS,
    Axes,
    AxisLine,
    AxisStart,
    PlacedAxes,
    Post,
    check_jumps,
    first_post_field,
    km_of,
    make_axes,
)
from ..kilometres.stationing import Jump
from ..progress import Progress
from .declaration import LINE, POINT, POLYGON
from .lines import LayerLines, Row, Rows, system_of, without_steps

FAR, NOWHERE = np.full(2, np.inf), np.full(2, np.nan)
"""Places of a feature that is not on any map, and of one without a geometry."""


@dataclass(frozen=True)
class Feature:
    """A feature of a layer.

    Attributes
    ----------
    row : mapping
        Values by the name of the field, None where one is empty.
    bounds : (k, 2) array
        Smallest and largest coordinates, in the coordinate system of the layer; none without a geometry.
    parts : sequence of (str, (n, 4) array)
        Kind, and x, y, z and M in the coordinate system that was asked for, of each point, each line and the outer ring
        of each polygon; NaN where there is no z or M. Curves are chords.
    is_lost : bool
        Whether it has no place in that coordinate system.
    middle : callable
        Returns where it counts, (2,): half way along a line, inside a polygon, in the mean of points.
    """

    number: int
    row: Row
    bounds: np.ndarray
    parts: Sequence[tuple[str, np.ndarray]]
    is_lost: bool
    middle: Callable[[], np.ndarray]

    def of_kind(self, kind: str) -> Iterator[np.ndarray]:
        """Yield the vertices of the parts of a kind, (n, 4)."""
        return (vertices for one, vertices in self.parts if one == kind)


class FeatureSource(ABC):
    """A vector layer or a table.

    `name` is the parameter that was given it, for messages; `count` the number of features; `kinds` those of the
    geometries that it may have, none for a table. `notices` are what the user is told of the fields where the features
    are copied.
    """

    name: str
    crs_wkt: str | None
    fields: Sequence[str]
    count: int
    kinds: Collection[str]
    notices: Sequence[str] = ()

    @abstractmethod
    def rows(self) -> Iterator[tuple[int, Row]]:
        """Yield number and values of each feature; see `Feature`."""

    @abstractmethod
    def features(self, crs_wkt: str | None) -> Iterator[Feature]:
        """Yield the features in a coordinate system; as they are if it or that of the layer is unknown."""

    @abstractmethod
    def rings(self, crs_wkt: str | None) -> list[np.ndarray]:
        """Return the closed rings, (k, 2) each, of the polygons and of their holes; overlaps count once."""

    def where(self, number: int) -> str:
        """Return how a message names a feature."""
        return f"{self.name} (feature {number})"


def read_lines(source: FeatureSource, progress: Progress) -> LayerLines:
    """Read all parts of all lines that have a length, in one local frame."""
    system = system_of(source.crs_wkt, progress)
    parts = _moving_lines(progress.follow(source.features(source.crs_wkt), source.count))
    return LayerLines.of(source.name, parts, source.fields, system, progress)


def read_lines_in(source: FeatureSource, crs_wkt: str | None, progress: Progress) -> LayerLines:
    """Read the same lines in another coordinate system; errors as for `read_lines`, or they can't be transformed."""
    parts = _moving_lines(_placed(source, crs_wkt))
    return LayerLines.of(source.name, parts, source.fields, system_of(crs_wkt or source.crs_wkt, progress), progress)


def _moving_lines(features: Iterable[Feature]) -> Iterator[tuple[int, Row, np.ndarray]]:
    """Yield number and values of features, and the vertices, (n, 3), of each of their lines that has a length."""
    for feature in features:
        for moving in map(_moving, feature.of_kind(LINE)):
            if len(moving) > 1:
                yield feature.number, feature.row, moving


def read_rows(source: FeatureSource, progress: Progress) -> Rows:
    """Read the values of all features, and the names of their fields."""
    return [row for _, row in progress.follow(source.rows(), source.count)], source.fields


def read_lines_along(source: FeatureSource, crs_wkt: str | None) -> list[np.ndarray]:
    """Read lines that show places along tracks, (k, 2) each, in a coordinate system.

    Raises RailExtractError if there is none, one leads to a place that is not on the map, or they can't be transformed.
    """
    lines = [line for _, line in _lines_along(source, _placed(source, crs_wkt), crs_wkt)]
    if not lines:
        raise MissingError(source.name, "line")
    return lines


def read_guides(source: FeatureSource, crs_wkt: str | None) -> list[GuideLine]:
    """Read such lines with the name, reference and gauge of the track along each; see `read_lines_along`."""
    features = _placed(source, crs_wkt)
    if any(kind == POLYGON for feature in features for kind, _ in feature.parts):
        raise ParameterError(f"{source.name} has polygons: give lines along the tracks, one for each.")
    guides = [
        GuideLine(
            feature.number,
            line,
            gauge_of(feature.row.get("gauge")),
            *(str(feature.row.get(name) or "") for name in ("name", "ref")),
        )
        for feature, line in _lines_along(source, features, crs_wkt)
    ]
    if not guides:
        raise MissingError(source.name, "line")
    return guides


def read_seeds(source: FeatureSource, crs_wkt: str | None) -> list[np.ndarray]:
    """Read points, (1, 2) each, and lines, (k, 2) each; see `read_lines_along`."""
    features = _placed(source, crs_wkt)
    points = [vertices[:, :2] for feature in features for vertices in feature.of_kind(POINT)]
    found = [*points, *(line for _, line in _lines_along(source, features, crs_wkt))]
    if not found:
        raise RailExtractError(
            f"{source.name} has neither points nor lines: add points on railheads, or choose another layer."
        )
    return found


def read_mask(source: FeatureSource, crs_wkt: str | None) -> Mask:
    """Read the polygons of a mask, of which overlaps count once.

    Raises RailExtractError if there is none, one is not on the map, or they can't be transformed.
    """
    _placed(source, crs_wkt)
    rings = source.rings(crs_wkt)
    if not rings:
        raise MissingError(source.name, "polygon")
    return Mask.of(rings)


def read_axes(
    axis: FeatureSource,
    start: tuple[float, bool] | None,
    posts: FeatureSource | None,
    post_field: str | None,
    jumps: FeatureSource | None,
    notation: str,
    crs_wkt: str | None,
) -> PlacedAxes:
    """Read an axis and what states its kilometres, in a projected coordinate system, or None for metres as they are.

    `start` is the kilometre of the first vertex, and whether kilometres decrease from there. Raises RailExtractError if
    a layer can't be transformed or lacks what it should state, or they contradict each other.
    """
    unit_m = unit_in_plan(crs_wkt)
    lines = list(_axis_lines(axis, crs_wkt, unit_m))
    if not lines:
        raise MissingError(axis.name, "line")
    made = make_axes(
        lines,
        AxisStart(*start) if start else None,
        _posts(posts, post_field, crs_wkt) if posts else [],
        _jumps(jumps) if jumps else [],
    )
    if axis.crs_wkt and crs_wkt and parse_crs(axis.crs_wkt) != parse_crs(crs_wkt):
        moved = f"AXIS is in {title_of(axis.crs_wkt)} and was transformed to {title_of(crs_wkt)}."
        made = Axes(made.axes, (moved, *made.notices))
    return PlacedAxes(made, unit_m, notation)


def _placed(source: FeatureSource, crs_wkt: str | None) -> list[Feature]:
    """Return the features in another coordinate system, all of which are on the map."""
    features, unit_m = list(source.features(crs_wkt)), unit_in_plan(source.crs_wkt)
    for feature in features:
        check_places(feature.bounds, source.where(feature.number), unit_m)
    if any(feature.is_lost for feature in features):
        raise CrsError(
            f"{source.name} can't be transformed to the coordinate system of the cloud ({title_of(crs_wkt)}): check "
            "that both are assigned as the data were made."
        )
    return features


def _lines_along(
    source: FeatureSource, features: Sequence[Feature], crs_wkt: str | None
) -> Iterator[tuple[Feature, np.ndarray]]:
    """Yield the lines, (k, 2), without stray vertices."""
    unit_m = unit_in_plan(crs_wkt or source.crs_wkt)
    for feature in features:
        for moving in map(_moving, feature.of_kind(LINE)):
            if len(moving) > 1:
                yield feature, check_line(moving[:, :2], source.where(feature.number), unit_m)


def _moving(vertices: np.ndarray) -> np.ndarray:
    """Return x, y and z of vertices, (n, 4), without those that repeat the place before."""
    return without_steps(vertices[:, :3].copy())


def _measured_features(source: FeatureSource, crs_wkt: str | None) -> Iterator[Feature]:
    """Yield the features of a layer in the plane in which kilometres are measured."""
    for feature in source.features(crs_wkt):
        if feature.is_lost:
            raise CrsError(
                f"{source.name} can't be transformed to {title_of(crs_wkt)}, in which kilometres are measured: check "
                "that both coordinate systems are assigned as the data were made."
            )
        yield feature


def _axis_lines(source: FeatureSource, crs_wkt: str | None, unit_m: float) -> Iterator[AxisLine]:
    """Yield the parts of all lines that have a length."""
    named = next((name for name in NAME_FIELDS if name in source.fields), None)
    for feature in _measured_features(source, crs_wkt):
        name = (feature.row[named] if named else None) or ""
        for vertices in feature.of_kind(LINE):
            if len(vertices) > 1 and (np.ptp(vertices[:, :2], axis=0) > 0).any():
                yield AxisLine(str(name), vertices[:, :2] * unit_m, vertices[:, 3])


def _posts(source: FeatureSource, field: str | None, crs_wkt: str | None) -> list[Post]:
    """Read the posts."""
    name = field or first_post_field(source.fields)
    if name not in source.fields:
        raise ParameterError(f"POSTS has no field {name}: it has {', '.join(source.fields)}.")
    found = [
        Post(xy * unit_in_plan(crs_wkt), km_of(feature.row[name], name, "POSTS", feature.number))
        for feature in _measured_features(source, crs_wkt)
        for vertices in feature.of_kind(POINT)
        for xy in vertices[:, :2]
    ]
    if not found:
        raise MissingError(source.name, "point")
    return found


def _jumps(source: FeatureSource) -> list[Jump]:
    """Read the table of jumps."""
    check_jumps(source.fields)
    return [Jump(*(km_of(row[name], name, "JUMPS", number) for name in (BACK, AHEAD))) for number, row in source.rows()]


@dataclass(frozen=True)
class PlacedFeatures:
    """Features of a layer in the plane of an axis.

    `xy`, (n, 2), is where each counts: half way along a line, inside a polygon, in the mean of points; else `FAR` or
    `NOWHERE`. `vertices`, (m, 2), are those of all features, of a polygon those of its outer ring, and `owner`, (m,),
    the number of the feature of each. `originals` is for a `Copy` with further fields.
    """

    ids: Sequence[int]
    xy: np.ndarray
    vertices: np.ndarray
    owner: np.ndarray
    are_points: bool
    originals: FeatureSource


def places_of(source: FeatureSource, plane: str | None, progress: Progress) -> PlacedFeatures:
    """Read where the features of a layer count in the plane of axes."""
    for notice in source.notices:
        progress.warning(notice)
    features, unit_m = list(progress.follow(source.features(plane), source.count)), unit_in_plan(plane)
    shapes = [np.concatenate([np.empty((0, 4)), *(part for _, part in one.parts)])[:, :2] for one in features]
    xy = [_place(feature, shape, unit_m) for feature, shape in zip(features, shapes)]
    return PlacedFeatures(
        [feature.number for feature in features],
        np.reshape(xy, (-1, 2)),
        np.concatenate([np.empty((0, 2)), *shapes]),
        np.repeat(np.arange(len(shapes)), list(map(len, shapes))),
        source.kinds == {POINT},
        source,
    )


def _place(feature: Feature, shape: np.ndarray, unit_m: float) -> np.ndarray:
    """Return where a feature with these vertices, (n, 2), counts."""
    if feature.is_lost or not are_places(shape, unit_m).all():
        return FAR
    return feature.middle() if len(shape) else NOWHERE
