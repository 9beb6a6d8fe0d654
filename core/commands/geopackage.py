"""Layers of results in GeoPackages, with the fields of the interface, without QGIS."""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import shapely

from ..airborne.survey import AirborneTrack
from ..disk import Destination
from ..exchange import DRAWN, Shape, write_shapes
from ..fields import (
    AIRBORNE_STATION_FIELDS,
    CENTERLINE_FIELDS,
    FINDING_FIELDS,
    KM_FIELDS,
    QUALITY_FIELDS,
    RAIL_FIELDS,
    STATION_FIELDS,
    STOP_FIELDS,
    UNKNOWN_IN_METRES,
    Field,
)
from ..frame import LocalFrame
from ..geopackage import tables_in
from ..grow.growth import Stop
from ..rails import Centerline, RailLine, RailNetwork, TrackGeometry
from ..report import Finding, list_findings

LINE_M, LINE_ZM = 2002, 3002
"""Codes of lines with M values in well-known binary."""

KINDS = {int: np.int32, float: float, str: object}


@dataclass(frozen=True)
class Layer:
    """A layer to write.

    Attributes
    ----------
    name : str
    fields : sequence of Field
    columns : sequence of sequence
        Values of each field, one per feature.
    geometry_type : str
        "LineString Z" or "Point Z"; without Z, heights are left out, and with M, lines have a fourth column.
    xyz : sequence of (n, 3) or (3,) array
        Vertices of each line, or place of each point, in local metres.
    """

    name: str
    fields: Sequence[Field]
    columns: Sequence[Sequence[Any]]
    geometry_type: str
    xyz: Sequence[np.ndarray]

    def shapes(self, frame: LocalFrame) -> list:
        """Return the geometries in the coordinates of the cloud, given the local frame of the layer."""
        make = shapely.points if self.geometry_type.startswith("Point") else shapely.linestrings
        own = slice(3 if "Z" in self.geometry_type else 2)
        return [make(frame.to_crs(xyz[..., :3])[..., own]) for xyz in self.xyz]

    def written_columns(self) -> list[list[Any]]:
        """Return the columns with the values as they are written; None where one is unknown."""
        return [[field.value(value) for value in values] for field, values in zip(self.fields, self.columns)]


def network_layers(network: RailNetwork, names: Collection[str], gauges_m: Sequence[float]) -> list[Layer]:
    """Make layers of an extraction.

    Parameters
    ----------
    network : RailNetwork
        With the geometry of its tracks, if "quality" or "findings" is among the names.
    names : collection of str
        Of "rails", "centerlines", "quality" and "findings".
    gauges_m : sequence of float
        Gauges of the extraction.
    """
    makers: dict[str, Callable[[], Layer]] = {
        "rails": lambda: lines_layer("rails", RAIL_FIELDS, network.rails),
        "centerlines": lambda: lines_layer("centerlines", CENTERLINE_FIELDS, network.centerlines),
        "quality": lambda: stations_layer("quality", network.geometry),
        "findings": lambda: findings_layer(list_findings(network, gauges_m)),
    }
    return [make() for name, make in makers.items() if name in names]


def findings_layer(found: Sequence[Finding]) -> Layer:
    """Make a layer of findings: with an axis, also with their kilometres."""
    located = any(finding.km_text is not None for finding in found)
    return lines_layer("findings", (*FINDING_FIELDS, *KM_FIELDS) if located else FINDING_FIELDS, found)


def lines_layer(
    name: str,
    fields: Sequence[Field],
    lines: Sequence[RailLine] | Sequence[Centerline] | Sequence[Finding],
) -> Layer:
    """Make a layer of lines."""
    columns = [[getattr(line, field.name) for line in lines] for field in fields]
    return Layer(name, fields, columns, "LineString Z", [line.xyz for line in lines])


def stations_layer(name: str, tracks: Sequence[TrackGeometry]) -> Layer:
    """Make a layer of the stations of tracks, with the fields of QUALITY."""
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
    return Layer(name, fields, columns, "Point Z", [place for track in tracks for place in track.xyz])


def stops_layer(stops: Sequence[Stop]) -> Layer:
    """Make a layer of the places where rails were not followed further."""
    columns: list[Sequence[Any]] = [range(1, len(stops) + 1), [stop.reason.value for stop in stops]]
    return Layer("stops", STOP_FIELDS, columns, "Point Z", [stop.xyz for stop in stops])


