"""Layers of results in GeoPackages, which are read without GDAL, with the fields of the interface, without QGIS."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio
import shapely

from ..disk import Destination
from ..errors import ParameterError
from ..fields import UNKNOWN_IN_METRES, Field, Product
from ..frame import LocalFrame
from .exchange import Shape, write_shapes
from .geopackage import tables_in
from .layers import AnyLayer, Copy, Layer, written_by_name

LINE_M, LINE_ZM = 2002, 3002
"""Codes of lines with M values in well-known binary."""

KINDS = {int: np.int32, float: float, str: object}


def write_layers(layers: Sequence[AnyLayer], destination: Destination, frame: LocalFrame) -> None:
    """Write layers of a local frame into one GeoPackage, whose other layers stay, or the first into a DXF or CSV."""
    names = {layer.product.name for layer in layers}
    if destination.file.suffix.lower() != ".gpkg":
        _write_for_others(layers[0], destination, frame)
        return
    with destination.replacing(edit=bool(tables_in(destination.file) - names)) as new:
        for layer in layers:
            _write_layer(layer, frame, new)


def _write_for_others(layer: AnyLayer, destination: Destination, frame: LocalFrame) -> None:
    """Write a layer for other programs, by the suffix of its file."""
    product, is_line = layer.product, layer.product.is_line
    if isinstance(layer, Copy):
        product, is_line, shapes = _drawn(layer, destination.path.name)
    else:
        rows = zip(*layer.written_columns())
        shapes = [Shape(np.atleast_2d(frame.to_crs(xyz[..., :3])), values) for xyz, values in zip(layer.xyz, rows)]
    with destination.replacing() as new:
        write_shapes(new, shapes, product.fields, frame, product.drawn, is_line)


def _drawn(layer: Copy, name: str) -> tuple[Product, bool, list[Shape]]:
    """Return a copy as lines or points with its fields: their product, whether they are lines, and the shapes."""
    parts, numbers = shapely.get_parts(layer.originals.shapes, return_index=True)
    kinds = {part.geom_type for part in parts}
    if len(kinds) > 1 or "Polygon" in kinds:
        raise ParameterError(f"{name} can only have points, or only lines: choose a GeoPackage.")
    kinds_of = ({"i": int, "f": float}.get(values.dtype.kind, str) for values, _ in _columns(layer))
    fields = tuple(Field(name, kind, "") for name, kind in zip(written_by_name(layer), kinds_of))
    more = zip(*layer.written_columns())
    rows = [[*own.values(), *values] for (_, own), values in zip(layer.originals.rows(), more)]
    shapes = [
        Shape(shapely.get_coordinates(part, include_z=True), rows[number]) for part, number in zip(parts, numbers)
    ]
    return replace(layer.product, fields=fields), kinds == {"LineString"}, shapes


def _write_layer(layer: AnyLayer, frame: LocalFrame, file: Path) -> None:
    """Write a layer, in place of the one of this name that the file has; what GDAL raises becomes an `OSError`."""
    if isinstance(layer, Copy):
        kinds = {shape.geom_type for shape in layer.originals.shapes if shape is not None}
        kind = kinds.pop() if len(kinds) == 1 else "Unknown"
        shapes = np.array([shapely.to_wkb(one, output_dimension=4) for one in layer.originals.shapes], dtype=object)
    else:
        kind = ("LineString" if layer.product.is_line else "Point") + ("" if layer.is_flat else " Z")
        kind, shapes = "Unknown" if layer.is_measured else kind, _geometry(layer, frame)
    columns = _columns(layer)
    try:
        pyogrio.raw.write(
            str(file),
            layer=layer.product.name,
            driver="GPKG",
            geometry=shapes,
            geometry_type=kind,
            field_data=[values for values, _ in columns],
            field_mask=[empty for _, empty in columns],
            fields=list(written_by_name(layer)),
            crs=frame.crs_wkt or UNKNOWN_IN_METRES,
            nan_as_null=True,
        )
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, RuntimeError) as error:
        raise OSError(str(error)) from error


def _columns(layer: AnyLayer) -> list[tuple[np.ndarray, np.ndarray | None]]:
    """Return the values of each field, and where there are none, (n,) each; None where the values say so themselves."""
    own = layer.originals.columns.values() if isinstance(layer, Copy) else ()
    return [*((values, None) for values in own), *map(column_of, layer.fields, layer.written_columns())]


def shapes_of(layer: AnyLayer, frame: LocalFrame) -> Sequence:
    """Return the geometries in the coordinates of the cloud, given the local frame of the layer."""
    if isinstance(layer, Copy):
        return layer.originals.shapes
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
    """Return a line with x, y, perhaps z, and M values, (n, 3 or 4), as well-known binary: shapely writes no M."""
    count, size = vertices.shape
    return struct.pack("<BII", 1, {3: LINE_M, 4: LINE_ZM}[size], count) + vertices.astype("<f8").tobytes()


def column_of(field: Field, written: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Values of a field, given as they are written, and where there are none, (n,) each."""
    empty = np.array([value is None for value in written], dtype=bool)
    filler = 0 if field.kind is int else None
    return np.array([filler if value is None else value for value in written], dtype=KINDS[field.kind]), empty
