"""Stations of an alignment as design files state them: metres that continue along the curve, with equations at jumps.

Kilometres come from an axis, on which numbers may be missing or twice, and on which a parallel track is longer or
shorter. A design file knows the distance along the track's own curve, and states where stations do not continue it.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from functools import cached_property
from typing import Optional

import numpy as np

from .elements import Alignment

MIN_JUMP_M = 0.05
"""Smallest jump of the stations that becomes an equation, metres: a track beside its axis gains or loses millimetres
from element to element."""

SAME_PLACE_M = 1e-4
"""Places along the curve that differ by less are the same, metres: files have four decimals or more."""


@dataclass(frozen=True)
class StationRange:
    """A part of the curve on which stations continue: it starts at `s` along the curve with `station`, both metres.

    `rises` says whether stations rise along the curve.
    """

    s: float
    station: float
    rises: bool = True

    def at(self, s: float) -> float:
        """Return the station of a place, metres."""
        return self.station + (s - self.s if self.rises else self.s - s)


@dataclass(frozen=True)
class Stations:
    """The stations along a curve: at least one piece, in order of `s`.

    Examples
    --------
    >>> stations = Stations((StationRange(0.0, 1000.0), StationRange(50.0, 1200.0)))
    >>> stations.ahead(50.0), stations.behind(50.0)
    (1200.0, 1050.0)
    """

    pieces: tuple[StationRange, ...]

    def ahead(self, s: float) -> float:
        """Return the station of a place, metres; at a jump, that ahead."""
        return self.pieces[max(bisect_right(self._starts, s + SAME_PLACE_M) - 1, 0)].at(s)

    def behind(self, s: float) -> float:
        """Return the station of a place, metres; at a jump, that behind."""
        return self.pieces[max(bisect_left(self._starts, s - SAME_PLACE_M) - 1, 0)].at(s)

    @cached_property
    def _starts(self) -> list[float]:
        return [one.s for one in self.pieces]


def stations_of(alignment: Alignment) -> Optional[Stations]:
    """Return the stations that the kilometres of the plan elements make; None if no element states both of its own.

    `km_from` and `km_to` may be those of the two ends in order along the track, or the smaller and the larger one.
    """
    known = [
        (one.s_from, one.figures.km_from, one.figures.km_to)
        for one in alignment.plan
        if one.figures.km_from is not None and one.figures.km_to is not None
    ]
    if not known:
        return None
    (_, *first), (_, *last) = known[0], known[-1]
    rises = sum(last) >= sum(first) if len(known) > 1 else last[1] >= last[0]
    pieces: list[StationRange] = []
    for s, *ends in known:
        piece = StationRange(s, 1000.0 * (min(ends) if rises else max(ends)), rises)
        if not pieces or abs(pieces[-1].at(piece.s) - piece.station) >= MIN_JUMP_M:
            pieces.append(piece)
    start = StationRange(alignment.s_from, pieces[0].at(alignment.s_from), rises)
    return Stations((start, *pieces[1:]))


def measured(alignment: Alignment) -> np.ndarray:
    """Return the vertices of the whole curve with the kilometre of each, (n, 4), local metres and kilometres.

    A jump of the kilometres has two vertices at the same place. Kilometres are NaN if they are unknown.
    """
    s = alignment.stations(alignment.s_from, alignment.s_to)
    stations = stations_of(alignment)
    if stations is None:
        return np.column_stack([alignment.xyz(s), np.full(len(s), np.nan)])
    jumps = np.array([piece.s for piece in stations.pieces[1:]])
    s = np.sort(np.concatenate([s[~np.isin(s, jumps)], jumps, jumps]))
    repeated = np.append(False, np.diff(s) == 0)
    known = [stations.ahead(place) if again else stations.behind(place) for place, again in zip(s, repeated)]
    return np.column_stack([alignment.xyz(s), np.array(known) / 1000.0])
