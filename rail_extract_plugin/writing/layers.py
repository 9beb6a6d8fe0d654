"""Converts the core's lines and rasters to QGIS features and files, and writes them to the outputs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

from qgis.core import (
    NULL,
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsFeatureSink,
    QgsFields,
    QgsGeometry,
    QgsLineString,
    QgsPoint,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingOutputLayerDefinition,
    QgsVertexIterator,
    QgsWkbTypes,
)

from ...core.disk import Destination
from ...core.errors import RailExtractError
from ...core.fields import (
    AIRBORNE_FIELDS,
    AIRBORNE_STATION_FIELDS,
    AXIS_FIELDS,
    BRIDGED,
    CENTERLINE_FIELDS,
    DEVIATION_FIELDS,
    DIFFERENCE_FIELDS,
    ELEMENT_FIELDS,
    EXTENT_FIELDS,
    FINDING_FIELDS,
    KM_FIELDS,
    LENGTH,
    PROPOSED_FIELDS,
    QUALITY_FIELDS,
    RAIL_FIELDS,
    SIGMA,
    STATION_FIELDS,
    STOP_FIELDS,
    UNKNOWN_IN_METRES,
    Field,
)
from ...core.progress import SILENT, Progress
from ..compat import INTEGER, REAL, TEXT, field
from ..systems import lost_part, system
from .destinations import EXCHANGED, is_wanted
from .styling import style_on_load
from .whole_files import write_whole

if TYPE_CHECKING:
    import numpy as np

    from ...core.airborne.proposals import ProposedGuide
    from ...core.airborne.survey import AirborneLine, AirborneTrack
    from ...core.alignment.deviations import Deviations
    from ...core.alignment.elements import Alignment
    from ...core.alignment.fit import Fit
    from ...core.comparison.tracks import LineDifferences, TrackComparison
    from ...core.frame import LocalFrame
    from ...core.grow.growth import Stop
    from ...core.rails import Centerline, RailLine, TrackGeometry
    from ...core.raster import RailRaster
    from ...core.raster_file import RasterHeader
    from ...core.report import Finding

    Line = Union[RailLine, Centerline, Finding, AirborneLine, ProposedGuide]

KINDS = {int: INTEGER, float: REAL, str: TEXT}


@dataclass(frozen=True)
class LayerKind:
    """The fields of a layer, and the style it gets when QGIS loads it."""

    columns: tuple[Field, ...]
    style: str


RAILS, CENTERLINES = LayerKind(RAIL_FIELDS, "rails"), LayerKind(CENTERLINE_FIELDS, "centerlines")
QUALITY, FINDINGS = LayerKind(QUALITY_FIELDS, "quality"), LayerKind(FINDING_FIELDS, "findings")
LOCATED_QUALITY = LayerKind((*QUALITY_FIELDS, *STATION_FIELDS), "quality")
LOCATED_FINDINGS = LayerKind((*FINDING_FIELDS, *KM_FIELDS), "findings")
"""With an axis."""

STOPS = LayerKind(STOP_FIELDS, "stops")
PROPOSED = LayerKind(PROPOSED_FIELDS, "proposed")
AIRBORNE, STATIONS = LayerKind(AIRBORNE_FIELDS, "airborne"), LayerKind(AIRBORNE_STATION_FIELDS, "stations")
DIFFERENCES = LayerKind(DIFFERENCE_FIELDS, "differences")
ELEMENTS, AXES = LayerKind(ELEMENT_FIELDS, "elements"), LayerKind(AXIS_FIELDS, "axes")
DEVIATIONS = LayerKind(DEVIATION_FIELDS, "deviations")
PLACES = LayerKind((*STATION_FIELDS, *EXTENT_FIELDS), "places")
"""The fields that copies of layers of any kind get in addition; their style only names these."""

LAYERS = (
    *(RAILS, CENTERLINES, QUALITY, LOCATED_QUALITY, FINDINGS, LOCATED_FINDINGS, STOPS, PROPOSED, AIRBORNE, STATIONS),
    *(DIFFERENCES, ELEMENTS, AXES, DEVIATIONS, PLACES),
)
"""Every kind of layer that a run can write."""


def fields(columns: Sequence[Field]) -> QgsFields:
    """Define the fields of a layer."""
    made = QgsFields()
    for column in columns:
        made.append(field(column.name, KINDS[column.kind], column.decimals))
    return made


def features(lines: Sequence[Line], columns: Sequence[Field], frame: LocalFrame) -> Iterator[QgsFeature]:
    """Convert lines to features in the cloud's coordinates, in 3D unless no line has heights.

    Parameters
    ----------
    lines : sequence of RailLine, Centerline or Finding
    columns : sequence of Field
    frame : LocalFrame
    """
    flat = is_flat(lines)
    for line in lines:
        values = [getattr(line, column.name) for column in columns]
        yield _feature(QgsGeometry(QgsLineString(*_columns(line.xyz, frame, flat))), values, columns)


def stations(tracks: Sequence[TrackGeometry], frame: LocalFrame) -> Iterator[QgsFeature]:
    """Convert the stations of measured tracks to point features in the cloud's coordinates."""
    for track in tracks:
        places = frame.to_crs(track.xyz).tolist()
        profiles = [getattr(track, column.name) for column in QUALITY.columns[1:]]
        if track.kilometres is not None:
            profiles += [getattr(track.kilometres, column.name) for column in STATION_FIELDS]
        columns = quality_of(tracks).columns
        for (x, y, z), *row in zip(places, repeat(track.track_id), *profiles):
            yield _feature(QgsGeometry(QgsPoint(x, y) if math.isnan(z) else QgsPoint(x, y, z)), row, columns)


