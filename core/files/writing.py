"""Layers of results in GeoPackages, with the fields of the interface, without QGIS."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import shapely

from ..disk import Destination
from ..fields import UNKNOWN_IN_METRES, Field
from ..frame import LocalFrame
from .exchange import Shape, write_shapes
from .geopackage import tables_in
from .layers import Layer

LINE_M, LINE_ZM = 2002, 3002
"""Codes of lines with M values in well-known binary."""

KINDS = {int: np.int32, float: float, str: object}


def write_layers(layers: Sequence[Layer], destination: Destination, frame: LocalFrame) -> None:
    """Write layers into one GeoPackage, whose other layers stay, or one layer into a DXF or CSV file.

    Parameters
    ----------
    layers : sequence of Layer
        Only the first of them goes into a DXF or CSV file.
    frame : LocalFrame
        Local frame of the layers.

    Raises
    ------
    DiskError
        See `Destination.replacing`.
    """
    names = {layer.product.name for layer in layers}
    if destination.file.suffix.lower() != ".gpkg":
        _write_for_others(layers[0], destination, frame)
        return
    with destination.replacing(edit=bool(tables_in(destination.file) - names)) as new:
        for layer in layers:
            _write_layer(layer, frame, new)


def _write_for_others(layer: Layer, destination: Destination, frame: LocalFrame) -> None:
    """Write a layer for other programs, by the suffix of its file."""
    rows = zip(*layer.written_columns())
    shapes = [Shape(np.atleast_2d(frame.to_crs(xyz[..., :3])), values) for xyz, values in zip(layer.xyz, rows)]
    product = layer.product
    with destination.replacing() as new:
        write_shapes(new, shapes, product.fields, frame, product.drawn, product.is_line)


def _write_layer(layer: Layer, frame: LocalFrame, file: Path) -> None:
    """Write a layer, in place of the one of this name that the file has."""
    product = layer.product
    columns = {one.name: column_of(one, values) for one, values in zip(product.fields, layer.written_columns())}
    kind = ("LineString" if product.is_line else "Point") + ("" if layer.is_flat else " Z")
    write_table(
        file, product.name, _geometry(layer, frame), "Unknown" if layer.is_measured else kind, columns, frame.crs_wkt
    )


def write_table(
    file: Path,
    layer: str,
    shapes: np.ndarray,
    kind: str,
    columns: Mapping[str, tuple[np.ndarray, np.ndarray | None]],
    crs_wkt: str | None,
) -> None:
    """Write features into a GeoPackage, in place of the layer of this name that it has.

    `shapes` are well-known binary, (n,); a column has its values, and where there are none, (n,) each. What GDAL raises
    becomes an `OSError`, which a destination explains.
    """
    try:
        pyogrio.raw.write(
            str(file),
            layer=layer,
            driver="GPKG",
            geometry=shapes,
            geometry_type=kind,
            field_data=[values for values, _ in columns.values()],
            field_mask=[empty for _, empty in columns.values()],
            fields=list(columns),
            crs=crs_wkt or UNKNOWN_IN_METRES,
            nan_as_null=True,
        )
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, RuntimeError) as error:
        raise OSError(str(error)) from error


def shapes_of(layer: Layer, frame: LocalFrame) -> list:
    """Return the geometries in the coordinates of the cloud, given the local frame of the layer."""
    make = shapely.linestrings if layer.product.is_line else shapely.points
    return [make(places) for places in layer.places(frame)]


def _geometry(layer: Layer, frame: LocalFrame) -> np.ndarray:
    """Geometries in the coordinates of the cloud as well-known binary, (n,)."""
    if layer.is_measured:
        pairs = zip(layer.places(frame), layer.xyz)
        made = [measured_line(np.column_stack([places, xyz[:, 3]])) for places, xyz in pairs]
    else:
        made = [shapely.to_wkb(shape, output_dimension=3) for shape in shapes_of(layer, frame)]
    return np.array(made, dtype=object)


def measured_line(vertices: np.ndarray) -> bytes:
    """Return a line of x, y, perhaps z, and M, (n, 3) or (n, 4), as well-known binary; shapely writes no M."""
    count, size = vertices.shape
    return struct.pack("<BII", 1, {3: LINE_M, 4: LINE_ZM}[size], count) + vertices.astype("<f8").tobytes()


def column_of(field: Field, written: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Values of a field, given as they are written, and where there are none, (n,) each."""
    empty = np.array([value is None for value in written], dtype=bool)
    filler = 0 if field.kind is int else None
    return np.array([filler if value is None else value for value in written], dtype=KINDS[field.kind]), empty
