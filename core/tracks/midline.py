"""The provisional centerline of a track, the rails met on its normals, and the middle between them.

The provisional centerline is parallel to the rails, through the sections of the track and from one to the next. See
docs/method.md section 8.6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import Chords
from ..rails import RailLine

SEARCH_STEP_M = 0.1
"""Length of the segments in which rails are searched; in a tram curve of 25 m they deviate by 0.05 mm."""

MAX_OFFSET_M = 0.2
"""Distance from the expected place within which a rail is searched: the provisional centerline is straight across gaps
of 5 m in curves."""


@dataclass(frozen=True)
class Meeting:
    """Intersections of normals with the rails of one side, (n,) arrays.

    `distance_m` and `height_m` are those of the rail, NaN where there is none near the expected distance; `rail` is its
    number, `t` the plan chainage along it, and `paired` holds where it is paired.
    """

    distance_m: np.ndarray
    height_m: np.ndarray
    rail: np.ndarray
    t: np.ndarray
    paired: np.ndarray

    def without(self, which: np.ndarray) -> Meeting:
        """Remove the rails met at the stations marked in `which`, (n,) bool."""
        values = [np.where(which, np.nan, column) for column in (self.distance_m, self.height_m, self.t)]
        return Meeting(values[0], values[1], self.rail, values[2], self.paired)


@dataclass(frozen=True)
class Side:
    """The rails on one side of a track, in sections.

    The `chords` are the sections, each from its margin before to its margin behind; `rail`, (k,), is the number of the
    rail of each section, and `paired`, (n,), holds where a place of the chords is in the section itself.
    """

    chords: Chords
    rail: np.ndarray
    paired: np.ndarray

    @classmethod
    def of(cls, rails: Sequence[RailLine], spans: Sequence[tuple[int, tuple[float, float]]], margin_m: float) -> Side:
        """Cut sections out of their rails; each is the number of a rail and the chainages of its start and end.

        `margin_m` is added at both ends, for a rail that continues while the other one has a gap.
        """
        ends = [(min(span), max(span)) for _, span in spans]
        parts = [
            rails[number].line.resampled(SEARCH_STEP_M, start - margin_m, end + margin_m)
            for (number, _), (start, end) in zip(spans, ends)
        ]
        paired = [(part.t >= start) & (part.t <= end) for part, (start, end) in zip(parts, ends)]
        return cls(Chords.joined(parts), np.array([number for number, _ in spans]), np.concatenate(paired))

    def meet(
        self, stations: np.ndarray, directions: np.ndarray, expected_m: float, max_offset_m: float = MAX_OFFSET_M
    ) -> Meeting:
        """Find the rails in given directions, (n, 2) unit vectors, from stations, (n, 2); see `Chords.meet`."""
        place, xyz, t = self.chords.meet(stations, directions, expected_m, max_offset_m)
        distance = np.einsum("ij,ij->i", xyz[:, :2] - stations, directions)
        return Meeting(distance, xyz[:, 2], self.rail[self.chords.line[place]], t, self.paired[place])


def at_gauge(left: Meeting, right: Meeting, spacing_m: float, tolerance_m: float) -> tuple[Meeting, Meeting]:
    """Remove rails outside their sections where they do not keep the distance to the other rail within the tolerance.

    A stock rail that continues into the branch, for example, soon leaves the through track.
    """
    astray = np.abs(left.distance_m + right.distance_m - spacing_m) > tolerance_m
    return left.without(astray & ~left.paired), right.without(astray & ~right.paired)


def midway(stations: np.ndarray, normals: np.ndarray, left: Meeting, right: Meeting) -> np.ndarray:
    """Find the middle, (k, 3), between both rails at stations, (n, 2), with unit vectors to the left.

    Where one rail is missing, the middle is half the median spacing from the other; stations without any rail are left
    out. At least one station meets both rails.
    """
    to_left, to_right = left.distance_m, right.distance_m
    both = to_left + to_right
    usual = np.nanmedian(both)
    shift = np.where(np.isnan(both), np.where(np.isnan(to_left), usual / 2 - to_right, to_left - usual / 2), 0.0)
    shift = np.where(np.isnan(both), shift, (to_left - to_right) / 2)
    known = ~np.isnan(shift)
    return np.column_stack([stations + shift[:, None] * normals, _heights(left.height_m, right.height_m)])[known]


def _heights(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Find the height midway between both rails, (n,); where one is missing, from the other and the cant around."""
    half_cant = np.nan_to_num(_filled(left - right)) / 2
    return _filled(np.where(np.isnan(left), right + half_cant, left - half_cant))


def bridged_steps(rails: Sequence[RailLine], left: Meeting, right: Meeting, along: np.ndarray) -> np.ndarray:
    """Measure the length, (n - 1,) metres, between successive stations on which a rail is missing or has no points."""
    steps = np.diff(along)
    return np.maximum(_bridged_on(rails, left, steps), _bridged_on(rails, right, steps))


def _bridged_on(rails: Sequence[RailLine], side: Meeting, steps: np.ndarray) -> np.ndarray:
    """Return the same for one side only, given the distances between stations, (n - 1,)."""
    before = np.full(len(side.t), np.nan)
    for number in np.unique(side.rail):
        mine = side.rail == number
        before[mine] = rails[number].bridged_before(side.t[mine])
    on_one = np.diff(side.rail) == 0
    bridged = np.where(on_one, np.minimum(np.abs(np.diff(before)), steps), 0.0)
    unmet = np.isnan(before)
    return np.where(unmet[1:] | unmet[:-1], 0.5 * steps * (unmet[1:] + unmet[:-1].astype(int)), bridged)


def _filled(values: np.ndarray) -> np.ndarray:
    """Interpolate missing values from their neighbours; if all are NaN, they stay NaN."""
    known = np.flatnonzero(~np.isnan(values))
    return np.interp(np.arange(len(values)), known, values[known]) if len(known) else values
