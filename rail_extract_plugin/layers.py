"""From the core's lines to QGIS features, in the fields of the interface, and to the outputs that take them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsDataSourceUri,
    QgsFeature,
    QgsFeatureSink,
    QgsFields,
    QgsGeometry,
    QgsLineString,
    QgsProcessing,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingOutputLayerDefinition,
    QgsProperty,
    QgsWkbTypes,
)

from ..core.errors import RailExtractError
from .compat import INTEGER, REAL, TEXT, field
from .styling import style_on_load

if TYPE_CHECKING:
    from ..core.points import LocalFrame
    from ..core.rails import Centerline, RailLine

UNKNOWN_IN_METRES = 'LOCAL_CS["Undefined Cartesian SRS",UNIT["metre",1]]'
"""Stated in outputs without a coordinate system, because GDAL else calls a GeoPackage's coordinates degrees."""

RAIL_FIELDS = (
    ("rail_id", INTEGER),
    ("class_code", INTEGER),
    ("length_m", REAL),
    ("points", INTEGER),
    ("resid_mm", REAL),
    ("sigma_mm", REAL),
    ("bridged_m", REAL),
)
CENTERLINE_FIELDS = (
    ("track_id", INTEGER),
    ("class_code", INTEGER),
    ("left_ids", TEXT),
    ("right_ids", TEXT),
    ("length_m", REAL),
    ("gauge_mm", REAL),
    ("gaugesd_mm", REAL),
    ("cant_mm", REAL),
    ("cantmax_mm", REAL),
    ("bridged_m", REAL),
)
"""Names and types, each name that of the attribute of `RailLine` or `Centerline` it holds."""


@dataclass(frozen=True)
class LineKind:
    """Fields of a layer of lines, and the style it gets when QGIS loads it."""

    columns: tuple[tuple[str, Any], ...]
    style: str


RAILS, CENTERLINES = LineKind(RAIL_FIELDS, "rails"), LineKind(CENTERLINE_FIELDS, "centerlines")


def fields(columns: Sequence[tuple[str, Any]]) -> QgsFields:
    """Make the fields of a layer from `RAIL_FIELDS` or `CENTERLINE_FIELDS`."""
    made = QgsFields()
    for name, kind in columns:
        made.append(field(name, kind))
    return made


def features(
    lines: Sequence[RailLine | Centerline], columns: Sequence[tuple[str, Any]], frame: LocalFrame
) -> Iterator[QgsFeature]:
    """Turn lines into features in the cloud's coordinates, with heights unless no line has any."""
    flat = is_flat(lines)
    for line in lines:
        coordinates = frame.to_crs(line.xyz).T[: 2 if flat else 3].tolist()
        feature = QgsFeature()
        feature.setGeometry(QgsGeometry(QgsLineString(*coordinates)))
        feature.setAttributes([_attribute(getattr(line, name), kind) for name, kind in columns])
        yield feature


def is_flat(lines: Sequence[RailLine | Centerline]) -> bool:
    """Tell whether there are lines, but none with heights."""
    return bool(lines) and all(any(map(math.isnan, line.xyz[:, 2])) for line in lines)


def add_features(sink: QgsFeatureSink, made: Iterator[QgsFeature]) -> None:
    """Write features into a sink.

    Raises
    ------
    RailExtractError
        The output does not take one, as on a full disk.
    """
    for feature in made:
        if not sink.addFeature(feature, QgsFeatureSink.Flag.FastInsert):
            raise RailExtractError(f"The output can't be written ({sink.lastError()}): check the disk's free space.")


def write_lines(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    kind: LineKind,
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
    sink, layer_id = algorithm.parameterAsSink(
        parameters, name, context, fields(kind.columns), shape, output_crs(frame.crs_wkt)
    )
    if sink is None:
        return {}
    add_features(sink, features(lines, kind.columns, frame))
    style_on_load(layer_id, kind.style, context)
    return {name: layer_id}


def figures_of(lines: Sequence[RailLine | Centerline], what: str) -> dict[str, float]:
    """Count lines and measure them, as the outputs RAIL_COUNT and RAIL_LENGTH for RAIL."""
    return {f"{what}_COUNT": len(lines), f"{what}_LENGTH": float(sum(line.length_m for line in lines))}


def output_crs(wkt: str | None) -> QgsCoordinateReferenceSystem:
    """Coordinate system for an output, `UNKNOWN_IN_METRES` where the cloud has none."""
    return QgsCoordinateReferenceSystem.fromWkt(wkt or UNKNOWN_IN_METRES)


def check_writable(value: Any, context: QgsProcessingContext) -> None:
    """Refuse an output that could not be written, before the work begins.

    Parameters
    ----------
    value : str, QgsProperty, QgsProcessingOutputLayerDefinition or None
        Value of a destination parameter.
    context : QgsProcessingContext

    Raises
    ------
    RailExtractError
        The file or its folder does not let itself be written.
    """
    path = _output_file(value, context)
    if path is None:
        return
    if path.is_dir():
        raise RailExtractError(f"The output {path} is a folder: give the name of a file in it.")
    try:
        if path.exists():
            path.open("r+b").close()
        else:
            TemporaryFile(dir=path.absolute().parent).close()
    except OSError as error:
        raise RailExtractError(
            f"The output {path} can't be written ({error.strerror}): choose another place."
        ) from error


def _attribute(value: Any, kind: Any) -> Any:
    if kind == TEXT:
        return ",".join(str(item) for item in value)
    if kind == INTEGER:
        return int(value)
    return float(value) if math.isfinite(value) else None


def _output_file(value: Any, context: QgsProcessingContext) -> Path | None:
    """File behind a destination; None for memory layers and databases."""
    if isinstance(value, QgsProcessingOutputLayerDefinition):
        value = value.sink
    if isinstance(value, QgsProperty):
        value = value.valueAsString(context.expressionContext())[0]
    text = value or ""
    if text.startswith("ogr:"):
        text = QgsDataSourceUri(text[len("ogr:") :]).database()
    is_file = text and text != QgsProcessing.TEMPORARY_OUTPUT and not re.match(r"\w{2,}:", text)
    return Path(text) if is_file else None
