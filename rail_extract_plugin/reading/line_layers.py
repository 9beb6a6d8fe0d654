"""Lines, points and polygons read from vector layers: those of Rail Extract, or drawn by hand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from qgis.core import (
    NULL,
    QgsAbstractGeometry,
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsCsException,
    QgsFeature,
    QgsFeatureRequest,
    QgsGeometry,
    QgsPointXY,
    QgsPolygon,
    QgsProcessingContext,
    QgsProcessingFeatureSource,
    QgsWkbTypes,
)

from ...core.airborne.survey import Guide, gauge_of
from ...core.clouds.crs import unit_in_plan
from ...core.clouds.mask import Mask
from ...core.design_places import check_line, check_places
from ...core.errors import CrsError, MissingError, ParameterError, RailExtractError
from ...core.jobs.lines import Lines, system_of, without_steps
from ...core.jobs.values import Rows
from ...core.progress import SILENT, Progress

CHORD_TOLERANCE_M = 0.0005
"""Greatest deviation of the chords that approximate a curved line: well below the accuracy of a survey."""

MIXED = "JSON"
"""Type that QGIS gives to a field with values of several types: it takes them for objects, and is left with none."""

GEOMETRY_AS_IT_IS = QgsProcessingFeatureSource.Flag.FlagSkipGeometryValidityChecks


def read_lines(source: QgsProcessingFeatureSource, progress: Progress = SILENT, name: str = "INPUT") -> Lines:
    """Read all parts of all lines, in one local frame.

    Parameters
    ----------
    source : QgsProcessingFeatureSource
    progress : Progress
    name : str
        Name of the layer's parameter, for messages.

    Raises
    ------
    RailExtractError
        The lines are in degrees, there is none, or one has an impossible vertex.
    """
    system = system_of(wkt_of(source.sourceCrs()) if source.sourceCrs().isValid() else None, progress)
    parts = (
        (feature.id(), row_of(feature), vertices)
        for feature in progress.follow(
            source.getFeatures(QgsFeatureRequest(), GEOMETRY_AS_IT_IS), source.featureCount()
        )
        for vertices in _parts(feature.geometry(), CHORD_TOLERANCE_M / system[1])
    )
    return Lines.of(name, parts, source.fields().names(), system, progress)


def row_of(feature: QgsFeature) -> dict[str, Any]:
    """Return the values of a feature by the name of the field, None where one is empty."""
    return {
        name: None if value == NULL else value for name, value in zip(feature.fields().names(), feature.attributes())
    }


def rows_of(source: QgsProcessingFeatureSource, progress: Progress = SILENT) -> Rows:
    """Return the values of the features of a table by the name of the field, None where one is empty, and all names.

    Raises
    ------
    ParameterError
        QGIS drops the values of a field; see `value_of`.
    """
    names = source.fields().names()
    features = progress.follow(source.getFeatures(QgsFeatureRequest(), GEOMETRY_AS_IT_IS), source.featureCount())
    return [{name: value_of(feature, name) for name in names} for feature in features], names


def read_guide(
    source: QgsProcessingFeatureSource, crs: QgsCoordinateReferenceSystem, context: QgsProcessingContext
) -> tuple[np.ndarray, ...]:
    """Read the lines of a guide, (k, 2) each, in the coordinate system of the cloud.

    Parameters
    ----------
    source : QgsProcessingFeatureSource
    crs : QgsCoordinateReferenceSystem
        That of the cloud. Without one, or if the guide has none, the coordinates are taken as they are.
    context : QgsProcessingContext

    Raises
    ------
    CrsError
        The lines can't be transformed.
    RailExtractError
        The layer has no line.
    """
    lines = tuple(line for _, line in _guides(source, crs, context, "GUIDE"))
    if not lines:
        raise MissingError("GUIDE", "line")
    return lines


def read_tracks_meant(
    source: QgsProcessingFeatureSource, crs: QgsCoordinateReferenceSystem, context: QgsProcessingContext
) -> tuple[Guide, ...]:
    """Read the lines of a guide in the coordinate system of the cloud, with the name, reference and gauge of each.

    Parameters
    ----------
    source, crs, context
        See `read_guide`.
    """
    guides = tuple(
        Guide(
            feature.id(),
            line,
            gauge_of(value_of(feature, "gauge")),
            *(str(value_of(feature, name) or "") for name in ("name", "ref")),
        )
        for feature, line in _guides(source, crs, context, "GUIDE")
    )
    if not guides:
        raise MissingError("GUIDE", "line")
    return guides


def read_seeds(
    source: QgsProcessingFeatureSource, crs: QgsCoordinateReferenceSystem, context: QgsProcessingContext
) -> tuple[np.ndarray, ...]:
    """Read the points of a layer, (1, 2) each, and its lines, (k, 2) each, in the coordinate system of the cloud.

    Parameters
    ----------
    source, crs, context
        See `read_guide`.

    Raises
    ------
    CrsError
        They can't be transformed.
    RailExtractError
        The layer has neither points nor lines.
    """
    points = [
        np.array([[vertex.x(), vertex.y()]])
        for _, shape in _transformed(source, crs, context, "SEEDS")
        if QgsWkbTypes.geometryType(shape.wkbType()) == QgsWkbTypes.GeometryType.PointGeometry
        for vertex in shape.vertices()
    ]
    found = [*points, *(line for _, line in _guides(source, crs, context, "SEEDS"))]
    if not found:
        raise RailExtractError("SEEDS has neither points nor lines: add points on railheads, or choose another layer.")
    return tuple(found)


def read_place(
    place: QgsPointXY,
    own: QgsCoordinateReferenceSystem,
    crs: QgsCoordinateReferenceSystem,
    context: QgsProcessingContext,
) -> np.ndarray:
    """Return a place in the coordinate system of the cloud, (1, 2).

    Parameters
    ----------
    place : QgsPointXY
    own : QgsCoordinateReferenceSystem
        That of the place.
    crs, context
        See `read_guide`.

    Raises
    ------
    CrsError
        It can't be transformed.
    """
    shape = QgsGeometry.fromPointXY(place)
    if not transform(shape, QgsCoordinateTransform(own, crs, context.transformContext())):
        raise CrsError("SEED can't be transformed to the coordinate system of the cloud: pick it on the cloud.")
    return np.array([[shape.asPoint().x(), shape.asPoint().y()]])


def read_mask(
    source: QgsProcessingFeatureSource, crs: QgsCoordinateReferenceSystem, context: QgsProcessingContext
) -> Mask:
    """Read the polygons of a mask in the coordinate system of the cloud; overlaps count once.

    Parameters
    ----------
    source, crs, context
        See `read_guide`.

    Raises
    ------
    CrsError
        The polygons can't be transformed.
    RailExtractError
        The layer has no polygon.
    """
    shapes = [shape.makeValid() for _, shape in _transformed(source, crs, context, "MASK") if not shape.isNull()]
    united = QgsGeometry.unaryUnion(shapes)
    united.convertToStraightSegment(CHORD_TOLERANCE_M, QgsAbstractGeometry.SegmentationToleranceType.MaximumDifference)
    polygons = [part for part in united.constParts() if isinstance(part, QgsPolygon)] if shapes else []
    rings = [
        np.array([(point.x(), point.y()) for point in ring.points()])
        for part in polygons
        for ring in (part.exteriorRing(), *(part.interiorRing(at) for at in range(part.numInteriorRings())))
    ]
    if not rings:
        raise RailExtractError("MASK has no polygons: give a polygon layer.")
    return Mask.of(rings)


def _transformed(
    source: QgsProcessingFeatureSource, crs: QgsCoordinateReferenceSystem, context: QgsProcessingContext, name: str
) -> list[tuple[QgsFeature, QgsGeometry]]:
    """Return the features of a layer, all on the map, with their geometries in another coordinate system."""
    change = QgsCoordinateTransform(source.sourceCrs(), crs, context.transformContext())
    features = list(source.getFeatures(QgsFeatureRequest(), GEOMETRY_AS_IT_IS))
    shapes, unit_m = [feature.geometry() for feature in features], unit_in_plan(wkt_of(source.sourceCrs()))
    for feature, shape in zip(features, shapes):
        check_places(bounds_of(shape), f"{name} (feature {feature.id()})", unit_m)
    if not all(transform(shape, change) for shape in shapes):
        raise CrsError(
            f"{name} can't be transformed to the coordinate system of the cloud ({crs.authid() or crs.description()}): "
            "check that both are assigned as the data were made."
        )
    return list(zip(features, shapes))


def _guides(
    source: QgsProcessingFeatureSource, crs: QgsCoordinateReferenceSystem, context: QgsProcessingContext, name: str
) -> Iterator[tuple[QgsFeature, np.ndarray]]:
    """Yield the lines of a layer that show places along tracks, (k, 2), in another coordinate system."""
    unit_m = unit_in_plan(wkt_of(crs if crs.isValid() else source.sourceCrs()))
    for feature, shape in _transformed(source, crs, context, name):
        if QgsWkbTypes.geometryType(shape.wkbType()) == QgsWkbTypes.GeometryType.LineGeometry:
            for vertices in _parts(shape, CHORD_TOLERANCE_M):
                yield feature, check_line(vertices[:, :2], f"{name} (feature {feature.id()})", unit_m)


def bounds_of(shape: QgsGeometry) -> np.ndarray:
    """Return the smallest and the largest coordinates of a geometry, (2, 2); none, (0, 2), if it is empty."""
    box = shape.boundingBox()
    corners = np.array([[box.xMinimum(), box.yMinimum()], [box.xMaximum(), box.yMaximum()]])
    return np.empty((0, 2)) if shape.isNull() or shape.isEmpty() else corners


def transform(shape: QgsGeometry, change: QgsCoordinateTransform) -> bool:
    """Transform a geometry; False if it lies outside of the area of one of the systems."""
    try:
        shape.transform(change)
    except QgsCsException:
        return False
    return shape.isNull() or shape.boundingBox().isFinite()


def wkt_of(crs: QgsCoordinateReferenceSystem) -> str:
    """Return a coordinate system as WKT 2; empty for an invalid one."""
    return crs.toWkt(QgsCoordinateReferenceSystem.WktVariant.WKT_PREFERRED)


def check_system(crs: QgsCoordinateReferenceSystem) -> None:
    """Check that lines are not in degrees.

    Raises
    ------
    CrsError
        The coordinate system is in degrees.
    """
    if crs.isGeographic():
        raise CrsError(
            f"The lines are in degrees ({crs.description()}), where lengths can't be measured: reproject them, for "
            "example to the UTM zone of the place."
        )


def _parts(geometry: QgsGeometry, chord: float) -> Iterator[np.ndarray]:
    """Yield the vertices, (n, 3), of each part that has a length; heights are NaN unless all vertices have one."""
    if geometry.isNull():
        return
    straight = QgsGeometry(geometry)
    straight.convertToStraightSegment(chord, QgsAbstractGeometry.SegmentationToleranceType.MaximumDifference)
    for part in straight.constParts():
        xyz = np.array([(vertex.x(), vertex.y(), vertex.z()) for vertex in part.vertices()], dtype=float).reshape(-1, 3)
        xyz = without_steps(xyz)
        if len(xyz) > 1:
            yield xyz


def value_of(feature: QgsFeature, name: str) -> Any:
    """Return the value of a field, or None if the field is missing or empty.

    Raises
    ------
    ParameterError
        QGIS drops the values of the field, as it does where GeoJSON has both whole numbers and texts in one.
    """
    index = feature.fields().lookupField(name)
    value = feature.attribute(index) if index >= 0 else NULL
    if value != NULL:
        return value
    if index >= 0 and feature.fields().at(index).typeName() == MIXED:
        raise ParameterError(
            f"The field {name} has both numbers and texts, and QGIS drops them all: write all of them as texts."
        )
    return None
