"""A rail followed window by window from its seed, together with the other rail of its track."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Optional

import numpy as np

from ..progress import SILENT, Progress
from .course import LEAST_RADIUS_M, Ahead, lead
from .heads import MIN_POINTS, Head, OnHeads, heads_in
from .settings import GrowSettings
from .start import GAUGE_OFF_M, Start, window_m

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


class Reason(Enum):
    """Why a rail is not followed further; completes "where …"."""

    LENGTH = "the longest run is reached"
    CLOUD = "the cloud ends"
    COVERED = "something covers the rail"
    FLUSH = "the rail does not stand out from what is beside it"
    HEAD = "no railhead is seen"
    CHOICE = "two rails continue it"


@dataclass(frozen=True)
class Window:
    """What was seen at a place: the head of the rail and that of the other rail, and the places on their axes, (3,)."""

    xyz: np.ndarray
    head: Head | None
    other_xyz: np.ndarray
    other: Head | None

    @property
    def is_seen(self) -> bool:
        """Whether one of the rails was seen."""
        return self.head is not None or self.other is not None


Pair = tuple[Optional[Head], Optional[Head]]
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
) -> tuple[list[Window], Reason]:
    """Follow a rail in one direction, from a start that was `turned` to it, to the last window that shows a rail.

    `behind`, (n, 3), are places on the axis up to where it begins, in order.
    """
    walk = _Walk(points, start, settings)
    parameters = settings.parameters
    windows: list[Window] = []
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

    def see(self, ahead: Ahead) -> Window | None:
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
        return Window(xyz, head, other_xyz, other)

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

    def is_full(self, window: Window) -> bool:
        """Return whether a rail was seen over half of a window or more: at the end of a cloud it may be less."""
        pairs = ((window.head, self.track.per_m), (window.other, self.track.other_per_m))
        return any(head is not None and head.count >= self._least(usual, HALF) for head, usual in pairs)

    def _widening_m(self) -> float:
        """Return how far the other rail was to the left of its nominal place."""
        return float(np.median(self.track.off_m[-MEMORY:])) if self.track.off_m else 0.0

    def _remember(self, head: Head | None, other: Head | None) -> None:
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

    def _heads(self, ahead: Ahead, per_m: list[float]) -> list[Head]:
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

    def _candidates(self, ahead: Ahead) -> list[Head]:
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

    def _other(self, others: list[Head], head: Head | None) -> Head | None:
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


def _place(ahead: Ahead, head: Head | None) -> np.ndarray:
    """Return the place of a head, (3,), or that of the expected course."""
    left_m, up_m = (head.across_m, head.top_m) if head else (0.0, 0.0)
    return np.append(ahead.xy + left_m * ahead.left, ahead.z + up_m)
