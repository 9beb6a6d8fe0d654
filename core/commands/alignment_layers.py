"""Layers of the commands about alignments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyogrio
import shapely

from ..alignment.deviations import Deviations
from ..alignment.elements import Alignment
from ..alignment.equations import measured
from ..alignment.table import rows
from ..comparison.tracks import TrackComparison
from ..disk import Destination
from ..fields import (
    AXIS_FIELDS,
    DEVIATION_FIELDS,
    DIFFERENCE_FIELDS,
    ELEMENT_FIELDS,
    UNKNOWN_IN_METRES,
    Field,
)
from ..frame import LocalFrame
from .features import Features
from .geopackage import Layer, as_os_error, by_file, column_of, write_layers


def elements_layer(alignments: Sequence[Alignment]) -> Layer:
    """Make a layer of the element tables of alignments, each element with its curve."""
    table = [row for alignment in alignments for row in rows(alignment)]
    columns = [[row[field.name] for row in table] for field in ELEMENT_FIELDS]
    curves = [alignment.drawn(one.s_from, one.s_to) for alignment in alignments for one in alignment.elements]
    return Layer("elements", ELEMENT_FIELDS, columns, _type("LineString", curves), curves)


def axes_layer(alignments: Sequence[Alignment]) -> Layer:
    """Make a layer of alignments as lines with kilometres as M values."""
    lines = [measured(alignment) for alignment in alignments]
    columns: list[Sequence[Any]] = [
        [one.track_id for one in alignments],
        [one.name for one in alignments],
        [one.s_to - one.s_from for one in alignments],
        [line[0, 3] for line in lines],
        [line[-1, 3] for line in lines],
    ]
    return Layer("axis", AXIS_FIELDS, columns, _type("LineString", lines) + " M", lines)


def deviations_layer(found: Sequence[Deviations]) -> Layer:
    """Make a layer of the deviations of tracks, as points on their designs."""
    columns: list[Sequence[Any]] = [[one.track_id for one in found for _ in one.s]]
    columns += [[value for one in found for value in getattr(one, field.name)] for field in DEVIATION_FIELDS[1:]]
    places = [place for one in found for place in one.xyz]
    return Layer("deviations", DEVIATION_FIELDS, columns, _type("Point", places), places)


def differences_layer(found: TrackComparison) -> Layer:
    """Make a layer of the stations of a comparison."""
    stations = [(line, at) for line in found.lines for at in range(len(line.state)) if line.state[at]]
    columns: list[Sequence[Any]] = [[line.line_id for line, _ in stations]]
    columns += [[getattr(line, field.name)[at] for line, at in stations] for field in DIFFERENCE_FIELDS[1:]]
    places = [line.xyz[at] for line, at in stations]
    return Layer("differences", DIFFERENCE_FIELDS, columns, _type("Point", places), places)


def _type(kind: str, places: Sequence[np.ndarray]) -> str:
    """Return the type of a geometry: without heights if none is known."""
    known = any(np.isfinite(np.atleast_2d(one)[:, 2]).any() for one in places)
    return f"{kind} Z" if known else kind


def write_all(layers: Sequence[Layer], outputs: Mapping[str, Destination], frame: LocalFrame) -> None:
    """Write layers into the GeoPackages of the outputs of their names."""
    for same, file in by_file(layers, outputs):
        write_layers(same, file, frame)


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
    further = [column_of(field, [field.value(value) for value in values]) for field, values in zip(fields, columns)]
    kept = {name: values for name, values in source.columns.items() if name not in {field.name for field in fields}}
    kinds = {shape.geom_type for shape in source.shapes if shape is not None}
    with destination.replacing() as new, as_os_error():
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
