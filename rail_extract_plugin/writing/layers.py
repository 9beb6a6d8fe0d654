"""From the core's lines to QGIS features, in the fields of the interface, and to the outputs that take them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsFeatureSink,
    QgsFields,
    QgsGeometry,
    QgsLineString,
    QgsPoint,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsWkbTypes,
)

from ...core.errors import RailExtractError
from ...core.fields import (
    BRIDGED,
    CENTERLINE_FIELDS,
    LENGTH,
    QUALITY_FIELDS,
    RAIL_FIELDS,
    SIGMA,
    UNKNOWN_IN_METRES,
    Field,
)
from ...core.progress import SILENT, Progress
from ..compat import INTEGER, REAL, TEXT, field
from ..systems import system
from .destinations import is_wanted
from .styling import style_on_load
from .whole_files import write_whole

if TYPE_CHECKING:
    from ...core.frame import LocalFrame
    from ...core.rails import Centerline, RailLine, TrackGeometry
    from ...core.raster import RailRaster
    from ...core.raster_file import RasterHeader

KINDS = {int: INTEGER, float: REAL, str: TEXT}


@dataclass(frozen=True)
class LayerKind:
    """Fields of a layer, and the style it gets when QGIS loads it."""

    columns: tuple[Field, ...]
    style: str


RAILS, CENTERLINES = LayerKind(RAIL_FIELDS, "rails"), LayerKind(CENTERLINE_FIELDS, "centerlines")
QUALITY = LayerKind(QUALITY_FIELDS, "quality")


def fields(columns: Sequence[Field]) -> QgsFields:
    """Make the fields of a layer."""
    made = QgsFields()
    for column in columns:
        made.append(field(column.name, KINDS[column.kind], column.decimals))
    return made


def features(
    lines: Sequence[RailLine | Centerline], columns: Sequence[Field], frame: LocalFrame
) -> Iterator[QgsFeature]:
    """Turn lines into features in the cloud's coordinates, with heights unless no line has any."""
    flat = is_flat(lines)
    for line in lines:
        coordinates = frame.to_crs(line.xyz).T[: 2 if flat else 3].tolist()
        values = [getattr(line, column.name) for column in columns]
        yield _feature(QgsGeometry(QgsLineString(*coordinates)), values, columns)


def stations(tracks: Sequence[TrackGeometry], frame: LocalFrame) -> Iterator[QgsFeature]:
    """Turn the stations of measured tracks into point features in the cloud's coordinates."""
    for track in tracks:
        places = frame.to_crs(track.xyz).tolist()
        profiles = (getattr(track, column.name) for column in QUALITY.columns[1:])
        for (x, y, z), *row in zip(places, repeat(track.track_id), *profiles):
            yield _feature(QgsGeometry(QgsPoint(x, y) if math.isnan(z) else QgsPoint(x, y, z)), row, QUALITY.columns)


def is_flat(lines: Sequence[RailLine | Centerline | TrackGeometry]) -> bool:
    """Tell whether there are lines, but none with heights."""
    return bool(lines) and all(any(map(math.isnan, line.xyz[:, 2])) for line in lines)


def add_features(sink: QgsFeatureSink, made: Iterator[QgsFeature]) -> int:
    """Write features into a sink, and count them.

    Raises
    ------
    RailExtractError
        The output does not take one, as on a full disk.
    """
    count = 0
    for feature in made:
        if not sink.addFeature(feature, QgsFeatureSink.Flag.FastInsert):
            raise RailExtractError(f"The output can't be written ({sink.lastError()}): check the disk's free space.")
        count += 1
    return count


def write_lines(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    kind: LayerKind,
    lines: Sequence[RailLine | Centerline],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write lines into the output called `name`.

    Returns
    -------
    dict of str to str
        The layer's id by the output's name; empty where the user skipped the output.

    Raises
    ------
    RailExtractError
        The output can't be written.
    """
    shape = QgsWkbTypes.Type.LineString if is_flat(lines) else QgsWkbTypes.Type.LineStringZ
    return _write(algorithm, name, kind, shape, features(lines, kind.columns, frame), frame, parameters, context)


def write_stations(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    tracks: Sequence[TrackGeometry],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the stations of measured tracks as points, like `write_lines`."""
    shape = QgsWkbTypes.Type.Point if is_flat(tracks) else QgsWkbTypes.Type.PointZ
    made = stations(tracks, frame)
    return _write(algorithm, name, QUALITY, shape, made, frame, parameters, context)


def write_raster(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    header: RasterHeader,
    rasters: Sequence[RailRaster],
    parameters: dict[str, Any],
    context: QgsProcessingContext,
    progress: Progress = SILENT,
) -> dict[str, str]:
    """Write rasters of rails, one per class, into the output called `name`.

    Returns
    -------
    dict of str to str
        The file's path by the output's name; empty where the user skipped the output.
    """
    from ..reading.geotiff import write_rasters

    if not is_wanted(parameters.get(name), context):
        return {}
    path = algorithm.parameterAsOutputLayer(parameters, name, context)
    write_rasters(Path(path), header, rasters, progress)
    style_on_load(path, "raster", context)
    return {name: path}


def figures_of(lines: Sequence[RailLine | Centerline], what: str) -> dict[str, Any]:
    """Count lines and measure them, as the outputs RAIL_COUNT and RAIL_LENGTH for RAIL."""
    return {f"{what}_COUNT": len(lines), f"{what}_LENGTH": LENGTH.value(sum(line.length_m for line in lines))}


def figures_of_stations(tracks: Sequence[TrackGeometry]) -> dict[str, Any]:
    """Count stations, and tell how well the points support the tracks."""
    sigma = [value for track in tracks for value in track.sigma_mm if math.isfinite(value)]
    return {
        "STATION_COUNT": sum(len(track.chainage_m) for track in tracks),
        "SIGMA": SIGMA.value(math.sqrt(sum(value**2 for value in sigma) / len(sigma))) if sigma else None,
        "BRIDGED_LENGTH": BRIDGED.value(sum(track.bridged_m for track in tracks)),
    }


def output_crs(wkt: str | None) -> QgsCoordinateReferenceSystem:
    """Coordinate system for an output, `UNKNOWN_IN_METRES` where the cloud has none."""
    return system(wkt or UNKNOWN_IN_METRES)


def _write(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    kind: LayerKind,
    shape: QgsWkbTypes.Type,
    made: Iterator[QgsFeature],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write features into the output called `name`, if the user wants it."""
    if not is_wanted(parameters.get(name), context):
        return {}
    columns, crs = fields(kind.columns), output_crs(frame.crs_wkt)

    def write(value: Any) -> tuple[str, int]:
        sink, layer_id = algorithm.parameterAsSink({**parameters, name: value}, name, context, columns, shape, crs)
        return (layer_id, add_features(sink, made)) if sink else ("", 0)

    layer_id = write_whole(parameters.get(name), context, write)
    if not layer_id:
        return {}
    style_on_load(layer_id, kind.style, context)
    return {name: layer_id}


def _feature(geometry: QgsGeometry, values: Sequence[Any], columns: Sequence[Field]) -> QgsFeature:
    feature = QgsFeature()
    feature.setGeometry(geometry)
    feature.setAttributes([column.value(value) for column, value in zip(columns, values)])
    return feature
