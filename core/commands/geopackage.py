"""Layers of results in GeoPackages, with the fields of the interface, without QGIS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import shapely

from ..airborne.survey import AirborneTrack
from ..disk import Destination
from ..exchange import DRAWN, Shape, write_shapes
from ..fields import AIRBORNE_STATION_FIELDS, QUALITY_FIELDS, STOP_FIELDS, UNKNOWN_IN_METRES, Field
from ..frame import LocalFrame
from ..geopackage import tables_in
from ..grow.growth import Stop
from ..rails import Centerline, RailLine, TrackGeometry
from ..report import Finding

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
        "LineString Z" or "Point Z".
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
    return Layer(
        name, destination, QUALITY_FIELDS, columns, "Point Z", [place for track in tracks for place in track.xyz]
    )


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
    try:
        pyogrio.raw.write(
            str(file),
            layer=layer.name,
            driver="GPKG",
            geometry=_geometry(layer, frame),
            geometry_type=layer.geometry_type,
            field_data=[column for column, _ in columns],
            field_mask=[empty for _, empty in columns],
            fields=[field.name for field in layer.fields],
            crs=frame.crs_wkt or UNKNOWN_IN_METRES,
            nan_as_null=True,
        )
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, RuntimeError) as error:
        raise OSError(str(error)) from error


def _geometry(layer: Layer, frame: LocalFrame) -> np.ndarray:
    """Geometries in the coordinates of the cloud as well-known binary, (n,)."""
    make = shapely.points if layer.geometry_type == "Point Z" else shapely.linestrings
    shapes = [make(frame.to_crs(xyz)) for xyz in layer.xyz]
    return np.array([shapely.to_wkb(shape, output_dimension=3) for shape in shapes], dtype=object)


def _column(field: Field, values: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Values of a field as they are written, and where there are none, (n,) each."""
    written = [field.value(value) for value in values]
    empty = np.array([value is None for value in written], dtype=bool)
    filler = 0 if field.kind is int else None
    return np.array([filler if value is None else value for value in written], dtype=KINDS[field.kind]), empty
