"""What a reader of the report should know first: how much of the tracks is in doubt, why, and where."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..rails import Centerline, RailNetwork, TrackGeometry, cell_borders

GAUGE_OFF_MM = 10.0
"""Further from its gauge no plain track is left lying; curves below 200 m are widened by more, and worth a look."""

UNSURE_MM = 5.0
"""Larger standard errors of a centerline are not what a survey of tracks puts up with."""

MERGE_M = 5.0
"""Places closer together than this are one place to look at."""

FEW, MANY = 0.05, 0.25
"""Shares of the length in doubt up to which a result is good but for a few places, and from which it is poor."""


@dataclass(frozen=True)
class Doubt:
    """A reason to look at a place.

    Attributes
    ----------
    name : str
        Class of its marks in the pictures.
    label : str
        In words, for a list.
    """

    name: str
    label: str


UNSUPPORTED = Doubt("unsupported", "a rail has no points")
OFF_GAUGE = Doubt("offgauge", f"gauge off by more than {GAUGE_OFF_MM:g} mm")
UNSURE = Doubt("unsure", f"standard error above {UNSURE_MM:g} mm")
DOUBTS = (UNSUPPORTED, OFF_GAUGE, UNSURE)
"""The gravest first; a place is counted under one of them only."""


@dataclass(frozen=True)
class Place:
    """A stretch of a track to look at.

    Attributes
    ----------
    track_id : int
    doubt : Doubt
    start_m, end_m : float
        Chainages.
    length_m : float
        How much of the stretch is in doubt.
    """

    track_id: int
    doubt: Doubt
    start_m: float
    end_m: float
    length_m: float


@dataclass(frozen=True)
class TrackFindings:
    """One track, its gauge and what is in doubt on it.

    Attributes
    ----------
    line : Centerline
    geometry : TrackGeometry
    nominal_mm : float
        Of the gauges that were given, the nearest.
    doubtful : dict of Doubt to (n,) bool array
        Stations in doubt, each under one reason.
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
        """Length in doubt for a reason."""
        return float(self.geometry.cells_m[self.doubtful[doubt]].sum())

    def places(self, doubt: Doubt, merge_m: float = MERGE_M) -> list[Place]:
        """List where the track is in doubt for a reason; places no further apart than `merge_m` count as one."""
        return list(_places(self.geometry, doubt, self.doubtful[doubt], merge_m))


@dataclass(frozen=True)
class Findings:
    """All tracks, and the rails that belong to none."""

    tracks: tuple[TrackFindings, ...]
    lonely_rails: int
    lonely_m: float

    @property
    def length_m(self) -> float:
        """Plan length of all tracks."""
        return sum(track.length_m for track in self.tracks)

    def length_of(self, doubt: Doubt) -> float:
        """Length of all tracks in doubt for a reason."""
        return sum(track.length_of(doubt) for track in self.tracks)

    @property
    def share(self) -> float:
        """Part of the length in doubt for any reason."""
        return sum(self.length_of(doubt) for doubt in DOUBTS) / self.length_m if self.tracks else 1.0

    def places(self) -> list[Place]:
        """List all places to look at, those with most in doubt first."""
        found = [place for track in self.tracks for doubt in DOUBTS for place in track.places(doubt)]
        return sorted(found, key=lambda place: -place.length_m)


def examine(network: RailNetwork, gauges_m: Sequence[float]) -> Findings:
    """Find what is in doubt.

    Parameters
    ----------
    network : RailNetwork
        With its geometry.
    gauges_m : sequence of float
        Gauges that tracks may have.
    """
    tracks = tuple(_examine_track(*one, gauges_m) for one in zip(network.centerlines, network.geometry))
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
    """Join stations in doubt to places."""
    numbers = np.flatnonzero(doubtful)
    if not len(numbers):
        return
    borders = cell_borders(geometry.chainage_m)
    starts, ends = borders[numbers], borders[numbers + 1]
    apart = np.flatnonzero(starts[1:] - ends[:-1] > merge_m) + 1
    for mine in np.split(np.arange(len(numbers)), apart):
        length_m = geometry.cells_m[numbers[mine]].sum()
        yield Place(geometry.track_id, doubt, float(starts[mine[0]]), float(ends[mine[-1]]), float(length_m))
