"""Rails grown from many seeds: a rail that has grown is not grown again from the other seeds on it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import Polyline
from ..progress import SILENT, Progress
from .follow import Reason
from .growth import Growth, Stop, grow_from
from .heads import OnHeads
from .settings import GrowSettings
from .start import Start, find_start

ON_HEAD = 0.5
"""Share of the width of a head within which a place is on the rail: the axis of another head is farther away."""


APART = 1.8
"""Distance of the seeds that are grown first, in longest runs: two runs from them meet, and share little but the bends
of the rail and the distances between its seeds."""


def apart_first(places: np.ndarray, apart_m: float) -> np.ndarray:
    """Return an order of places, (n, 2), that begins with some that are more than `apart_m` apart, (n,) int.

    All others are within `apart_m` of one of these.
    """
    tree, left, chosen = cKDTree(places), np.ones(len(places), dtype=bool), []
    while left.any():
        chosen.append(int(np.argmax(left)))
        left[tree.query_ball_point(places[chosen[-1]], apart_m)] = False
    return np.append(chosen, np.delete(np.arange(len(places)), chosen)).astype(int)


class Growths:
    """What grows from seeds, one after the other.

    Parameters
    ----------
    points : OnHeads
    settings : GrowSettings

    Attributes
    ----------
    grown : list of Growth
    """

    def __init__(self, points: OnHeads, settings: GrowSettings) -> None:
        self._points, self._settings = points, settings
        self._on_m = ON_HEAD * settings.head_width_m
        self._rails: list[tuple[int, Polyline]] = []
        self._boxes = np.empty((0, 2, 2))
        self._known: dict[tuple[float, ...], bool] = {}
        self._passed: list[np.ndarray] = []
        self.grown: list[Growth] = []

    def add(self, place: np.ndarray, progress: Progress = SILENT) -> bool:
        """Grow from a place, (2,), unless it is on a rail that has grown; returns whether it is on a rail."""
        progress.check()
        key = tuple(place.tolist())
        if key not in self._known:
            self._known[key] = self._has_grown(place) or self._grows(place, progress)
        return self._known[key]

    def reach_on(self, progress: Progress = SILENT) -> None:
        """Grow from a seed on a rail that has grown if it reaches beyond the end of the longest run."""
        reach_m = self._settings.parameters.max_length_m - self._settings.parameters.window_m
        passed = np.array(self._passed).reshape(-1, 2)
        for number, stop in self._ends():
            away_m = np.hypot(*(passed - stop.xyz[:2]).T)
            nearer = np.argsort(away_m)[: np.count_nonzero(away_m < reach_m)] if self._is_open(number, stop) else ()
            seed = next((passed[at] for at in nearer if number in self._at(passed[at])), None)
            start = None if seed is None else find_start(self._points, seed, self._settings)
            if start is not None:
                self._grow(start, progress)

    def stops(self) -> list[Stop]:
        """Return where rails end, without the ends of longest runs beyond which another growth goes on."""
        return [
            stop for number, stop in self._ends() if stop.reason is not Reason.LENGTH or self._is_open(number, stop)
        ]

    def _grows(self, place: np.ndarray, progress: Progress) -> bool:
        """Look for a rail at a place, and grow it unless it has grown; returns whether there is one."""
        start = find_start(self._points, place, self._settings)
        return start is not None and (self._has_grown(start.middle) or self._grow(start, progress))

    def _has_grown(self, place: np.ndarray) -> bool:
        """Return whether a rail at a place has grown, and remember the place."""
        has_grown = bool(self._at(place))
        if has_grown:
            self._passed.append(place)
        return has_grown

    def _grow(self, start: Start, progress: Progress) -> bool:
        """Grow from a start; returns whether there is a rail."""
        growth = grow_from(self._points, start, self._settings, progress)
        if growth is None:
            return False
        axes = [rail.xyz[:, :2] for rail in growth.rails]
        self._rails += [(len(self.grown), Polyline(axis)) for axis in axes]
        self._boxes = np.concatenate([self._boxes, [[axis.min(axis=0), axis.max(axis=0)] for axis in axes]])
        self.grown.append(growth)
        return True

    def _ends(self) -> list[tuple[int, Stop]]:
        """Return the ends of all growths, with the number of each growth."""
        return [(number, stop) for number, growth in enumerate(self.grown) for stop in growth.stops]

    def _is_open(self, number: int, stop: Stop) -> bool:
        """Return whether the longest run of a growth is over at a place where no other growth goes on."""
        return stop.reason is Reason.LENGTH and not self._at(stop.xyz[:2]) - {number}

    def _at(self, place: np.ndarray) -> set[int]:
        """Return the numbers of the growths that have a rail at a place, (2,)."""
        near = ((self._boxes[:, 0] <= place + self._on_m) & (self._boxes[:, 1] >= place - self._on_m)).all(axis=1)
        found = (self._rails[at] for at in np.flatnonzero(near))
        return {number for number, axis in found if len(axis.feet(place[None], self._on_m).point)}
