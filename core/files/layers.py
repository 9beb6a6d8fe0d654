"""The results of a run as layers: the rows and the geometry of each product, for QGIS and the commands alike."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, count
from typing import TYPE_CHECKING, Any, ClassVar, Union

import numpy as np

from ..alignment.elements import Alignment, measured
from ..checks.findings import Finding, list_findings
from ..fields import (
    AXES,
    CENTERLINES,
    DIFFERENCES,
    ELEMENTS,
    FINDINGS,
    LOCATED_FINDINGS,
    LOCATED_QUALITY,
    PLACES,
    QUALITY,
    RAILS,
    STATION_FIELDS,
    STATIONS,
    STOPS,
    Field,
    Product,
)
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from ..rails import Centerline, RailLine, RailNetwork, TrackGeometry
from .table import rows

if TYPE_CHECKING:
    from ..airborne.survey import AirborneLine, AirborneTrack
    from ..comparison import TrackComparison
    from ..grow.growth import Stop

    Line = Union[RailLine, Centerline, Finding, AirborneLine]


@dataclass(frozen=True)
class Layer:
    """A layer to write: columns of values, one per feature, for its fields, and geometries in local metres.

    `xyz` has the vertices of each line, (n, 3), or with M values (n, 4), or the place of each point, (3,).
    """

    product: Product
    columns: Sequence[Sequence[Any]]
    xyz: Sequence[np.ndarray]

    @property
    def fields(self) -> tuple[Field, ...]:
        """Fields of the columns."""
        return self.product.fields

    @property
    def is_flat(self) -> bool:
        """Whether there are features, and none has heights."""
        return len(self.xyz) > 0 and all(np.isnan(one[..., 2]).any() for one in self.xyz)

    @property
    def is_measured(self) -> bool:
        """Whether lines have M values."""
        return self.product.is_line and any(one.shape[-1] == 4 for one in self.xyz)

    def written_columns(self) -> list[list[Any]]:
        """Return the columns with the values as they are written; None where one is unknown."""
        return [[field.value(value) for value in values] for field, values in zip(self.product.fields, self.columns)]

    def places(self, frame: LocalFrame) -> Iterator[np.ndarray]:
        """Yield x, y and, unless none is known, z of each geometry in the coordinates of the cloud."""
        own = slice(2 if self.is_flat else 3)
        if self.product.is_line:
            return (frame.to_crs(one[:, :3])[:, own] for one in self.xyz)
        return iter(frame.to_crs(np.reshape(self.xyz, (-1, 3)))[:, own])


@dataclass(frozen=True)
class Copy:
    """A layer of the user, as the front end has read it, with further fields: columns of values, one per feature."""

    product: ClassVar[Product] = PLACES
    originals: Any
    fields: tuple[Field, ...]
    columns: Sequence[Sequence[Any]]

    def written_columns(self) -> list[list[Any]]:
        """Return the further columns with the values as they are written; None where one is unknown."""
        return [[field.value(value) for value in values] for field, values in zip(self.fields, self.columns)]


AnyLayer = Union[Layer, Copy]


def written_by_name(layer: AnyLayer) -> dict[str, Sequence[Any]]:
    """Return the values of the fields as they are written; a further one of a copy whose name is taken gets a number.

    >>> from types import SimpleNamespace as Originals
    >>> km = Field("km", float, "", 3)
    >>> list(written_by_name(Copy(Originals(columns={"km": [7.0]}), (km,), [[12.1]])))
    ['km', 'km_2']
    """
    found = dict(layer.originals.columns) if isinstance(layer, Copy) else {}
    for one, values in zip(layer.fields, layer.written_columns()):
        names = chain([one.name], (f"{one.name}_{number}" for number in count(2)))
        found[next(name for name in names if name not in found)] = values
    return found


def network_makers(network: RailNetwork, gauges_m: Sequence[float]) -> dict[str, Callable[[], Layer]]:
    """Return the functions that make the layers of an extraction by name; quality needs the geometry of tracks."""
    return {
        "rails": lambda: lines_layer(RAILS, network.rails),
        "centerlines": lambda: lines_layer(CENTERLINES, network.centerlines),
        "quality": lambda: quality_layer(network.geometry),
        "findings": lambda: findings_layer(list_findings(network, gauges_m)),
    }


def lines_layer(product: Product, lines: Sequence[Line]) -> Layer:
    """Make a layer of lines whose attributes have the names of the fields."""
    columns = [[getattr(line, field.name) for line in lines] for field in product.fields]
    return Layer(product, columns, [line.xyz for line in lines])


def findings_layer(found: Sequence[Finding]) -> Layer:
    """Make a layer of findings: with an axis, also with their kilometres."""
    located = any(finding.km_text is not None for finding in found)
    return lines_layer(LOCATED_FINDINGS if located else FINDINGS, found)


def stations_layer(product: Product, tracks: Sequence[Any]) -> Layer:
    """Make a layer of the stations of tracks, whose attributes, one or one for each station, have the fields' names."""
    columns = [_along(tracks, field.name) for field in product.fields]
    return Layer(product, columns, [place for track in tracks for place in track.xyz])


def _along(tracks: Sequence[Any], name: str) -> list[Any]:
    """Return an attribute of tracks, one value for all stations of a track or one for each."""
    return [value for track in tracks for value in np.broadcast_to(getattr(track, name), len(track.xyz))]


def quality_layer(tracks: Sequence[TrackGeometry]) -> Layer:
    """Make a layer of the stations of tracks: with an axis, also with their kilometres."""
    plain = stations_layer(QUALITY, tracks)
    located = [track.kilometres for track in tracks if track.kilometres is not None]
    if not located:
        return plain
    further = [[value for one in located for value in getattr(one, field.name)] for field in STATION_FIELDS]
    return Layer(LOCATED_QUALITY, [*plain.columns, *further], plain.xyz)


def airborne_stations_layer(tracks: Sequence[AirborneTrack]) -> Layer:
    """Make a layer of the stations along guides."""
    made = stations_layer(STATIONS, tracks)
    return replace(made, columns=[[int(number) or None for number in made.columns[0]], *made.columns[1:]])


def stops_layer(stops: Sequence[Stop]) -> Layer:
    """Make a layer of the places where rails were not followed further."""
    columns: list[Sequence[Any]] = [range(1, len(stops) + 1), [stop.reason.value for stop in stops]]
    return Layer(STOPS, columns, [stop.xyz for stop in stops])


def elements_layer(alignments: Sequence[Alignment], progress: Progress = SILENT) -> Layer:
    """Make a layer of the element tables of alignments, each element with its curve."""
    table = [row for alignment in alignments for row in rows(alignment, progress)]
    columns = [[row[field.name] for row in table] for field in ELEMENTS.fields]
    curves = []
    for alignment in alignments:
        for one in alignment.elements:
            progress.check()
            curves.append(alignment.drawn(one.s_from, one.s_to))
    return Layer(ELEMENTS, columns, curves)


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
    return Layer(AXES, columns, lines)


def differences_layer(found: TrackComparison) -> Layer:
    """Make a layer of the stations of a comparison."""
    stations = [(line, at) for line in found.lines for at in range(len(line.state)) if line.state[at]]
    columns: list[Sequence[Any]] = [[line.line_id for line, _ in stations]]
    columns += [[getattr(line, field.name)[at] for line, at in stations] for field in DIFFERENCES.fields[1:]]
    return Layer(DIFFERENCES, columns, [line.xyz[at] for line, at in stations])
