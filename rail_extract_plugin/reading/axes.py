"""Axes with kilometres read from vector layers, in the plane in which places are to be located."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from qgis.core import (
    QgsAbstractGeometry,
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsFeature,
    QgsFeatureRequest,
    QgsGeometry,
    QgsProcessingContext,
    QgsProcessingFeatureSource,
    QgsWkbTypes,
)

from ...core.clouds.crs import unit_in_plan
from ...core.errors import CrsError, MissingError
from ...core.kilometres.axes import (
    AHEAD,
    BACK,
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
from ...core.kilometres.stationing import Jump
from .line_layers import CHORD_TOLERANCE_M, GEOMETRY_AS_IT_IS, transform, value_of, wkt_of


@dataclass(frozen=True)
class AxisSources:
    """The layers that state kilometres, and what goes with them; None where a layer is not given."""

    axis: QgsProcessingFeatureSource
    start: Start | None
    posts: QgsProcessingFeatureSource | None
    post_field: str
    jumps: QgsProcessingFeatureSource | None


def read_axes(
    sources: AxisSources, crs: QgsCoordinateReferenceSystem, notation: str, context: QgsProcessingContext
) -> PlacedAxes:
    """Read axes and what states their kilometres, transformed to a coordinate system.

    Parameters
    ----------
    sources : AxisSources
    crs : QgsCoordinateReferenceSystem
        Projected, or invalid for coordinates in metres that nothing transforms.
    notation : str
        One of `text.NOTATIONS`.
    context : QgsProcessingContext

    Raises
    ------
    CrsError
        A layer can't be transformed.
    RailExtractError
        A layer lacks what it should state, or they contradict each other.
    """
    unit_m = unit_in_plan(wkt_of(crs))
    lines = list(_lines(sources.axis, crs, unit_m, context))
    if not lines:
        raise MissingError("AXIS", "line")
    posts = [] if sources.posts is None else _posts(sources.posts, sources.post_field, crs, unit_m, context)
    jumps = [] if sources.jumps is None else _jumps(sources.jumps)
    made = make_axes(lines, sources.start, posts, jumps)
    if sources.axis.sourceCrs().isValid() and crs.isValid() and sources.axis.sourceCrs() != crs:
        theirs, ours = (one.authid() or one.description() for one in (sources.axis.sourceCrs(), crs))
        made = Axes(made.axes, (f"AXIS is in {theirs} and was transformed to {ours}.", *made.notices))
    return PlacedAxes(made, unit_m, notation)


def shapes_in(
    source: QgsProcessingFeatureSource, crs: QgsCoordinateReferenceSystem, context: QgsProcessingContext, name: str
) -> Iterator[tuple[QgsFeature, QgsGeometry]]:
    """Yield the features of a layer with their geometries in another coordinate system.

    Raises
    ------
    CrsError
        A geometry can't be transformed.
    """
    for feature, shape in moved_shapes(source, crs, context):
        if shape is None:
            raise CrsError(
                f"{name} can't be transformed to {crs.authid() or crs.description()}, in which kilometres are "
                "measured: check that both coordinate systems are assigned as the data were made."
            )
        yield feature, shape


def moved_shapes(
    source: QgsProcessingFeatureSource, crs: QgsCoordinateReferenceSystem, context: QgsProcessingContext
) -> Iterator[tuple[QgsFeature, QgsGeometry | None]]:
    """Yield the features of a layer with their geometries in another coordinate system, None where it has no place."""
    change = QgsCoordinateTransform(source.sourceCrs(), crs, context.transformContext())
    for feature in source.getFeatures(QgsFeatureRequest(), GEOMETRY_AS_IT_IS):
        shape = QgsGeometry(feature.geometry())
        yield feature, shape if transform(shape, change) else None


def _lines(
    source: QgsProcessingFeatureSource,
    crs: QgsCoordinateReferenceSystem,
    unit_m: float,
    context: QgsProcessingContext,
) -> Iterator[AxisLine]:
    """Yield the parts of all lines that have a length."""
    named = next((name for name in NAME_FIELDS if source.fields().lookupField(name) >= 0), None)
    for feature, shape in shapes_in(source, crs, context, "AXIS"):
        name = (value_of(feature, named) if named else None) or ""
        maximum = QgsAbstractGeometry.SegmentationToleranceType.MaximumDifference
        shape.convertToStraightSegment(CHORD_TOLERANCE_M / unit_m, maximum)
        for part in shape.constParts():
            vertices = [(one.x() * unit_m, one.y() * unit_m, one.m()) for one in part.vertices()]
            xym = np.array(vertices, dtype=float).reshape(-1, 3)
            if len(xym) > 1 and (np.ptp(xym[:, :2], axis=0) > 0).any():
                yield AxisLine(str(name), xym[:, :2], xym[:, 2])


def _posts(
    source: QgsProcessingFeatureSource,
    field: str,
    crs: QgsCoordinateReferenceSystem,
    unit_m: float,
    context: QgsProcessingContext,
) -> list[Post]:
    """Read the posts."""
    name = field or post_field(source.fields().names())
    found = []
    for feature, shape in shapes_in(source, crs, context, "POSTS"):
        if QgsWkbTypes.geometryType(shape.wkbType()) != QgsWkbTypes.GeometryType.PointGeometry or shape.isEmpty():
            continue
        km = _km(feature, name, "POSTS")
        found += [Post(np.array([one.x(), one.y()]) * unit_m, km) for one in shape.vertices()]
    if not found:
        raise MissingError("POSTS", "point")
    return found


def _jumps(source: QgsProcessingFeatureSource) -> list[Jump]:
    """Read the table of jumps."""
    check_jumps(source.fields().names())
    rows = source.getFeatures(QgsFeatureRequest(), GEOMETRY_AS_IT_IS)
    return [Jump(_km(feature, BACK, "JUMPS"), _km(feature, AHEAD, "JUMPS")) for feature in rows]


def _km(feature: QgsFeature, field: str, name: str) -> float:
    """Return the kilometre in a field; see `km_of`."""
    return km_of(value_of(feature, field), field, name, feature.id())
