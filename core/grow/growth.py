"""The rails that grow from seeds, window by window, and the points on them; no rail that has grown is grown again.

The other rail of the track is followed together with the rail of the seed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Optional

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import Polyline, runs
from ..progress import SILENT, Progress
from .heads import MIN_POINTS, GrowSettings, OnHeads, Rail, SeenHead, heads_in
from .start import GAUGE_OFF_M, LEAST_RADIUS_M, Ahead, Start, find_start, lead, smoothed, window_m

LEAST_SHARE = 0.25
"""Least number of points of a head, as a share of those that it had before: it may be seen partly."""

HALF = 0.5
"""Least share in the last window of a rail."""

COURSE = 2.0
"""Length of rail behind a window that may show its course, in lengths over which a course is fitted: a curve is longer
than its chord."""

MEMORY = 8
"""Windows whose median gives the number of points that a head has."""

EQUAL_M = 0.010
"""Two heads whose distances from the expected course differ by less are equally likely."""

TWIST = 0.005
"""Change of cant per metre: that of steep transitions."""

CREST_RADIUS_M = 200.0
"""Least vertical radius."""

BESIDE_M = 0.30
"""Width beside the rail and its course that a window holds: a head that touches the rail, or is beside it."""

DECK_M = 1.0
"""Points further from the course in height are on another bridge."""

HIGH_M = 0.6
"""Height above the top up to which plants, ballast or a vehicle cover the rail."""

ON_HEAD = 0.5
"""Share of the width of a head within which a place is on the rail: the axis of another head is farther away."""

APART = 1.8
"""Distance of the seeds that are grown first, in longest runs: two runs from them meet, and share little but the bends
of the rail and the distances between its seeds."""


class Reason(Enum):
    """Why a rail is not followed further; completes "where …"."""

    LENGTH = "the longest run is reached"
    CLOUD = "the cloud ends"
    COVERED = "something covers the rail"
    FLUSH = "the rail does not stand out from what is beside it"
    HEAD = "no railhead is seen"
    CHOICE = "two rails continue it"


@dataclass(frozen=True)
class SeenWindow:
    """What was seen at a place: the head of the rail and that of the other rail, and the places on their axes, (3,)."""

    xyz: np.ndarray
    head: SeenHead | None
    other_xyz: np.ndarray
    other: SeenHead | None

    @property
    def is_seen(self) -> bool:
        """Whether one of the rails was seen."""
        return self.head is not None or self.other is not None


Pair = tuple[Optional[SeenHead], Optional[SeenHead]]
"""The rail, and the other rail of its track; None where it is not seen."""


@dataclass
class _Track:
    """What is known of the rails while they are followed."""

    per_m: list[float]
    other_per_m: list[float]
    off_m: list[float] = field(default_factory=list)
    level_m: float = 0.0
    unseen: int = 0
    other_unseen: int = 0


def follow(
    points: OnHeads, start: Start, behind: np.ndarray, settings: GrowSettings, progress: Progress = SILENT
) -> tuple[list[SeenWindow], Reason]:
    """Follow a rail in one direction, from a start that was `turned` to it, to the last window that shows a rail.

    `behind`, (n, 3), are places on the axis up to where it begins, in order.
    """
    walk = _Walk(points, start, settings)
    parameters = settings.parameters
    windows: list[SeenWindow] = []
    heading, places = start.heading, list(behind)
    reason = Reason.LENGTH
    shown = math.ceil(COURSE * start.beam.fit_m / parameters.window_m) + len(behind)
    for _ in progress.follow(range(int(parameters.max_length_m / parameters.window_m))):
        ahead = lead(np.array(places[-shown:]), parameters.window_m, heading, start.beam)
        window = walk.see(ahead)
        if window is None or walk.track.unseen > parameters.max_outliers:
            reason = walk.failure(ahead) if window else Reason.CHOICE
            break
        windows.append(window)
        places.append(window.xyz)
        heading = ahead.heading
    while windows and not walk.is_full(windows[-1]):
        windows.pop()
    return windows, reason


def turned(start: Start) -> Start:
    """Return a start in the opposite direction."""
    return replace(start, xyz=start.xyz[::-1], heading=-start.heading, side=-start.side)


class _Walk:
    """Looks at windows in turn, and remembers what the rails were like."""

    def __init__(self, points: OnHeads, start: Start, settings: GrowSettings) -> None:
        self._points, self._start, self._settings = points, start, settings
        self.track = _Track([start.per_m], [start.per_m], level_m=start.level_m)

    def see(self, ahead: Ahead) -> SeenWindow | None:
        """Look at a window; None where two rails continue the rail."""
        track = self.track
        off_m = self._start.side * self._settings.spacing_m + self._widening_m()
        beside = ahead.beside(off_m, track.level_m) if self._start.side else None
        others = self._heads(beside, track.other_per_m) if beside else []
        pairs: list[Pair] = [(head, self._other(others, head)) for head in self._candidates(ahead)]
        if min(map(self._strangeness, pairs), default=np.inf) > self._missing_m():
            alone = self._other(others, None)
            pairs += [(None, alone)] if alone else []
        pairs.sort(key=self._strangeness)
        if any(self._are_equal(pairs[0], pair) for pair in pairs[1:]):
            return None
        head, other = pairs[0] if pairs else (None, None)
        # Where only the other rail is seen, it shows how far both are from the course.
        shown = head or other
        xyz = other_xyz = _place(ahead, shown)
        if beside:
            other_xyz = _place(beside, other or shown)
        if head and other:
            track.off_m.append(off_m - self._start.side * self._settings.spacing_m + other.across_m - head.across_m)
            track.level_m += other.top_m - head.top_m
        self._remember(head, other)
        return SeenWindow(xyz, head, other_xyz, other)

    def failure(self, ahead: Ahead) -> Reason:
        """Say why no head is seen."""
        length_m = self._length_m(self.track.per_m)
        along, across, height = ahead.coordinates(self._points.all_around(ahead.xy, BESIDE_M + length_m / 2))
        over = np.abs(along) <= length_m / 2
        if not over.any():
            return Reason.CLOUD
        over &= np.abs(across) <= self._settings.head_width_m / 2
        level_m = self._settings.parameters.tolerance_z_m
        on = np.count_nonzero(over & (np.abs(height) <= level_m))
        if np.count_nonzero(over & (height > level_m) & (height < HIGH_M)) > on:
            return Reason.COVERED
        return Reason.FLUSH if on >= self._least(self.track.per_m) else Reason.HEAD

    def is_full(self, window: SeenWindow) -> bool:
        """Return whether a rail was seen over half of a window or more: at the end of a cloud it may be less."""
        pairs = ((window.head, self.track.per_m), (window.other, self.track.other_per_m))
        return any(head is not None and head.count >= self._least(usual, HALF) for head, usual in pairs)

    def _widening_m(self) -> float:
        """Return how far the other rail was to the left of its nominal place."""
        return float(np.median(self.track.off_m[-MEMORY:])) if self.track.off_m else 0.0

    def _remember(self, head: SeenHead | None, other: SeenHead | None) -> None:
        """Take note of what was seen."""
        track = self.track
        for one, per_m in ((head, track.per_m), (other, track.other_per_m)):
            if one is not None:
                per_m.append(one.count / self._length_m(per_m))
        track.unseen = 0 if head or other else track.unseen + 1
        track.other_unseen = 0 if other else track.other_unseen + 1

    def _length_m(self, per_m: list[float]) -> float:
        """Return the length of a window."""
        return window_m(float(np.median(per_m[-MEMORY:])), self._settings)

    def _heads(self, ahead: Ahead, per_m: list[float]) -> list[SeenHead]:
        """List the heads near a place."""
        length_m, reach_m = self._length_m(per_m), self._settings.parameters.search_m + BESIDE_M
        along, across, height = ahead.coordinates(self._points.around(ahead.xy, np.hypot(reach_m, length_m / 2)))
        own = (np.abs(along) <= length_m / 2) & (np.abs(across) <= reach_m) & (np.abs(height) <= DECK_M)
        return heads_in(across[own], height[own], self._settings, self._start.beam, self._least(per_m))

    def _gate_m(self) -> float:
        """Return how far a rail can be from its course: half a head, and what the least radius allows."""
        distance_m = (self.track.unseen + 1) * self._settings.parameters.window_m
        gate_m = self._settings.head_width_m / 2 + distance_m**2 / (2 * LEAST_RADIUS_M)
        return min(gate_m, self._settings.parameters.search_m)

    def _rise_m(self, unseen: int) -> float:
        """Return how far the top of a rail can be from its course in height."""
        distance_m = (unseen + 1) * self._settings.parameters.window_m
        tolerance_m = self._settings.parameters.tolerance_z_m + self._start.beam.level_m
        return tolerance_m + distance_m**2 / (2 * CREST_RADIUS_M)

    def _least(self, per_m: list[float], share: float = LEAST_SHARE) -> float:
        """Return the least number of points of a head."""
        return max(share * float(np.median(per_m[-MEMORY:])) * self._length_m(per_m), MIN_POINTS)

    def _candidates(self, ahead: Ahead) -> list[SeenHead]:
        """List the heads that may continue the rail."""
        gate_m, rise_m = self._gate_m(), self._rise_m(self.track.unseen)
        found = self._heads(ahead, self.track.per_m)
        return [one for one in found if abs(one.across_m) <= gate_m and abs(one.top_m) <= rise_m]

    def _are_equal(self, best: Pair, pair: Pair) -> bool:
        """Return whether two pairs are two rails, and not the sides of one, and equally likely."""
        one, other = best[0], pair[0]
        if one is None or other is None or not (one.alone and other.alone):
            return False
        return self._strangeness(pair) - self._strangeness(best) < EQUAL_M

    def _missing_m(self) -> float:
        """Return what a rail that is not seen counts as its distance from the course: half a head, and the accuracy."""
        return self._settings.head_width_m / 2 + self._start.beam.sigma_m

    def _strangeness(self, pair: Pair) -> float:
        """Return how far the rails are from their course and from their usual distance, metres."""
        head, other = pair
        if head and other:
            return abs(head.across_m) + abs(other.across_m - head.across_m)
        return sum(abs(one.across_m) for one in pair if one) + (self._missing_m() if self._start.side else 0.0)

    def _other(self, others: list[SeenHead], head: SeenHead | None) -> SeenHead | None:
        """Choose the other rail at the gauge from a head, or, without one, from the expected course."""
        track, side = self.track, self._start.side
        left_m, up_m = (head.across_m, head.top_m) if head else (0.0, 0.0)
        rise_m = self._rise_m(0) + TWIST * track.other_unseen * self._settings.parameters.window_m
        found = [
            one
            for one in others
            if abs(one.across_m - left_m) <= self._settings.head_width_m / 2
            and GAUGE_OFF_M[0] <= side * (self._widening_m() + one.across_m - left_m) <= GAUGE_OFF_M[1]
            and abs(one.top_m - up_m) <= rise_m
        ]
        return min(found, key=lambda one: abs(one.across_m - left_m), default=None)


def _place(ahead: Ahead, head: SeenHead | None) -> np.ndarray:
    """Return the place of a head, (3,), or that of the expected course."""
    left_m, up_m = (head.across_m, head.top_m) if head else (0.0, 0.0)
    return np.append(ahead.xy + left_m * ahead.left, ahead.z + up_m)


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


def _beyond(start: Start, onwards: Sequence[SeenWindow], settings: GrowSettings) -> np.ndarray:
    """Return the places in front of the way back, in its order."""
    count = int(start.beam.fit_m / settings.parameters.window_m)
    if len(onwards) >= count:
        return np.array([window.xyz for window in onwards[:count][::-1]])
    step = np.append(settings.parameters.window_m * start.heading, 0.0)
    return start.xyz[-1] + np.arange(count, 0, -1)[:, None] * step


def _rail(windows: Sequence[SeenWindow], is_other: bool, start: Start, settings: GrowSettings) -> Rail | None:
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
