"""Rails and centerlines read from vector layers: those of Rail Extract, or lines drawn by hand."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
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
from ...core.clouds.crs import MAX_COORDINATE, parse_crs, units, warn_of_scale
from ...core.clouds.mask import Mask
from ...core.comparison.tracks import SurveyedLine
from ...core.design_places import check_line, check_places, has_stray
from ...core.errors import CrsError, MissingError, ParameterError, RailExtractError
from ...core.fields import CENTERLINE_FIELDS, RAIL_FIELDS, Field
from ...core.frame import ORIGIN_STEP, LocalFrame
from ...core.jobs.values import Rows
from ...core.polyline import Polyline
from ...core.progress import SILENT, Progress
from ...core.rails import NO_GAPS, SAME_SUM_M, Centerline, RailLine

CHORD_TOLERANCE_M = 0.0005
"""Greatest deviation of the chords that approximate a curved line: well below the accuracy of a survey."""

MAX_WHOLE, ID = 2**31 - 1, re.compile(r"\s*\d{1,10}\s*")
"""Largest whole number of a field in every format, and an id in a list of them."""

MIXED = "JSON"
"""Type that QGIS gives to a field with values of several types: it takes them for objects, and is left with none."""

GEOMETRY_AS_IT_IS = QgsProcessingFeatureSource.Flag.FlagSkipGeometryValidityChecks


def read_rails(
    source: QgsProcessingFeatureSource, progress: Progress = SILENT, name: str = "INPUT", default_class: int = 0
) -> tuple[tuple[RailLine, ...], LocalFrame]:
    """Read all parts of all lines, in one local frame.

    Lines without a `rail_id` get the id of their feature, and those without a `class_code` get `default_class`. Other
    fields of rails are used if they exist.

    Parameters
    ----------
    source : QgsProcessingFeatureSource
    progress : Progress
    name : str
        Name of the layer's parameter, for messages.
    default_class : int

    Raises
    ------
    CrsError
        The lines are in degrees.
    RailExtractError
        The layer has no line, or a line with an invalid vertex.
    """
    found, frame = _read(source, progress, name)
    rails = tuple(_rail(feature, xyz, default_class) for feature, xyz in found)
    flat = sum(bool(np.isnan(rail.xyz[0, 2])) for rail in rails)
    if flat:
        progress.warning(f"{flat} of {len(rails)} lines have no heights, so their results have none.")
    copies = len(rails) - len({rail.xyz.tobytes() for rail in rails})
    if copies:
        progress.warning(f"{copies} of {len(rails)} lines are duplicates: their results appear twice.")
    return rails, frame


def read_centerlines(
    source: QgsProcessingFeatureSource, progress: Progress = SILENT, name: str = "INPUT"
) -> tuple[tuple[Centerline, ...], LocalFrame]:
    """Read all parts of all lines, as `read_rails` does; figures without a field are NaN.

    Lines without a `track_id` get the id of their feature; those without `left_ids` or `right_ids` have none.

    Parameters
    ----------
    source, progress, name
        See `read_rails`.
    """
    found, frame = _read(source, progress, name)
    return tuple(_centerline(feature, xyz) for feature, xyz in found), frame


def read_surveyed(
    source: QgsProcessingFeatureSource, progress: Progress, name: str
) -> tuple[tuple[SurveyedLine, ...], LocalFrame]:
    """Read all parts of all lines with their standard errors, as `read_rails` does.

    A line's number is its `rail_id`, else its `track_id`, else the id of its feature. With a `track_id` only, it is a
    centerline.

    Parameters
    ----------
    source, progress, name
        See `read_rails`.
    """
    found, frame = _read(source, progress, name)
    names = source.fields().names()
    id_field = next((one for one in ("rail_id", "track_id") if one in names), "")
    return tuple(_surveyed(feature, xyz, id_field) for feature, xyz in found), frame


def rows_of(source: QgsProcessingFeatureSource, progress: Progress = SILENT) -> Rows:
    """Return the values of the features by the name of the field, None where one is empty, and all names.

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
    shapes, unit_m = [feature.geometry() for feature in features], _unit_m(source.sourceCrs())
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
    unit_m = _unit_m(crs if crs.isValid() else source.sourceCrs())
    for feature, shape in _transformed(source, crs, context, name):
        if QgsWkbTypes.geometryType(shape.wkbType()) == QgsWkbTypes.GeometryType.LineGeometry:
            for vertices in _parts(shape, CHORD_TOLERANCE_M):
                yield feature, check_line(vertices[:, :2], f"{name} (feature {feature.id()})", unit_m)


def _unit_m(crs: QgsCoordinateReferenceSystem) -> float:
    """Return the unit of a coordinate system in plan; that of degrees, or of an unknown one, counts as 1."""
    return units(parse_crs(wkt_of(crs)))[0] if crs.isValid() and not crs.isGeographic() else 1.0


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


