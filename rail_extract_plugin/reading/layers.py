"""Vector layers as QGIS reads them, for the checks of `core.jobs.features`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
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

from ...core.clouds.crs import unit_in_plan
from ...core.errors import CrsError, ParameterError
from ...core.jobs.declaration import LINE, POINT, POLYGON
from ...core.jobs.features import Feature, FeatureSource
from ..systems import system

CHORD_TOLERANCE_M = 0.0005
"""Greatest deviation of the chords that approximate a curved line: well below the accuracy of a survey."""

MIXED = "JSON"
"""Type that QGIS gives to a field with values of several types: it takes them for objects, and is left with none."""

OBJECTS = (
    "{} has objects, or both numbers and texts, in {}: objects become texts, and QGIS drops numbers and texts that are "
    "in one field."
)

GEOMETRY_AS_IT_IS = QgsProcessingFeatureSource.Flag.FlagSkipGeometryValidityChecks

KINDS = {
    QgsWkbTypes.GeometryType.PointGeometry: POINT,
    QgsWkbTypes.GeometryType.LineGeometry: LINE,
    QgsWkbTypes.GeometryType.PolygonGeometry: POLYGON,
}


class LayerSource(FeatureSource):
    """A layer that an algorithm was given for the parameter of this name."""

    def __init__(self, name: str, source: QgsProcessingFeatureSource, context: QgsProcessingContext) -> None:
        self.name, self.source, self._context = name, source, context
        self.crs_wkt = wkt_of(source.sourceCrs()) or None
        self.fields, self.count = source.fields().names(), source.featureCount()
        kind = QgsWkbTypes.geometryType(source.wkbType())
        is_table = kind == QgsWkbTypes.GeometryType.NullGeometry
        self.kinds = {KINDS[kind]} if kind in KINDS else set() if is_table else set(KINDS.values())
        objects = [field.name() for field in source.fields() if field.typeName() == MIXED]
        self.notices = [OBJECTS.format(name, ", ".join(objects))] if objects else []

    def rows(self) -> Iterator[tuple[int, Row]]:
        """Yield number and values of each feature."""
        return ((feature.id(), Row(feature)) for feature in self.stored())

    def features(self, crs_wkt: str | None) -> Iterator[Feature]:
        """Yield the features in a coordinate system."""
        chord = CHORD_TOLERANCE_M / unit_in_plan(crs_wkt or self.crs_wkt)
        for feature, shape in self._moved(crs_wkt):
            bounds, parts = bounds_of(feature.geometry()), _parts(shape, chord) if shape else []
            yield Feature(feature.id(), Row(feature), bounds, parts, shape is None, partial(_middle, shape))

    def rings(self, crs_wkt: str | None) -> list[np.ndarray]:
        """Return the rings of the polygons and of their holes; overlaps count once."""
        shapes = [shape.makeValid() for _, shape in self._moved(crs_wkt) if shape and not shape.isNull()]
        united = QgsGeometry.unaryUnion(shapes)
        _straighten(united, CHORD_TOLERANCE_M)
        polygons = [part for part in united.constParts() if isinstance(part, QgsPolygon)] if shapes else []
        return [
            np.array([(point.x(), point.y()) for point in ring.points()])
            for part in polygons
            for ring in (part.exteriorRing(), *(part.interiorRing(at) for at in range(part.numInteriorRings())))
        ]

    def stored(self) -> Iterator[QgsFeature]:
        """Yield the features as they are."""
        return self.source.getFeatures(QgsFeatureRequest(), GEOMETRY_AS_IT_IS)

    def _moved(self, crs_wkt: str | None) -> Iterator[tuple[QgsFeature, QgsGeometry | None]]:
        """Yield features with their geometries in another coordinate system, None where one has no place there."""
        change = QgsCoordinateTransform(self.source.sourceCrs(), system(crs_wkt), self._context.transformContext())
        for feature in self.stored():
            shape = QgsGeometry(feature.geometry())
            yield feature, shape if transform(shape, change) else None


class Row(Mapping[str, Any]):
    """The values of a feature by the name of the field, None where one is empty."""

    def __init__(self, feature: QgsFeature) -> None:
        self._feature = feature

    def __getitem__(self, name: str) -> Any:
        """Return the value of a field; raises KeyError if there is no such field.

        Raises ParameterError if QGIS drops the values of the field, as it does where GeoJSON has both whole numbers and
        texts in one.
        """
        index = self._feature.fields().lookupField(name)
        if index < 0:
            raise KeyError(name)
        value = self._feature.attribute(index)
        if value == NULL and self._feature.fields().at(index).typeName() == MIXED:
            raise ParameterError(
                f"The field {name} has both numbers and texts, and QGIS drops them all: write all of them as texts."
            )
        return None if value == NULL else value

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the fields."""
        return iter(self._feature.fields().names())

    def __len__(self) -> int:
        """Return the number of fields."""
        return len(self._feature.fields())


def read_place(
    place: QgsPointXY,
    own: QgsCoordinateReferenceSystem,
    crs: QgsCoordinateReferenceSystem,
    context: QgsProcessingContext,
) -> np.ndarray:
    """Return a place in the coordinate system of the cloud, (1, 2), from its `own` system.

    Raises CrsError if it can't be transformed.
    """
    shape = QgsGeometry.fromPointXY(place)
    if not transform(shape, QgsCoordinateTransform(own, crs, context.transformContext())):
        raise CrsError("SEED can't be transformed to the coordinate system of the cloud: pick it on the cloud.")
    return np.array([[shape.asPoint().x(), shape.asPoint().y()]])


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


def _middle(shape: QgsGeometry) -> np.ndarray:
    """Return where a geometry counts, (2,)."""
    kind = KINDS.get(QgsWkbTypes.geometryType(shape.wkbType()))
    point = shape.interpolate(shape.length() / 2) if kind == LINE else shape.centroid()
    point = shape.pointOnSurface() if kind == POLYGON else point
    return np.full(2, np.nan) if point.isNull() else np.array([point.constGet().x(), point.constGet().y()])


def _straighten(shape: QgsGeometry, chord: float) -> None:
    """Replace curves by chords that stay within a distance."""
    shape.convertToStraightSegment(chord, QgsAbstractGeometry.SegmentationToleranceType.MaximumDifference)


def _parts(shape: QgsGeometry, chord: float) -> list[tuple[str, np.ndarray]]:
    """Return kind and vertices, (n, 4), of each part; of a polygon, the outer ring."""
    if shape.isNull():
        return []
    _straighten(shape, chord)
    found = []
    for part in shape.constParts():
        kind = KINDS.get(QgsWkbTypes.geometryType(part.wkbType()), "")
        line = part.exteriorRing() if kind == POLYGON else part
        xyzm = [(one.x(), one.y(), one.z(), one.m()) for one in line.vertices()]
        if kind and xyzm:
            found.append((kind, np.array(xyzm, dtype=float)))
    return found
