"""What follows a track: platform edges and contact wires, traced from place to place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import distance_to, interpolate

REACH_M = 1.5
"""How far from its places a trace says where the thing is: half of the longest hole in a platform."""


@dataclass(frozen=True)
class Trace:
    """The edge of a platform or a contact wire along a track.

    `course` is the number of the track among the courses. Places have s, v and w, and the standard errors of v and w,
    (n,) metres each; at both ends, the thing reaches `end_m` beyond the last one.
    """

    course: int
    end_m: float
    s: np.ndarray
    v: np.ndarray
    w: np.ndarray
    sigma_m: np.ndarray
    sigmaz_m: np.ndarray

    @property
    def ends(self) -> tuple[float, float]:
        """Chainages of both ends."""
        return float(self.s[0]) - self.end_m, float(self.s[-1]) + self.end_m

    @property
    def length_m(self) -> float:
        """Length along the track."""
        return self.ends[1] - self.ends[0]

    @property
    def side(self) -> int:
        """Side of the track on which it begins: 1 on the left, -1 on the right."""
        return 1 if self.v[0] > 0 else -1


def traces_of(
    course: int, rows: np.ndarray, steps: Sequence[float], hole_m: float, shortest_m: float, end_m: float
) -> Iterator[Trace]:
    """Yield the traces that places make, (n, 5): they part where v or w changes by its step, or s by a hole."""
    breaks = (np.abs(np.diff(rows[:, 1:3], axis=0)) > steps).any(axis=1) | (np.diff(rows[:, 0]) > hole_m)
    for part in np.split(rows, np.flatnonzero(breaks) + 1) if len(rows) else ():
        one = Trace(course, end_m, *part.T)
        if one.length_m >= shortest_m:
            yield one


def known_at(at: np.ndarray, s: np.ndarray, vw: np.ndarray, reach_m: float = REACH_M) -> np.ndarray:
    """Interpolate v and w, (n, 2), at rising chainages s; returns (m, 2), NaN beyond reach of the nearest of these."""
    if not len(s):
        return np.full((len(at), 2), np.nan)
    return np.where((distance_to(s, at) <= reach_m)[:, None], interpolate(vw, s, at), np.nan)


def traced_at(traces: Sequence[Trace], course: int, s: np.ndarray, side: int = 0) -> np.ndarray:
    """Return v and w of what follows a track at chainages, (m, 2), on a side or on both; NaN where nothing does."""
    found = np.full((len(s), 2), np.nan)
    for one in traces:
        if one.course == course and side in (0, one.side):
            here = known_at(s, one.s, np.column_stack([one.v, one.w]))
            found = np.where(np.isfinite(here), here, found)
    return found