def _read(
    source: QgsProcessingFeatureSource, progress: Progress, name: str
) -> tuple[list[tuple[QgsFeature, np.ndarray]], LocalFrame]:
    """Read the features, and the vertices of each of their parts, (n, 3) local metres."""
    crs_wkt, horizontal_unit_m, vertical_unit_m = system_of(source.sourceCrs(), progress)
    request = QgsFeatureRequest()
    found = [
        (feature, vertices)
        for feature in progress.follow(source.getFeatures(request, GEOMETRY_AS_IT_IS), source.featureCount())
        for vertices in _parts(feature.geometry(), CHORD_TOLERANCE_M / horizontal_unit_m)
    ]
    if not found:
        raise MissingError(name, "line")
    lost = next((feature.id() for feature, vertices in found if _is_impossible(vertices)), None)
    if lost is not None:
        raise RailExtractError(
            f"{name} has a line (feature {lost}) with a coordinate that is not a number, or larger than "
            f"{MAX_COORDINATE:.0e}: repair or delete it."
        )
    stray = next((feature.id() for feature, vertices in found if has_stray(vertices[:, :2] * horizontal_unit_m)), None)
    if stray is not None:
        raise RailExtractError(f"{name} has a line (feature {stray}) with a stray vertex: repair or delete it.")
    middle = np.median(np.concatenate([vertices for _, vertices in found]), axis=0)
    origin = np.round(np.nan_to_num(middle) / ORIGIN_STEP) * ORIGIN_STEP
    if crs_wkt:
        warn_of_scale(parse_crs(crs_wkt), [tuple(middle[:2])], "The lines are", progress, "them")
    frame = LocalFrame(origin, horizontal_unit_m, vertical_unit_m, crs_wkt)
    return [(feature, frame.to_local(vertices)) for feature, vertices in found], frame


def _is_impossible(vertices: np.ndarray) -> bool:
    """Return whether a vertex, of (n, 3), has no place in plan, or a coordinate larger than that of any place."""
    return not (np.abs(vertices[:, :2]) <= MAX_COORDINATE).all() or bool(
        (np.abs(vertices[:, 2]) > MAX_COORDINATE).any()
    )


def system_of(crs: QgsCoordinateReferenceSystem, progress: Progress) -> tuple[str | None, float, float]:
    """Return the coordinate system as WKT, and its horizontal and vertical units in metres."""
    if not crs.isValid():
        progress.warning("The lines have no coordinate system: their coordinates are taken as metres.")
        return None, 1.0, 1.0
    check_system(crs)
    wkt = wkt_of(crs)
    return (wkt, *units(parse_crs(wkt)))


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
        if not np.isfinite(xyz[:, 2]).all():
            xyz[:, 2] = np.nan
        moves = np.append(True, np.any(np.diff(xyz[:, :2], axis=0) != 0, axis=1))
        if moves.sum() > 1:
            yield xyz[moves]


def _rail(feature: QgsFeature, xyz: np.ndarray, default_class: int) -> RailLine:
    defaults = {"rail_id": feature.id(), "class_code": default_class}
    values = _attributes(feature, RailLine, RAIL_FIELDS, defaults)
    return RailLine(xyz, **{**values, "gaps": gaps_of(feature, xyz)})


def _surveyed(feature: QgsFeature, xyz: np.ndarray, id_field: str) -> SurveyedLine:
    number = _whole(feature, id_field, feature.id())
    sigma_mm, sigmaz_mm = (_number(feature, name, math.nan) for name in ("sigma_mm", "sigmaz_mm"))
    return SurveyedLine(number, xyz, sigma_mm / 1000, sigmaz_mm / 1000, id_field != "track_id")


def _centerline(feature: QgsFeature, xyz: np.ndarray) -> Centerline:
    defaults = {"track_id": feature.id()}
    return Centerline(xyz, **_attributes(feature, Centerline, CENTERLINE_FIELDS, defaults))


def _attributes(
    feature: QgsFeature, kind: type, columns: Sequence[Field], defaults: Mapping[str, float]
) -> dict[str, Any]:
    """Read the attributes of a line from its fields.

    Parameters
    ----------
    feature : QgsFeature
    kind : type
        Dataclass of the line. Fields that it computes itself, such as the length, are not read.
    columns : sequence of Field
    defaults : mapping of str to float
        Values for fields that are missing or hold no number; those without a default become 0 (whole numbers) or NaN.
    """
    stored = {attribute.name for attribute in dataclasses.fields(kind)}
    found: dict[str, Any] = {}
    for column in columns:
        if column.name not in stored:
            continue
        if column.kind is str:
            found[column.name] = _ids(feature, column.name)
        elif column.kind is int:
            found[column.name] = _whole(feature, column.name, int(defaults.get(column.name, 0)))
        else:
            found[column.name] = _number(feature, column.name, defaults.get(column.name, math.nan))
    return found


def _number(feature: QgsFeature, name: str, default: float) -> float:
    """Return the number in a field, or `default` if the field is missing or holds no finite number."""
    try:
        value = float(value_of(feature, name))
    except (TypeError, ValueError):
        return default
    return value if math.isfinite(value) else default


def _whole(feature: QgsFeature, name: str, default: int) -> int:
    """Return the number in a field without its fraction, or `default` if it does not fit a field of whole numbers."""
    value = _number(feature, name, default)
    return int(value) if abs(value) <= MAX_WHOLE else default


def _ids(feature: QgsFeature, name: str) -> tuple[int, ...]:
    """Return the ids in a field such as "3,5"; none if the field is missing or holds something else."""
    words = str(value_of(feature, name) or "").split(",")
    if not all(ID.fullmatch(word) for word in words):
        return ()
    ids = tuple(int(word) for word in words)
    return ids if max(ids) <= MAX_WHOLE else ()


def gaps_of(feature: QgsFeature, xyz: np.ndarray) -> np.ndarray:
    """Return the sections in the field `gaps`, (k, 2) metres; none if the field does not hold those of this line."""
    words = str(value_of(feature, "gaps") or "").split(",")
    try:
        gaps = np.array([[float(bound) for bound in word.split("-")] for word in words], dtype=float)
    except ValueError:
        return NO_GAPS.copy()
    rise = np.diff(gaps.ravel()) if gaps.ndim == 2 and gaps.shape[1] == 2 else np.array([-1.0])
    in_order = bool((rise >= 0).all()) and gaps[-1, 1] <= Polyline(xyz).length_m + SAME_SUM_M
    return gaps if in_order else NO_GAPS.copy()


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
