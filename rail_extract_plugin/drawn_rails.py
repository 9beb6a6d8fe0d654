"""Rails read from a vector layer: those of Vectorize Rails, or lines drawn by hand."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from qgis.core import (
    NULL,
    QgsAbstractGeometry,
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsFeatureRequest,
    QgsGeometry,
    QgsProcessingFeatureSource,
)

from ..core.crs import is_geographic, parse_crs, units
from ..core.errors import CrsError, RailExtractError
from ..core.points import ORIGIN_STEP, LocalFrame
from ..core.progress import SILENT, Progress
from ..core.rails import RailLine

CHORD_M = 0.0005
"""How far the straight pieces that stand for a curved line may lie beside it: well below what a survey sees."""


def read_rails(
    source: QgsProcessingFeatureSource, progress: Progress = SILENT
) -> tuple[tuple[RailLine, ...], LocalFrame]:
    """Read every part of every line, and find the local frame for them.

    Lines without a `rail_id` are numbered by their feature; those without a `class_code` have class 0; other fields
    of rails are used where they are there.

    Raises
    ------
    CrsError
        The lines are in degrees.
    RailExtractError
        There is no line.
    """
    crs_wkt, horizontal_unit_m, vertical_unit_m = _system(source.sourceCrs(), progress)
    request = QgsFeatureRequest()
    flags = QgsProcessingFeatureSource.Flag.FlagSkipGeometryValidityChecks
    found = [
        (feature, vertices)
        for feature in progress.follow(source.getFeatures(request, flags), source.featureCount())
        for vertices in _parts(feature.geometry(), CHORD_M / horizontal_unit_m)
    ]
    if not found:
        raise RailExtractError("INPUT holds no line: give a layer of rails.")
    middle = np.median(np.concatenate([vertices for _, vertices in found]), axis=0)
    origin = np.round(np.nan_to_num(middle) / ORIGIN_STEP) * ORIGIN_STEP
    frame = LocalFrame(origin, horizontal_unit_m, vertical_unit_m, crs_wkt)
    rails = tuple(_rail(feature, frame.to_local(vertices)) for feature, vertices in found)
    flat = sum(bool(np.isnan(rail.xyz[0, 2])) for rail in rails)
    if flat:
        progress.warning(f"{flat} of {len(rails)} lines have no heights: their centerlines have none either.")
    return rails, frame


def _system(crs: QgsCoordinateReferenceSystem, progress: Progress) -> tuple[str | None, float, float]:
    """Coordinate system as WKT, and metres in its horizontal and vertical unit."""
    if not crs.isValid():
        progress.warning("The lines have no coordinate system: their coordinates are taken as metres.")
        return None, 1.0, 1.0
    wkt = crs.toWkt(QgsCoordinateReferenceSystem.WktVariant.WKT_PREFERRED)
    system = parse_crs(wkt)
    if is_geographic(system):
        raise CrsError(
            f"The lines are in degrees ({system.name}), where lengths can't be measured: reproject them, for example "
            "to the UTM zone of the place."
        )
    return (wkt, *units(system))


def _parts(geometry: QgsGeometry, chord: float) -> Iterator[np.ndarray]:
    """Vertices, (n, 3), of the parts of a line that have a length; heights are NaN unless all vertices have one."""
    if geometry.isNull():
        return
    straight = QgsGeometry(geometry)
    straight.convertToStraightSegment(chord, QgsAbstractGeometry.SegmentationToleranceType.MaximumDifference)
    for part in straight.constParts():
        xyz = np.array([(vertex.x(), vertex.y(), vertex.z()) for vertex in part.vertices()], dtype=float)
        if np.isnan(xyz[:, 2]).any():
            xyz[:, 2] = np.nan
        moves = np.append(True, np.any(np.diff(xyz[:, :2], axis=0) != 0, axis=1))
        if moves.sum() > 1:
            yield xyz[moves]


def _rail(feature: QgsFeature, xyz: np.ndarray) -> RailLine:
    return RailLine(
        xyz,
        rail_id=int(_number(feature, "rail_id", feature.id())),
        class_code=int(_number(feature, "class_code", 0)),
        points=int(_number(feature, "points", 0)),
        resid_mm=_number(feature, "resid_mm", np.nan),
        sigma_mm=_number(feature, "sigma_mm", np.nan),
        bridged_m=_number(feature, "bridged_m", 0.0),
    )


def _number(feature: QgsFeature, name: str, default: float) -> float:
    """Value of a field; `default` where there is no such field, or no number in it."""
    index = feature.fields().lookupField(name)
    value = feature.attribute(index) if index >= 0 else NULL
    try:
        return default if value == NULL else float(value)
    except (TypeError, ValueError):
        return default
