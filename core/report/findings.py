"""Findings of the report: how much of the tracks is in doubt, why, and where."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..rails import Centerline, RailNetwork, TrackGeometry, cell_borders

GAUGE_OFF_MM = 10.0
"""Plain track is not left in service with a larger deviation from its gauge. Curves of less than 200 m radius are
widened by more, and deserve a look."""

UNSURE_MM = 5.0
"""A track survey does not accept larger standard errors of a centerline."""

MERGE_M = 5.0
"""Doubtful places closer than this along the track count as one."""

FEW, MANY = 0.05, 0.25
"""Share of the length in doubt up to which a result is good with a few exceptions, and above which it is poor."""


@dataclass(frozen=True)
class Doubt:
    """A reason to look at a place.

    Attributes
    ----------
    name : str
        CSS class of its marks in the pictures.
    label : str
        The reason in words, for lists.
    """

    name: str
    label: str


UNSUPPORTED = Doubt("unsupported", "a rail has no points")
OFF_GAUGE = Doubt("offgauge", f"gauge off by more than {GAUGE_OFF_MM:g} mm")
UNSURE = Doubt("unsure", f"standard error above {UNSURE_MM:g} mm")
DOUBTS = (UNSUPPORTED, OFF_GAUGE, UNSURE)
"""In order of severity; a place counts under the first that applies."""


@dataclass(frozen=True)
class Place:
    """A section of a track to look at.

    Attributes
    ----------
    track_id : int
    doubt : Doubt
    start_m, end_m : float
        Chainages.
    length_m : float
        Length in doubt within the section.
    """

    track_id: int
    doubt: Doubt
    start_m: float
    end_m: float
    length_m: float


@dataclass(frozen=True)
class TrackFindings:
    """The findings on one track.

    Attributes
    ----------
    line : Centerline
    geometry : TrackGeometry
    nominal_mm : float
        Nearest of the gauges that tracks may have.
    doubtful : dict of Doubt to (n,) bool array
        Stations in doubt, by reason; a station has at most one.
    """

    line: Centerline
    geometry: TrackGeometry
    nominal_mm: float
    doubtful: dict[Doubt, np.ndarray]

    @property
    def length_m(self) -> float:
        """Plan length."""
        return float(self.geometry.cells_m.sum())

    def length_of(self, doubt: Doubt) -> float:
        """Return the length in doubt for a reason."""
        return float(self.geometry.cells_m[self.doubtful[doubt]].sum())

    def places(self, doubt: Doubt, merge_m: float = MERGE_M) -> list[Place]:
        """Return the places in doubt for a reason; those no more than `merge_m` apart are merged."""
        return list(_places(self.geometry, doubt, self.doubtful[doubt], merge_m))


@dataclass(frozen=True)
class Findings:
    """The findings on all tracks, and the number and length of the rails that belong to none."""

    tracks: tuple[TrackFindings, ...]
    lonely_rails: int
    lonely_m: float

    @property
    def length_m(self) -> float:
        """Plan length of all tracks."""
        return sum(track.length_m for track in self.tracks)

    def length_of(self, doubt: Doubt) -> float:
        """Return the length of all tracks in doubt for a reason."""
        return sum(track.length_of(doubt) for track in self.tracks)

    @property
    def share(self) -> float:
        """Share of the length that is in doubt for any reason."""
        return sum(self.length_of(doubt) for doubt in DOUBTS) / self.length_m if self.tracks else 1.0

    def places(self) -> list[Place]:
        """Return all places to look at, in order of decreasing length in doubt."""
        found = [place for track in self.tracks for doubt in DOUBTS for place in track.places(doubt)]
        return sorted(found, key=lambda place: -place.length_m)


def examine(network: RailNetwork, gauges_m: Sequence[float]) -> Findings:
    """Find where the tracks of a network are in doubt.

    Parameters
    ----------
    network : RailNetwork
        With the geometry of its tracks, in any order.
    gauges_m : sequence of float
        Gauges that tracks may have.
    """
    geometry = {track.track_id: track for track in network.geometry}
    tracks = tuple(_examine_track(line, geometry[line.track_id], gauges_m) for line in network.centerlines)
    paired = {rail_id for line in network.centerlines for rail_id in (*line.left_ids, *line.right_ids)}
    lonely = [rail.length_m for rail in network.rails if rail.rail_id not in paired]
    return Findings(tracks, len(lonely), float(sum(lonely)))


def _examine_track(line: Centerline, geometry: TrackGeometry, gauges_m: Sequence[float]) -> TrackFindings:
    nominal_mm = min((1000 * gauge_m for gauge_m in gauges_m), key=lambda gauge: abs(gauge - line.gauge_mm))
    with np.errstate(invalid="ignore"):
        unsupported = geometry.bridged | np.isnan(geometry.gauge_mm)
        off = ~unsupported & (np.abs(geometry.gauge_mm - nominal_mm) > GAUGE_OFF_MM)
        unsure = ~unsupported & ~off & (geometry.sigma_mm > UNSURE_MM)
    return TrackFindings(line, geometry, nominal_mm, {UNSUPPORTED: unsupported, OFF_GAUGE: off, UNSURE: unsure})


def _places(geometry: TrackGeometry, doubt: Doubt, doubtful: np.ndarray, merge_m: float) -> Iterator[Place]:
    """Join stations in doubt into places."""
    numbers = np.flatnonzero(doubtful)
    if not len(numbers):
        return
    borders = cell_borders(geometry.chainage_m)
    starts, ends = borders[numbers], borders[numbers + 1]
    apart = np.flatnonzero(starts[1:] - ends[:-1] > merge_m) + 1
    for mine in np.split(np.arange(len(numbers)), apart):
        length_m = geometry.cells_m[numbers[mine]].sum()
        yield Place(geometry.track_id, doubt, float(starts[mine[0]]), float(ends[mine[-1]]), float(length_m))
