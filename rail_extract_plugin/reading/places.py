"""The features of a layer and their places along axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsField,
    QgsFields,
    QgsGeometry,
    QgsProcessingContext,
    QgsProcessingFeatureSource,
    QgsWkbTypes,
)

from ...core.design_places import are_places
from ...core.fields import EXTENT_FIELDS, STATION_FIELDS, Field
from ...core.kilometres.axes import PlacedAxes
from ...core.progress import Progress
from ...core.rails import Kilometres
from ..compat import TEXT
from .axes import moved_shapes
from .line_layers import MIXED, bounds_of

NOWHERE, FAR = np.full(2, np.nan), np.full(2, np.inf)
"""Place of a feature without geometry, and of one that is not on the map."""


@dataclass(frozen=True)
class LocatedFeatures:
    """Features of a layer, in its own coordinates, and their kilometres.

    Attributes
    ----------
    features : list of QgsFeature
    kilometres : Kilometres
        Of each feature.
    extents_km : (n, 2) array
        Smallest and largest kilometre of the vertices of each feature; NaN without any.
    """

    features: list[QgsFeature]
    kilometres: Kilometres
    extents_km: np.ndarray

    def rows(self) -> list[list[Any]]:
        """Return the values of `STATION_FIELDS`, then of `EXTENT_FIELDS`, for each feature."""
        profiles = [getattr(self.kilometres, column.name) for column in STATION_FIELDS]
        columns = zip((*STATION_FIELDS, *EXTENT_FIELDS), (*profiles, *self.extents_km.T))
        return [list(row) for row in zip(*([field.value(known) for known in own] for field, own in columns))]

    def figures(self) -> dict[str, int]:
        """Return the numbers of features with, without and with an ambiguous kilometre, as outputs."""
        known = int(np.isfinite(self.kilometres.km).sum())
        doubtful = sum(map(bool, self.kilometres.ambiguous))
        return {"PLACE_COUNT": known, "BEYOND_COUNT": len(self.features) - known, "AMBIGUOUS_COUNT": doubtful}


def station_fields(source: QgsProcessingFeatureSource) -> tuple[Field, ...]:
    """Return the fields that the features of a layer get."""
    is_point = QgsWkbTypes.geometryType(source.wkbType()) == QgsWkbTypes.GeometryType.PointGeometry
    return STATION_FIELDS if is_point else (*STATION_FIELDS, *EXTENT_FIELDS)


def kept_fields(source: QgsProcessingFeatureSource, progress: Progress) -> QgsFields:
    """Return the fields of a layer as a copy has them: those of objects, which few formats hold, become texts."""
    kept, objects = QgsFields(), []
    for one in source.fields():
        kept.append(QgsField(one.name(), TEXT) if one.typeName() == MIXED else one)
        objects += [one.name()] if one.typeName() == MIXED else []
    if objects:
        progress.warning(
            f"INPUT has objects, or both numbers and texts, in {', '.join(objects)}: objects become texts, and QGIS "
            "drops numbers and texts that are in one field."
        )
    return kept


def locate_features(
    source: QgsProcessingFeatureSource,
    axes: PlacedAxes,
    crs: QgsCoordinateReferenceSystem,
    context: QgsProcessingContext,
    progress: Progress,
) -> LocatedFeatures:
    """Find the kilometres of the features of a layer.

    Parameters
    ----------
    source : QgsProcessingFeatureSource
    axes : PlacedAxes
    crs : QgsCoordinateReferenceSystem
        Of the axes.
    context : QgsProcessingContext
    progress : Progress
    """
    moved = moved_shapes(source, crs, context)
    found = list(progress.span(0, 0.3).follow(moved, source.featureCount()))
    places = np.array([_place(shape, axes.unit_m) for _, shape in found]).reshape(-1, 2)
    known = axes.on_map(places, [feature.id() for feature, _ in found], progress)
    kilometres = Kilometres.empty(len(found))
    kilometres.put(known, axes.locate(places[known], progress.span(0.3, 0.7)))
    shapes = [shape if on_map else None for (_, shape), on_map in zip(found, known)]
    extents_km = _extents(shapes, axes, progress.span(0.7, 1.0))
    return LocatedFeatures([feature for feature, _ in found], kilometres, extents_km)


def _place(shape: QgsGeometry | None, unit_m: float) -> np.ndarray:
    """Return where a feature counts, (2,): half way along a line, inside a polygon, in the mean of points."""
    if shape is None or not are_places(bounds_of(shape), unit_m).all():
        return FAR
    if shape.isNull() or shape.isEmpty():
        return NOWHERE
    kind = QgsWkbTypes.geometryType(shape.wkbType())
    if kind == QgsWkbTypes.GeometryType.LineGeometry:
        point = shape.interpolate(shape.length() / 2)
    elif kind == QgsWkbTypes.GeometryType.PolygonGeometry:
        point = shape.pointOnSurface()
    else:
        point = shape.centroid()
    if point.isNull():
        return NOWHERE
    return np.array([point.constGet().x(), point.constGet().y()])


def _extents(shapes: list[QgsGeometry | None], axes: PlacedAxes, progress: Progress) -> np.ndarray:
    """Return the smallest and the largest kilometre of the vertices of shapes other than points, (n, 2)."""
    numbers, vertices = [], []
    for number, shape in enumerate(shapes):
        if shape is not None and QgsWkbTypes.geometryType(shape.wkbType()) != QgsWkbTypes.GeometryType.PointGeometry:
            own = [(vertex.x(), vertex.y()) for vertex in shape.vertices()]
            vertices += own
            numbers += [number] * len(own)
    extents = np.full((len(shapes), 2), np.nan)
    km = axes.kilometres(np.array(vertices).reshape(-1, 2), progress).km
    np.fmin.at(extents[:, 0], numbers, km)
    np.fmax.at(extents[:, 1], numbers, km)
    return extents