def quality_of(tracks: Sequence[TrackGeometry]) -> LayerKind:
    """Return the fields of the stations of tracks: with an axis, also their places along it."""
    return LOCATED_QUALITY if any(track.kilometres is not None for track in tracks) else QUALITY


def findings_of(found: Sequence[Finding]) -> LayerKind:
    """Return the fields of findings: with an axis, also their kilometres."""
    return LOCATED_FINDINGS if any(finding.km_text is not None for finding in found) else FINDINGS


def copies(originals: Sequence[QgsFeature], columns: QgsFields, rows: Sequence[Sequence[Any]]) -> Iterator[QgsFeature]:
    """Copy features with further values, (n, k), for the last fields of `columns`."""
    for original, row in zip(originals, rows):
        feature = QgsFeature(columns)
        feature.setGeometry(original.geometry())
        feature.setAttributes([*original.attributes(), *row[: columns.count() - len(original.attributes())]])
        yield feature


def is_flat(lines: Sequence[Line | TrackGeometry | LineDifferences] | Sequence[AirborneTrack]) -> bool:
    """Return whether there are lines, and none has heights."""
    return bool(lines) and all(any(map(math.isnan, line.xyz[:, 2])) for line in lines)


def add_features(sink: QgsFeatureSink, made: Iterator[QgsFeature]) -> int:
    """Write features to a sink and return their number.

    Raises
    ------
    RailExtractError
        A feature cannot be written, for example because the disk is full.
    """
    count = 0
    for feature in made:
        if not sink.addFeature(feature, QgsFeatureSink.Flag.FastInsert):
            raise RailExtractError(f"The output can't be written ({sink.lastError()}): check the free disk space.")
        count += 1
    return count


