"""The features of a layer of any kind, in the plane of axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsGeometry,
    QgsProcessingContext,
    QgsProcessingFeatureSource,
    QgsWkbTypes,
)

from ...core.clouds.crs import unit_in_plan
from ...core.design_places import are_places
from ...core.jobs.places import FAR, NOWHERE, Places
from ...core.progress import Progress
from .axes import moved_shapes
from .line_layers import MIXED, bounds_of, wkt_of


@dataclass(frozen=True)
class Originals:
    """The features of a layer, in its own coordinates."""

    source: QgsProcessingFeatureSource
    features: list[QgsFeature]


def read_places(
    source: QgsProcessingFeatureSource,
    crs: QgsCoordinateReferenceSystem,
    context: QgsProcessingContext,
    name: str,
    progress: Progress,
) -> Places:
    """Read where the features of a layer count.

    Parameters
    ----------
    source : QgsProcessingFeatureSource
    crs : QgsCoordinateReferenceSystem
        Of the axes.
    context : QgsProcessingContext
    name : str
        Name of the layer's parameter, for messages.
    progress : Progress
        Warned of objects, which few formats hold.
    """
    objects = [field.name() for field in source.fields() if field.typeName() == MIXED]
    if objects:
        progress.warning(
            f"{name} has objects, or both numbers and texts, in {', '.join(objects)}: objects become texts, and QGIS "
            "drops numbers and texts that are in one field."
        )
    unit_m = unit_in_plan(wkt_of(crs))
    found = list(progress.follow(moved_shapes(source, crs, context), source.featureCount()))
    xy = np.array([_place(shape, unit_m) for _, shape in found]).reshape(-1, 2)
    vertices, owner = [], []
    for number, (_, shape) in enumerate(found):
        if shape is not None:
            own = [(vertex.x(), vertex.y()) for vertex in shape.vertices()]
            vertices += own
            owner += [number] * len(own)
    features = [feature for feature, _ in found]
    return Places(
        [feature.id() for feature in features],
        xy,
        np.array(vertices).reshape(-1, 2),
        np.array(owner, dtype=int),
        QgsWkbTypes.geometryType(source.wkbType()) == QgsWkbTypes.GeometryType.PointGeometry,
        Originals(source, features),
    )


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
