"""A rail followed window by window from its seed, together with the other rail of its track."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Optional

import numpy as np

from ..progress import SILENT, Progress
from .course import LEAST_RADIUS_M, Ahead, lead
from .on_heads import cut
from .points import Points
from .profile import BED_M, HIGH_M, MIN_POINTS, Head, Section
from .settings import GrowSettings
from .start import GAUGE_OFF_M, Start, window_m

LEAST_SHARE = 0.25
"""Least number of points of a head, as a share of those that it had before: it may be seen partly."""

HALF = 0.5
"""Least share in the last window of a rail."""

MEMORY = 8
"""Windows whose median gives the number of points that a head has."""

EQUAL_M = 0.010
"""Two heads whose distances from the expected course differ by less are equally likely."""

TWIST = 0.005
"""Change of cant per metre: that of steep transitions."""

CREST_RADIUS_M = 200.0
"""Least vertical radius."""


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
    """What was seen at a place.

    Attributes
    ----------
    xyz : (3,) array
        On the axis of the rail.
    head : Head or None
        The rail; None where it was not seen.
    other_xyz : (3,) array
        On the axis of the other rail.
    other : Head or None
    """

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
    points: Points, start: Start, behind: np.ndarray, settings: GrowSettings, progress: Progress = SILENT
) -> tuple[list[Window], Reason]:
    """Follow a rail in one direction.

    Parameters
    ----------
    points : Points
    start : Start
        In this direction; see `turned`.
    behind : (n, 3) array
        Places on the axis up to where it begins, in order.
    settings : GrowSettings
    progress : Progress

    Returns
    -------
    list of Window
        In order, up to the last one in which a rail was seen.
    Reason
    """
    walk = _Walk(points, start, settings)
    parameters = settings.parameters
    windows: list[Window] = []
    heading, places = start.heading, list(behind)
    reason = Reason.LENGTH
    for _ in progress.follow(range(int(parameters.max_length_m / parameters.window_m))):
        ahead = lead(np.array(places), parameters.window_m, heading, start.beam)
        window, failure = walk.see(ahead)
        if failure is Reason.CHOICE or (failure and walk.track.unseen > parameters.max_outliers):
            reason = failure
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

    def __init__(self, points: Points, start: Start, settings: GrowSettings) -> None:
        self._points, self._start, self._settings = points, start, settings
        self.track = _Track([start.per_m], [start.per_m], level_m=start.level_m)

    def see(self, ahead: Ahead) -> tuple[Window, Reason | None]:
        """Look at a window."""
        track = self.track
        off_m = self._off_m()
        beside = ahead.beside(off_m, track.level_m) if self._start.side else None
        other_section = self._section(self._start.points, beside, track.other_per_m) if beside else None
        section = self._section(self._start.points, ahead, track.per_m)
        pairs: list[Pair] = [(head, self._other(other_section, head)) for head in self._candidates(section)]
        if min(map(self._strangeness, pairs), default=np.inf) > self._missing_m():
            alone = self._other(other_section, None)
            pairs += [(None, alone)] if alone else []
        head, other, failure = self._choose(pairs, ahead)
        # Where only the other rail is seen, it shows how far both are from the course.
        shown = head or other
        left_m, up_m = (shown.across_m, shown.top_m) if shown else (0.0, 0.0)
        xyz = other_xyz = _place(ahead, left_m, up_m)
        if beside:
            seen = other or shown
            other_xyz = _place(beside, seen.across_m, seen.top_m) if seen else _place(beside, 0.0, 0.0)
        if head and other:
            track.off_m.append(off_m - self._start.side * self._settings.spacing_m + other.across_m - head.across_m)
            track.level_m += other.top_m - head.top_m
        self._remember(head, other)
        return Window(xyz, head, other_xyz, other), None if head or other else failure

    def _off_m(self) -> float:
        """Return how far to the left the other rail is expected."""
        return self._start.side * self._settings.spacing_m + self._widening_m()

    def _widening_m(self) -> float:
        """Return how far the other rail was to the left of its nominal place."""
        return float(np.median(self.track.off_m[-MEMORY:])) if self.track.off_m else 0.0

    def is_full(self, window: Window) -> bool:
        """Return whether a rail was seen over half of a window or more: at the end of a cloud it may be less."""
        pairs = ((window.head, self.track.per_m), (window.other, self.track.other_per_m))
        return any(head is not None and head.count >= self._least(usual, HALF) for head, usual in pairs)

    def _remember(self, head: Head | None, other: Head | None) -> None:
        """Take note of what was seen."""
        track = self.track
        if head is not None:
            track.per_m.append(head.count / window_m(np.median(track.per_m[-MEMORY:]), self._settings))
        if other is not None:
            track.other_per_m.append(other.count / window_m(np.median(track.other_per_m[-MEMORY:]), self._settings))
        track.unseen = 0 if head or other else track.unseen + 1
        track.other_unseen = 0 if other else track.other_unseen + 1

    def _section(self, points: Points, ahead: Ahead, per_m: list[float]) -> Section:
        """Cut the points at a place."""
        length_m = window_m(float(np.median(per_m[-MEMORY:])), self._settings)
        reach_m = self._settings.parameters.search_m + self._settings.head_width_m / 2 + BED_M
        along, across, height = ahead.coordinates(points.around(ahead.xy, np.hypot(reach_m, length_m / 2)))
        own = (np.abs(along) <= length_m / 2) & (np.abs(across) <= reach_m)
        return cut(across[own], height[own], self._settings, self._start.beam)

    def _gate_m(self, unseen: int) -> float:
        """Return how far a rail can be from its course: half a head, and what the least radius allows."""
        distance_m = (unseen + 1) * self._settings.parameters.window_m
        gate_m = self._settings.head_width_m / 2 + distance_m**2 / (2 * LEAST_RADIUS_M)
        return min(gate_m, self._settings.parameters.search_m)

    def _rise_m(self, unseen: int) -> float:
        """Return how far the top of a rail can be from its course in height."""
        distance_m = (unseen + 1) * self._settings.parameters.window_m
        tolerance_m = self._settings.parameters.tolerance_z_m + self._start.beam.level_m
        return tolerance_m + distance_m**2 / (2 * CREST_RADIUS_M)

    def _least(self, per_m: list[float], share: float = LEAST_SHARE) -> float:
        """Return the least number of points of a head."""
        usual = float(np.median(per_m[-MEMORY:]))
        return max(share * usual * window_m(usual, self._settings), MIN_POINTS)

    def _candidates(self, section: Section) -> list[Head]:
        """List the heads that may continue the rail."""
        gate_m, rise_m = self._gate_m(self.track.unseen), self._rise_m(self.track.unseen)
        found = section.heads(gate_m, 0.0, self._least(self.track.per_m))
        return [one for one in found if abs(one.across_m) <= gate_m and abs(one.top_m) <= rise_m]

    def _choose(self, pairs: list[Pair], ahead: Ahead) -> tuple[Head | None, Head | None, Reason | None]:
        """Choose the head that continues the rail, with the other rail, or say why there is none.

        Of several heads, the one near the course is taken that has the other rail at the gauge.
        """
        if not pairs:
            return None, None, self._failure(ahead)
        pairs = sorted(pairs, key=self._strangeness)
        best, rivals = pairs[0], pairs[1:]
        for pair in rivals:
            if self._strangeness(pair) - self._strangeness(best) < EQUAL_M and self._are_apart(best[0], pair[0]):
                return None, None, Reason.CHOICE
        return (*best, None)

    def _are_apart(self, one: Head | None, other: Head | None) -> bool:
        """Return whether two heads are two rails, and not the edges of one."""
        if one is None or other is None or not (one.is_free and other.is_free):
            return False
        return abs(one.across_m - other.across_m) >= self._settings.head_width_m

    def _missing_m(self) -> float:
        """Return what a rail that is not seen counts as its distance from the course: half a head, and the accuracy."""
        return self._settings.head_width_m / 2 + self._start.beam.sigma_m

    def _strangeness(self, pair: Pair) -> float:
        """Return how far the rails are from their course and from their usual distance, metres."""
        head, other = pair
        if head and other:
            return abs(head.across_m) + abs(other.across_m - head.across_m)
        return sum(abs(one.across_m) for one in pair if one) + (self._missing_m() if self._start.side else 0.0)

    def _other(self, section: Section | None, head: Head | None) -> Head | None:
        """Find the other rail at the gauge from a head, or, without one, from the expected course."""
        if section is None:
            return None
        track, side = self.track, self._start.side
        left_m, up_m = (head.across_m, head.top_m) if head else (0.0, 0.0)
        rise_m = self._rise_m(0) + TWIST * track.other_unseen * self._settings.parameters.window_m
        half_m = self._settings.head_width_m / 2
        found = [
            one
            for one in section.heads(half_m, up_m, self._least(track.other_per_m), left_m)
            if GAUGE_OFF_M[0] <= side * (self._widening_m() + one.across_m - left_m) <= GAUGE_OFF_M[1]
            and abs(one.top_m - up_m) <= rise_m
        ]
        return min(found, key=lambda one: abs(one.across_m - left_m), default=None)

    def _failure(self, ahead: Ahead) -> Reason:
        """Say why no head is seen."""
        section = self._section(self._points, ahead, self.track.per_m)
        if section.is_empty():
            return Reason.CLOUD
        half_m = self._settings.head_width_m / 2
        over = np.abs(section.across_m) <= half_m
        level_m = self._settings.parameters.tolerance_z_m + self._start.beam.level_m
        on = np.count_nonzero(over & (np.abs(section.height_m) <= level_m))
        high = np.count_nonzero(over & (section.height_m > level_m) & (section.height_m < HIGH_M[1]))
        if high > on:
            return Reason.COVERED
        return Reason.FLUSH if on >= self._least(self.track.per_m) else Reason.HEAD


def _place(ahead: Ahead, left_m: float, up_m: float) -> np.ndarray:
    return np.append(ahead.xy + left_m * ahead.left, ahead.z + up_m)