def write_lines(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    kind: LayerKind,
    lines: Sequence[Line],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write lines to an output.

    Parameters
    ----------
    algorithm : QgsProcessingAlgorithm
    name : str
        Name of the output.
    kind : LayerKind
    lines : sequence of RailLine, Centerline or Finding
    frame : LocalFrame
    parameters : dict
    context : QgsProcessingContext

    Returns
    -------
    dict of str to str
        The layer's id by the name of the output; empty if the user skipped it.

    Raises
    ------
    RailExtractError
        The output cannot be written.
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
    """Write the stations of measured tracks as points.

    Parameters
    ----------
    tracks : sequence of TrackGeometry
    algorithm, name, frame, parameters, context
        See `write_lines`.
    """
    shape = QgsWkbTypes.Type.Point if is_flat(tracks) else QgsWkbTypes.Type.PointZ
    made = stations(tracks, frame)
    return _write(algorithm, name, quality_of(tracks), shape, made, frame, parameters, context)


def write_airborne_stations(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    tracks: Sequence[AirborneTrack],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the stations along guides as points.

    Parameters
    ----------
    tracks : sequence of AirborneTrack
    algorithm, name, frame, parameters, context
        See `write_lines`.
    """
    shape = QgsWkbTypes.Type.Point if is_flat(tracks) else QgsWkbTypes.Type.PointZ
    return _write(algorithm, name, STATIONS, shape, _airborne_stations(tracks, frame), frame, parameters, context)


def _airborne_stations(tracks: Sequence[AirborneTrack], frame: LocalFrame) -> Iterator[QgsFeature]:
    for track in tracks:
        profiles = (getattr(track, column.name) for column in STATIONS.columns[2:])
        ids = [number or None for number in track.track_id.tolist()]
        for (x, y, z), *row in zip(frame.to_crs(track.xyz).tolist(), ids, repeat(track.guide_id), *profiles):
            place = QgsPoint(x, y) if math.isnan(z) else QgsPoint(x, y, z)
            yield _feature(QgsGeometry(place), row, STATIONS.columns)


def write_stops(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    stops: Sequence[Stop],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the places where rails were not followed further as points.

    Parameters
    ----------
    stops : sequence of Stop
    algorithm, name, frame, parameters, context
        See `write_lines`.
    """
    made = (
        _feature(QgsGeometry(QgsPoint(*frame.to_crs(stop.xyz).tolist())), (number, stop.reason.value), STOPS.columns)
        for number, stop in enumerate(stops, 1)
    )
    return _write(algorithm, name, STOPS, QgsWkbTypes.Type.PointZ, made, frame, parameters, context)


def write_elements(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    alignments: Sequence[Alignment],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the element table of alignments, each element with its curve.

    Parameters
    ----------
    alignments : sequence of Alignment
        In the given frame.
    algorithm, name, frame, parameters, context
        See `write_lines`.
    """
    from ...core.alignment.table import rows

    flat = not any(alignment.vertical for alignment in alignments)
    made = (
        _feature(
            QgsGeometry(QgsLineString(*_columns(alignment.drawn(one.s_from, one.s_to), frame, flat))),
            [row[column.name] for column in ELEMENTS.columns],
            ELEMENTS.columns,
        )
        for alignment in alignments
        for one, row in zip(alignment.elements, rows(alignment))
    )
    shape = QgsWkbTypes.Type.LineString if flat else QgsWkbTypes.Type.LineStringZ
    return _write(algorithm, name, ELEMENTS, shape, made, frame, parameters, context)


def write_axes(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    alignments: Sequence[Alignment],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write alignments as lines with kilometres as M values; see `write_elements`."""
    from ...core.alignment.equations import measured

    flat = not any(alignment.vertical for alignment in alignments)
    shape = QgsWkbTypes.Type.LineStringM if flat else QgsWkbTypes.Type.LineStringZM

    def axis(alignment: Alignment) -> QgsFeature:
        xyzm = measured(alignment)
        columns = _columns(xyzm[:, :3], frame, flat)
        line = QgsLineString(*columns, *([[]] if flat else []), xyzm[:, 3].tolist())
        length_m, kilometres = alignment.s_to - alignment.s_from, (xyzm[0, 3], xyzm[-1, 3])
        return _feature(QgsGeometry(line), (alignment.track_id, alignment.name, length_m, *kilometres), AXES.columns)

    return _write(algorithm, name, AXES, shape, map(axis, alignments), frame, parameters, context)


def write_deviations(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    found: Sequence[Deviations],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the deviations of tracks from their designs as points on the designs; see `write_elements`."""
    flat = all(math.isnan(one.xyz[0, 2]) for one in found)
    made = (
        _feature(QgsGeometry(QgsPoint(*place[: 2 if flat else 3])), (one.track_id, *row), DEVIATIONS.columns)
        for one in found
        for place, *row in zip(
            frame.to_crs(one.xyz).tolist(), *(getattr(one, column.name) for column in DEVIATIONS.columns[1:])
        )
    )
    shape = QgsWkbTypes.Type.Point if flat else QgsWkbTypes.Type.PointZ
    return _write(algorithm, name, DEVIATIONS, shape, made, frame, parameters, context)


def _columns(xyz: np.ndarray, frame: LocalFrame, flat: bool) -> list[list[float]]:
    """Return x, y and, unless it is left out, z of vertices, (n, 3) local metres, in coordinates of the layer."""
    return frame.to_crs(xyz).T[: 2 if flat else 3].tolist()


def write_differences(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    found: TrackComparison,
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write the stations of a comparison as points.

    Parameters
    ----------
    found : TrackComparison
    algorithm, name, frame, parameters, context
        See `write_lines`.
    """
    flat = is_flat(found.lines)
    made = (
        _difference(line, at, frame, flat) for line in found.lines for at in range(len(line.state)) if line.state[at]
    )
    shape = QgsWkbTypes.Type.Point if flat else QgsWkbTypes.Type.PointZ
    return _write(algorithm, name, DIFFERENCES, shape, made, frame, parameters, context)


def _difference(line: LineDifferences, at: int, frame: LocalFrame, flat: bool) -> QgsFeature:
    """Convert one station of a comparison to a feature."""
    place = QgsPoint(*frame.to_crs(line.xyz[at])[: 2 if flat else 3].tolist())
    values = [getattr(line, column.name) for column in DIFFERENCES.columns[1:]]
    return _feature(QgsGeometry(place), [line.line_id, *(value[at] for value in values)], DIFFERENCES.columns)


def write_raster(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    header: RasterHeader,
    rasters: Sequence[RailRaster],
    parameters: dict[str, Any],
    context: QgsProcessingContext,
    progress: Progress = SILENT,
) -> dict[str, str]:
    """Write rail rasters, one per class, to an output.

    Parameters
    ----------
    header : RasterHeader
    rasters : sequence of RailRaster
    algorithm, name, parameters, context
        See `write_lines`.
    progress : Progress

    Returns
    -------
    dict of str to str
        The path of the file by the name of the output; empty if the user skipped it.
    """
    from ..reading.geotiff import write_rasters

    if not is_wanted(parameters.get(name), context):
        return {}
    path = algorithm.parameterAsOutputLayer(parameters, name, context)
    destination = algorithm.destinations.get(name) or Destination.at(Path(path))
    with destination.replacing() as new:
        write_rasters(new, header, rasters, progress)
    _style(algorithm, name, path, "raster", context)
    return {name: path}


def figures_of(lines: Sequence[RailLine | Centerline] | Sequence[AirborneLine], what: str) -> dict[str, Any]:
    """Return the number and length of lines as outputs: RAIL_COUNT and RAIL_LENGTH if `what` is RAIL."""
    return {f"{what}_COUNT": len(lines), f"{what}_LENGTH": LENGTH.value(sum(line.length_m for line in lines))}


def figures_of_stations(tracks: Sequence[TrackGeometry]) -> dict[str, Any]:
    """Return the number of stations, the standard error and the length without points, as outputs."""
    sigma = [value for track in tracks for value in track.sigma_mm if math.isfinite(value)]
    return {
        "STATION_COUNT": sum(len(track.chainage_m) for track in tracks),
        "SIGMA": SIGMA.value(math.sqrt(sum(value**2 for value in sigma) / len(sigma))) if sigma else None,
        "BRIDGED_LENGTH": BRIDGED.value(sum(track.bridged_m for track in tracks)),
    }


def figures_of_fits(fits: Sequence[Fit]) -> dict[str, Any]:
    """Return the number of elements, and the root mean square of the slews in millimetres, as outputs."""
    squares = sum(float((fit.deviations.slew_mm**2).sum()) for fit in fits)
    count = sum(len(fit.deviations.s) for fit in fits)
    elements = sum(len(fit.alignment.elements) for fit in fits)
    return {"ELEMENT_COUNT": elements, "RMS": round(math.sqrt(squares / count), 3)}


def output_crs(wkt: str | None) -> QgsCoordinateReferenceSystem:
    """Return the coordinate system for an output: `UNKNOWN_IN_METRES` if the cloud has none."""
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
    """Write features to the output `name` unless the user skipped it."""
    if not is_wanted(parameters.get(name), context):
        return {}
    destination = algorithm.destinations.get(name)
    if destination is not None and destination.file.suffix.lower() in EXCHANGED:
        return _exchange(algorithm, name, kind, shape, made, frame, parameters, context)
    value = parameters.get(name)
    # QGIS complains of the system that stands for an unknown one as soon as a layer is in the project.
    is_shown = destination is None and bool(getattr(value, "destinationProject", None))
    columns, crs = fields(kind.columns), system(frame.crs_wkt) if is_shown else output_crs(frame.crs_wkt)
    layer_id = _layer(algorithm, name, columns, shape, made, crs, lost_part(frame.crs_wkt), parameters, context)
    if not layer_id:
        return {}
    _style(algorithm, name, layer_id, kind.style, context, has_system=frame.crs_wkt is not None)
    return {name: layer_id}


def write_copy(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    columns: QgsFields,
    shape: QgsWkbTypes.Type,
    made: Iterator[QgsFeature],
    crs: QgsCoordinateReferenceSystem,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write a copy of a layer of any kind, with other fields.

    Parameters
    ----------
    columns : QgsFields
    shape : QgsWkbTypes.Type
    made : iterator of QgsFeature
    crs : QgsCoordinateReferenceSystem
    algorithm, name, parameters, context
        See `write_lines`.
    """
    destination, wkt = algorithm.destinations.get(name), crs.toWkt() if crs.isValid() else None
    if destination is not None and destination.file.suffix.lower() in EXCHANGED:
        import numpy as np

        from ...core.clouds.crs import parse_crs, units
        from ...core.frame import LocalFrame

        if QgsWkbTypes.geometryType(shape) == QgsWkbTypes.GeometryType.PolygonGeometry:
            raise RailExtractError(f"{name} can't be {destination.path.name} for polygons: choose a GeoPackage.")
        written = tuple(Field(one.name(), float if one.isNumeric() else str, "") for one in columns)
        unit_m = units(parse_crs(wkt))[0] if wkt and not crs.isGeographic() else 1.0
        frame = LocalFrame(np.zeros(3), unit_m, crs_wkt=wkt)
        kind = LayerKind(written, PLACES.style)
        return _exchange(algorithm, name, kind, shape, made, frame, parameters, context)
    layer_id = _layer(algorithm, name, columns, shape, made, crs, lost_part(wkt), parameters, context)
    if not layer_id:
        return {}
    _style(algorithm, name, layer_id, PLACES.style, context)
    return {name: layer_id}


def _layer(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    columns: QgsFields,
    shape: QgsWkbTypes.Type,
    made: Iterator[QgsFeature],
    crs: QgsCoordinateReferenceSystem,
    lost: str | None,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> str:
    """Write features to a layer, and return its id; empty if the user skipped it."""

    def write(value: Any) -> tuple[str, int]:
        sink, layer_id = algorithm.parameterAsSink({**parameters, name: value}, name, context, columns, shape, crs)
        return (layer_id, add_features(sink, made)) if sink else ("", 0)

    return write_whole(parameters.get(name), context, algorithm.destinations.get(name), write, lost)


def _exchange(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    kind: LayerKind,
    shape: QgsWkbTypes.Type,
    made: Iterator[QgsFeature],
    frame: LocalFrame,
    parameters: dict[str, Any],
    context: QgsProcessingContext,
) -> dict[str, str]:
    """Write features for other programs; QGIS loads the file if the user wants that."""
    from ...core.exchange import DRAWN, Shape, write_shapes

    destination, value = algorithm.destinations[name], parameters.get(name)
    shapes = (
        Shape(_vertices(part.vertices()), _plain(feature.attributes()))
        for feature in made
        for part in feature.geometry().constParts()
    )
    is_line = QgsWkbTypes.geometryType(shape) == QgsWkbTypes.GeometryType.LineGeometry
    with destination.replacing() as new:
        write_shapes(new, shapes, kind.columns, frame, DRAWN[kind.style], is_line)
    path = str(destination.path)
    if isinstance(value, QgsProcessingOutputLayerDefinition) and value.destinationProject:
        title = algorithm.parameterDefinition(name).description()
        details = QgsProcessingContext.LayerDetails(title, value.destinationProject, name)
        context.addLayerToLoadOnCompletion(path, details)
    return {name: path}


def vertices_of(feature: QgsFeature) -> np.ndarray:
    """Return the vertices of a line or a point, (n, 3) in units of its layer; heights are NaN where there are none."""
    return _vertices(feature.geometry().vertices())


def _vertices(vertices: QgsVertexIterator) -> np.ndarray:
    import numpy as np

    return np.array([(vertex.x(), vertex.y(), vertex.z()) for vertex in vertices], dtype=float)


def _plain(values: Sequence[Any]) -> list[Any]:
    """Return attributes with None where they are empty, and dates as text."""
    return [None if value == NULL else value.toString() if hasattr(value, "toString") else value for value in values]


def _style(
    algorithm: QgsProcessingAlgorithm,
    name: str,
    layer_id: str,
    style: str,
    context: QgsProcessingContext,
    has_system: bool = True,
) -> None:
    """Apply a style to an output when QGIS loads it, and name it by the cloud of the run."""
    title = algorithm.parameterDefinition(name).description()
    style_on_load(layer_id, style, context, algorithm.layer_properties, title, has_system)


def _feature(geometry: QgsGeometry, values: Sequence[Any], columns: Sequence[Field]) -> QgsFeature:
    feature = QgsFeature()
    feature.setGeometry(geometry)
    feature.setAttributes([column.value(value) for column, value in zip(columns, values)])
    return feature
