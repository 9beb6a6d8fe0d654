"""Layers of results in GeoPackages, with the fields of the interface, without QGIS."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyogrio
import shapely

from ..airborne.survey import AirborneTrack
from ..alignment.deviations import Deviations
from ..alignment.elements import Alignment
from ..alignment.equations import measured
from ..alignment.table import rows
from ..comparison.tracks import TrackComparison
from ..disk import Destination
from ..exchange import DRAWN, Shape, write_shapes
from ..fields import (
    AIRBORNE_STATION_FIELDS,
    AXIS_FIELDS,
    DEVIATION_FIELDS,
    DIFFERENCE_FIELDS,
    ELEMENT_FIELDS,
    QUALITY_FIELDS,
    STATION_FIELDS,
    STOP_FIELDS,
    UNKNOWN_IN_METRES,
    Field,
)
from ..frame import LocalFrame
from ..geopackage import tables_in
from ..grow.growth import Stop
from ..rails import Centerline, RailLine, TrackGeometry
from ..report import Finding

if TYPE_CHECKING:
    from .features import Features

LINE_M, LINE_ZM = 2002, 3002
"""Codes of lines with M values in well-known binary."""

KINDS = {int: np.int32, float: float, str: object}


@dataclass(frozen=True)
class Layer:
    """A layer to write.

    Attributes
    ----------
    name : str
    destination : Destination
        GeoPackage of the layer.
    fields : sequence of Field
    columns : sequence of sequence
        Values of each field, one per feature.
    geometry_type : str
        "LineString Z" or "Point Z"; without Z, heights are left out, and with M, lines have a fourth column.
    xyz : sequence of (n, 3) or (3,) array
        Vertices of each line, or place of each point, in local metres.
    """

    name: str
    destination: Destination
    fields: Sequence[Field]
    columns: Sequence[Sequence[Any]]
    geometry_type: str
    xyz: Sequence[np.ndarray]


def lines_layer(
    name: str,
    destination: Destination,
    fields: Sequence[Field],
    lines: Sequence[RailLine] | Sequence[Centerline] | Sequence[Finding],
) -> Layer:
    """Make a layer of lines.

    Parameters
    ----------
    name : str
    destination : Destination
    fields : sequence of Field
    lines : sequence of RailLine, Centerline or Finding
    """
    columns = [[getattr(line, field.name) for line in lines] for field in fields]
    return Layer(name, destination, fields, columns, "LineString Z", [line.xyz for line in lines])


def stations_layer(name: str, destination: Destination, tracks: Sequence[TrackGeometry]) -> Layer:
    """Make a layer of the stations of tracks, with the fields of QUALITY.

    Parameters
    ----------
    name : str
    destination : Destination
    tracks : sequence of TrackGeometry
    """
    columns = [
        [value for track in tracks for value in np.broadcast_to(getattr(track, field.name), len(track.xyz))]
        for field in QUALITY_FIELDS
    ]
    fields: tuple[Field, ...] = QUALITY_FIELDS
    if any(track.kilometres is not None for track in tracks):
        fields = (*QUALITY_FIELDS, *STATION_FIELDS)
        columns += [
            [value for track in tracks for value in getattr(track.kilometres, field.name)] for field in STATION_FIELDS
        ]
    return Layer(name, destination, fields, columns, "Point Z", [place for track in tracks for place in track.xyz])


def stops_layer(destination: Destination, stops: Sequence[Stop]) -> Layer:
    """Make a layer of the places where rails were not followed further."""
    columns: list[Sequence[Any]] = [range(1, len(stops) + 1), [stop.reason.value for stop in stops]]
    return Layer("stops", destination, STOP_FIELDS, columns, "Point Z", [stop.xyz for stop in stops])


def airborne_stations_layer(destination: Destination, tracks: Sequence[AirborneTrack]) -> Layer:
    """Make a layer of the stations along guides."""
    columns: list[Sequence[Any]] = [
        [value for track in tracks for value in np.broadcast_to(getattr(track, field.name), len(track.xyz))]
        for field in AIRBORNE_STATION_FIELDS
    ]
    columns[0] = [int(number) or None for number in columns[0]]
    places = [place for track in tracks for place in track.xyz]
    return Layer("stations", destination, AIRBORNE_STATION_FIELDS, columns, "Point Z", places)


def elements_layer(destination: Destination, alignments: Sequence[Alignment]) -> Layer:
    """Make a layer of the element tables of alignments, each element with its curve."""
    table = [row for alignment in alignments for row in rows(alignment)]
    columns = [[row[field.name] for row in table] for field in ELEMENT_FIELDS]
    curves = [alignment.drawn(one.s_from, one.s_to) for alignment in alignments for one in alignment.elements]
    return Layer("elements", destination, ELEMENT_FIELDS, columns, _type("LineString", curves), curves)


def axes_layer(destination: Destination, alignments: Sequence[Alignment]) -> Layer:
    """Make a layer of alignments as lines with kilometres as M values."""
    lines = [measured(alignment) for alignment in alignments]
    columns: list[Sequence[Any]] = [
        [one.track_id for one in alignments],
        [one.name for one in alignments],
        [one.s_to - one.s_from for one in alignments],
        [line[0, 3] for line in lines],
        [line[-1, 3] for line in lines],
    ]
    return Layer("axis", destination, AXIS_FIELDS, columns, _type("LineString", lines) + "M", lines)


def deviations_layer(destination: Destination, found: Sequence[Deviations]) -> Layer:
    """Make a layer of the deviations of tracks, as points on their designs."""
    columns: list[Sequence[Any]] = [[one.track_id for one in found for _ in one.s]]
    columns += [[value for one in found for value in getattr(one, field.name)] for field in DEVIATION_FIELDS[1:]]
    places = [place for one in found for place in one.xyz]
    return Layer("deviations", destination, DEVIATION_FIELDS, columns, _type("Point", places), places)


def differences_layer(destination: Destination, found: TrackComparison) -> Layer:
    """Make a layer of the stations of a comparison."""
    stations = [(line, at) for line in found.lines for at in range(len(line.state)) if line.state[at]]
    columns: list[Sequence[Any]] = [[line.line_id for line, _ in stations]]
    columns += [[getattr(line, field.name)[at] for line, at in stations] for field in DIFFERENCE_FIELDS[1:]]
    places = [line.xyz[at] for line, at in stations]
    return Layer("differences", destination, DIFFERENCE_FIELDS, columns, _type("Point", places), places)


def _type(kind: str, places: Sequence[np.ndarray]) -> str:
    """Return the type of a geometry: without heights if none is known."""
    known = any(np.isfinite(np.atleast_2d(one)[:, 2]).any() for one in places)
    return f"{kind} Z" if known else f"{kind} "


def write_files(layers: Sequence[Layer], frame: LocalFrame) -> None:
    """Write layers into the GeoPackages of their destinations; see `write_layers`."""
    for file in dict.fromkeys(layer.destination.file for layer in layers):
        write_layers([layer for layer in layers if layer.destination.file == file], frame)


def write_copy(
    destination: Destination, source: Features, fields: Sequence[Field], columns: Sequence[Sequence[Any]]
) -> None:
    """Write the features of another layer with further fields into a GeoPackage.

    Parameters
    ----------
    destination : Destination
    source : Features
    fields : sequence of Field
    columns : sequence of sequence
        Values of each further field, one per feature.
    """
    further = [_column(field, values) for field, values in zip(fields, columns)]
    kept = {name: values for name, values in source.columns.items() if name not in {field.name for field in fields}}
    kinds = {shape.geom_type for shape in source.shapes if shape is not None}
    with destination.replacing() as new, _as_os_error():
        pyogrio.raw.write(
            str(new),
            layer="stations",
            driver="GPKG",
            geometry=np.array([shapely.to_wkb(shape, output_dimension=4) for shape in source.shapes], dtype=object),
            geometry_type=kinds.pop() if len(kinds) == 1 else "Unknown",
            field_data=[*kept.values(), *(column for column, _ in further)],
            field_mask=[*(None for _ in kept), *(empty for _, empty in further)],
            fields=[*kept, *(field.name for field in fields)],
            crs=source.crs_wkt or UNKNOWN_IN_METRES,
            nan_as_null=True,
        )


@contextmanager
def _as_os_error() -> Iterator[None]:
    """Turn what GDAL raises into an `OSError`, which a destination explains."""
    try:
        yield
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, RuntimeError) as error:
        raise OSError(str(error)) from error


def write_layers(layers: Sequence[Layer], frame: LocalFrame) -> None:
    """Write layers into one GeoPackage, whose other layers stay, or one layer into a DXF or CSV file.

    Parameters
    ----------
    layers : sequence of Layer
        All with the same destination.
    frame : LocalFrame
        Local frame of the layers.

    Raises
    ------
    DiskError
        See `Destination.replacing`.
    """
    names = {layer.name for layer in layers}
    destination = layers[0].destination
    if destination.file.suffix.lower() != ".gpkg":
        _write_for_others(layers[0], frame)
        return
    with destination.replacing(edit=bool(tables_in(destination.file) - names)) as new:
        for layer in layers:
            _write_layer(layer, frame, new)


def _write_for_others(layer: Layer, frame: LocalFrame) -> None:
    """Write a layer for other programs, by the suffix of its file."""
    columns = [[field.value(value) for value in values] for field, values in zip(layer.fields, layer.columns)]
    shapes = [Shape(np.atleast_2d(frame.to_crs(xyz)), values) for xyz, values in zip(layer.xyz, zip(*columns))]
    is_line = layer.geometry_type != "Point Z"
    with layer.destination.replacing() as new:
        write_shapes(new, shapes, layer.fields, frame, DRAWN[layer.name], is_line)


def _write_layer(layer: Layer, frame: LocalFrame, file: Path) -> None:
    """Write a layer, in place of the one of this name that the file has."""
    columns = [_column(field, values) for field, values in zip(layer.fields, layer.columns)]
    with _as_os_error():
        pyogrio.raw.write(
            str(file),
            layer=layer.name,
            driver="GPKG",
            geometry=_geometry(layer, frame),
            geometry_type="Unknown" if layer.geometry_type.endswith("M") else layer.geometry_type.strip(),
            field_data=[column for column, _ in columns],
            field_mask=[empty for _, empty in columns],
            fields=[field.name for field in layer.fields],
            crs=frame.crs_wkt or UNKNOWN_IN_METRES,
            nan_as_null=True,
        )


def _geometry(layer: Layer, frame: LocalFrame) -> np.ndarray:
    """Geometries in the coordinates of the cloud as well-known binary, (n,)."""
    make = shapely.points if layer.geometry_type.startswith("Point") else shapely.linestrings
    own = slice(3 if "Z" in layer.geometry_type else 2)
    places = [frame.to_crs(xyz[..., :3])[..., own] for xyz in layer.xyz]
    if layer.geometry_type.endswith("M"):
        made = [measured_line(np.column_stack([place, xyz[:, 3]])) for place, xyz in zip(places, layer.xyz)]
    else:
        made = [shapely.to_wkb(make(place), output_dimension=3) for place in places]
    return np.array(made, dtype=object)


def measured_line(vertices: np.ndarray) -> bytes:
    """Return a line with M values as well-known binary, which shapely does not write.

    Parameters
    ----------
    vertices : (n, 3) or (n, 4) array
        x, y, perhaps z, and M.
    """
    count, size = vertices.shape
    return struct.pack("<BII", 1, {3: LINE_M, 4: LINE_ZM}[size], count) + vertices.astype("<f8").tobytes()


def _column(field: Field, values: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Values of a field as they are written, and where there are none, (n,) each."""
    written = [field.value(value) for value in values]
    empty = np.array([value is None for value in written], dtype=bool)
    filler = 0 if field.kind is int else None
    return np.array([filler if value is None else value for value in written], dtype=KINDS[field.kind]), empty
