"""The rails that grow from seeds, and the points on them; no rail that has grown is grown again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import Polyline, runs
from ..progress import SILENT, Progress
from .course import smoothed
from .follow import Reason, Window, follow, turned
from .heads import OnHeads, Rail
from .settings import GrowSettings
from .start import Start, find_start

ON_HEAD = 0.5
"""Share of the width of a head within which a place is on the rail: the axis of another head is farther away."""

APART = 1.8
"""Distance of the seeds that are grown first, in longest runs: two runs from them meet, and share little but the bends
of the rail and the distances between its seeds."""


@dataclass(frozen=True)
class Stop:
    """The place, `xyz` (3,), where a rail is not followed further."""

    xyz: np.ndarray
    reason: Reason


@dataclass(frozen=True)
class Growth:
    """What grew from a seed: its rail, the other one of its track if found and asked for, and both ends of its rail."""

    rails: tuple[Rail, ...]
    stops: tuple[Stop, ...]


def grow(points: OnHeads, seed: np.ndarray, settings: GrowSettings, progress: Progress = SILENT) -> Growth | None:
    """Follow the rail at a seed, (2,), to both sides; None if the seed is not on a rail.

    With one object of points for all seeds, no square is classified twice.
    """
    start = find_start(points, seed, settings)
    return None if start is None else grow_from(points, start, settings, progress)


def grow_from(points: OnHeads, start: Start, settings: GrowSettings, progress: Progress = SILENT) -> Growth | None:
    """Follow a rail that was found at a seed to both sides; see `grow`."""
    ahead, back = progress.split(2)
    onwards, last = follow(points, start, start.xyz, settings, ahead)
    # The way back begins beyond the seed, so that both rails are measured there.
    backwards, first = follow(points, turned(start), _beyond(start, onwards, settings), settings, back)
    windows = [*backwards[::-1], *onwards]
    if not windows:
        return None
    kinds = (False, True) if settings.parameters.both and start.side else (False,)
    rails = tuple(filter(None, (_rail(windows, is_other, start, settings) for is_other in kinds)))
    stops = Stop(windows[0].xyz, first), Stop(windows[-1].xyz, last)
    return Growth(rails, stops) if rails else None


def _beyond(start: Start, onwards: Sequence[Window], settings: GrowSettings) -> np.ndarray:
    """Return the places in front of the way back, in its order."""
    count = int(start.beam.fit_m / settings.parameters.window_m)
    if len(onwards) >= count:
        return np.array([window.xyz for window in onwards[:count][::-1]])
    step = np.append(settings.parameters.window_m * start.heading, 0.0)
    return start.xyz[-1] + np.arange(count, 0, -1)[:, None] * step


def _rail(windows: Sequence[Window], is_other: bool, start: Start, settings: GrowSettings) -> Rail | None:
    """Make one of the rails of a track, from the first window in which it was seen to the last."""
    heads = [window.other if is_other else window.head for window in windows]
    own = np.flatnonzero([head is not None for head in heads])
    if len(own) < 2:
        return None
    chosen = slice(int(own[0]), int(own[-1]) + 1)
    xyz = np.array([window.other_xyz if is_other else window.xyz for window in windows[chosen]])
    is_seen = np.array([head is not None for head in heads[chosen]])
    along_m = Polyline(xyz).t
    smooth = smoothed(xyz, along_m, start.beam.smooth_m, is_seen)
    return Rail(smooth, _bridged(is_seen, settings.parameters.max_outliers), start.beam)


def _bridged(seen: np.ndarray, most: int) -> np.ndarray:
    """Count runs of up to `most` windows in which a rail was not seen as seen."""
    result = seen.copy()
    for first, last in runs(~seen):
        result[first : last + 1] = last - first < most
    return result


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
    """What grows from seeds, one after the other."""

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