def airborne_stations_layer(tracks: Sequence[AirborneTrack]) -> Layer:
    """Make a layer of the stations along guides."""
    columns: list[Sequence[Any]] = [
        [value for track in tracks for value in np.broadcast_to(getattr(track, field.name), len(track.xyz))]
        for field in AIRBORNE_STATION_FIELDS
    ]
    columns[0] = [int(number) or None for number in columns[0]]
    places = [place for track in tracks for place in track.xyz]
    return Layer("stations", AIRBORNE_STATION_FIELDS, columns, "Point Z", places)


def by_file(layers: Sequence[Layer], destinations: Mapping[str, Destination]) -> list[tuple[list[Layer], Destination]]:
    """Group layers by the file that each goes into, given the destinations by name of the layer; for `write_layers`."""
    groups: dict[Path, tuple[list[Layer], Destination]] = {}
    for layer in layers:
        destination = destinations[layer.name]
        groups.setdefault(destination.file, ([], destination))[0].append(layer)
    return list(groups.values())


def write_layers(layers: Sequence[Layer], destination: Destination, frame: LocalFrame) -> None:
    """Write layers into one GeoPackage, whose other layers stay, or one layer into a DXF or CSV file.

    Parameters
    ----------
    layers : sequence of Layer
        Only the first of them goes into a DXF or CSV file.
    destination : Destination
    frame : LocalFrame
        Local frame of the layers.

    Raises
    ------
    DiskError
        See `Destination.replacing`.
    """
    names = {layer.name for layer in layers}
    if destination.file.suffix.lower() != ".gpkg":
        _write_for_others(layers[0], destination, frame)
        return
    with destination.replacing(edit=bool(tables_in(destination.file) - names)) as new:
        for layer in layers:
            _write_layer(layer, frame, new)


def _write_for_others(layer: Layer, destination: Destination, frame: LocalFrame) -> None:
    """Write a layer for other programs, by the suffix of its file."""
    rows = zip(*layer.written_columns())
    shapes = [Shape(np.atleast_2d(frame.to_crs(xyz)), values) for xyz, values in zip(layer.xyz, rows)]
    is_line = layer.geometry_type != "Point Z"
    with destination.replacing() as new:
        write_shapes(new, shapes, layer.fields, frame, DRAWN[layer.name], is_line)


def _write_layer(layer: Layer, frame: LocalFrame, file: Path) -> None:
    """Write a layer, in place of the one of this name that the file has."""
    columns = [column_of(field, values) for field, values in zip(layer.fields, layer.written_columns())]
    with as_os_error():
        pyogrio.raw.write(
            str(file),
            layer=layer.name,
            driver="GPKG",
            geometry=_geometry(layer, frame),
            geometry_type="Unknown" if layer.geometry_type.endswith("M") else layer.geometry_type,
            field_data=[column for column, _ in columns],
            field_mask=[empty for _, empty in columns],
            fields=[field.name for field in layer.fields],
            crs=frame.crs_wkt or UNKNOWN_IN_METRES,
            nan_as_null=True,
        )


@contextmanager
def as_os_error() -> Iterator[None]:
    """Turn what GDAL raises into an `OSError`, which a destination explains."""
    try:
        yield
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, RuntimeError) as error:
        raise OSError(str(error)) from error


def _geometry(layer: Layer, frame: LocalFrame) -> np.ndarray:
    """Geometries in the coordinates of the cloud as well-known binary, (n,)."""
    shapes = layer.shapes(frame)
    if layer.geometry_type.endswith("M"):
        pairs = zip(shapes, layer.xyz)
        made = [measured_line(np.column_stack([_vertices(shape), xyz[:, 3]])) for shape, xyz in pairs]
    else:
        made = [shapely.to_wkb(shape, output_dimension=3) for shape in shapes]
    return np.array(made, dtype=object)


def _vertices(shape: shapely.Geometry) -> np.ndarray:
    return shapely.get_coordinates(shape, include_z=shapely.has_z(shape))


def measured_line(vertices: np.ndarray) -> bytes:
    """Return a line with M values as well-known binary, which shapely does not write.

    Parameters
    ----------
    vertices : (n, 3) or (n, 4) array
        x, y, perhaps z, and M.
    """
    count, size = vertices.shape
    return struct.pack("<BII", 1, {3: LINE_M, 4: LINE_ZM}[size], count) + vertices.astype("<f8").tobytes()


def column_of(field: Field, written: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Values of a field, given as they are written, and where there are none, (n,) each."""
    empty = np.array([value is None for value in written], dtype=bool)
    filler = 0 if field.kind is int else None
    return np.array([filler if value is None else value for value in written], dtype=KINDS[field.kind]), empty
