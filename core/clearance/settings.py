"""What is measured: the profile, wider in curves by a rule, and how it is swept."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import maximum_filter1d

from ..clouds.mask import Mask
from .frame import Course
from .profiles import LIMIT, REFERENCE, SPACE, Profile

MARK, LEAVE_OUT = TRAINS = ("MARK", "LEAVE_OUT")
"""Choices of TRAINS: name vehicles on tracks, or omit them."""

BESIDE_M, LEAST_REACH_M = 1.6, 3.0
"""Points this far beyond the half width of the profile and its margin count, so that stations have distances; and the
least reach, up to which platforms are looked for."""

AROUND_M = 0.20
"""Points up to this distance outside of the profile count for the surface of an object, so that its mean is not cut off
at zero."""

STORED_M, STORED_UP_M, STORED_LOW_M, STORED_STEP_M = 4.5, 7.5, 0.08, 1.5
"""Points are stored up to this distance from the track, up to this height, and from this lowest height that counts on:
all named profiles find theirs there. Larger ones have more stored, in whole steps."""

EBO_DISTANCE_M = 4.0
"""Least distance of tracks on the open line (EBO section 10)."""

SAME_M = 1e-9
"""Heights closer than this are the same."""

RULES = NONE, EBO = ("NONE", "EBO")
"""Choices of WIDENING."""

REACH_M = 20.0
"""A vehicle's length: in transitions and beside them, the largest widening within it along the track counts."""

FREE_RADIUS_M = 250.0
"""Radius from which the formula of annex 2, 2.1 applies, and limits and structure gauges are not widened."""

OVERHANG_M2 = 3.75
"""Overhang of the vehicles on which the reference line rests, times the radius (annex 2, 2.1)."""

GAUGES_M = 1.435, 1.445, 1.470
"""Nominal gauge, and the least and largest gauge that the formula takes (annex 2, 2.1)."""

LIMIT_LESS_M = 0.033
"""Part of the widening of the reference line that the limit of the free space already holds (annex 2, 2.1 at 250 m)."""

TIGHT = {
    REFERENCE: (
        (100, 120, 150, 170, 180, 190, 200, 225, 250),
        (560, 365, 165, 130, 110, 95, 85, 55, 20),
        (600, 395, 195, 145, 130, 110, 95, 60, 33),
    ),
    SPACE: (
        (100, 120, 150, 180, 190, 200, 225, 250),
        (530, 335, 135, 80, 65, 50, 25, 0),
        (570, 365, 170, 100, 80, 65, 30, 0),
    ),
}
"""Radius in metres, and widening on the inside and on the outside in millimetres, of tight curves (annex 2, 2.1, and
annex 1 table 2). Between columns linearly."""


class Outline:
    """The boundary of a profile above the lowest height that counts.

    Edges that lie wholly below `floor_m`, and the closing edge at the foot, do not count: nothing rises from the bed
    through them.
    """

    def __init__(self, profile: Profile, floor_m: float) -> None:
        ring = np.array(profile.points)
        start, end = ring, np.roll(ring, -1, axis=0)
        is_below = np.maximum(start[:, 1], end[:, 1]) <= floor_m
        height = np.where(start[:, 0] * end[:, 0] <= 0, start[:, 1] + end[:, 1], np.inf) / 2
        is_foot = np.isfinite(height) & (height <= height.min() + SAME_M)
        kept = ~(is_below | is_foot)
        self.start, self.step = start[kept], (end - start)[kept]
        self.floor_m = max(floor_m, float(ring[:, 1].min()))
        self._mask = Mask.of([np.vstack([ring, ring[:1]])])
        self._middle = np.array([0.0, ring[:, 1].mean()])

    def distance(self, vw: np.ndarray) -> np.ndarray:
        """Return the distance of points, (n, 2), to the outline, (n,), positive inside."""
        away = self._to_edges(vw)[0]
        return np.where(self._mask.holds(vw), away, -away)

    def inward(self, vw: np.ndarray) -> np.ndarray:
        """Return the unit vector, (2,), that leads inwards, across the edge nearest to a point, (2,)."""
        along = self.step[self._to_edges(vw[None])[1][0]]
        found = np.array([along[1], -along[0]]) / np.hypot(*along)
        return found if found @ (self._middle - vw) > 0 else -found

    def _to_edges(self, vw: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distance of points, (n,), to the nearest edge, and its number."""
        best, number = np.full(len(vw), np.inf), np.zeros(len(vw), dtype=np.int64)
        for at, ((v, w), (along, up)) in enumerate(zip(self.start, self.step)):
            right, high = vw[:, 0] - v, vw[:, 1] - w
            share = np.clip((right * along + high * up) / (along**2 + up**2), 0.0, 1.0)
            away = (right - share * along) ** 2 + (high - share * up) ** 2
            closer = away < best
            best[closer], number[closer] = away[closer], at
        return np.sqrt(best), number


@dataclass(frozen=True)
class Space:
    """Which points along a track are stored: those within reach, between two heights, and of no class left out."""

    reach_m: float
    low_m: float
    high_m: float
    left_out: tuple[int, ...]


@dataclass(frozen=True)
class Settings:
    """What is measured.

    `widening` is one of `RULES`, `trains` of `TRAINS`. `distance_m` is the least distance of tracks, None for
    that of the profile's rules. Classes `left_out` count nowhere.
    """

    profile: Profile
    margin_m: float = 0.0
    floor_m: float = 0.08
    step_m: float = 1.0
    widening: str = "NONE"
    distance_m: float | None = None
    left_out: tuple[int, ...] = ()
    trains: str = MARK

    @property
    def least_distance_m(self) -> float:
        """Least distance of tracks; NaN where nothing is judged."""
        if self.distance_m is not None:
            return self.distance_m
        return EBO_DISTANCE_M if self.profile.is_of_ebo else np.nan

    @property
    def reach_m(self) -> float:
        """How far aside of the track points count."""
        return max(self.profile.half_width_m + self.margin_m + BESIDE_M, LEAST_REACH_M)

    @property
    def space(self) -> Space:
        """Which points are stored: those that count, and those of other profiles of this size."""
        top_m = self.profile.height_m + self.margin_m + AROUND_M
        reach_m, high_m = (STORED_STEP_M * float(np.ceil(one / STORED_STEP_M)) for one in (self.reach_m, top_m))
        low_m = min(self.floor_m, STORED_LOW_M)
        return Space(max(reach_m, STORED_M), low_m, max(high_m, STORED_UP_M), self.left_out)

    @cached_property
    def outline(self) -> Outline:
        """The boundary of the profile."""
        return Outline(self.profile, self.floor_m)

    def depth(self, course: Course, place: np.ndarray) -> np.ndarray:
        """Return the penetration of places, (n, 3) in the frame of a track, with its widening and the margin."""
        s, v, w = place.T
        left, right = course.at(s, course.wide_m).T
        narrowed = np.sign(v) * np.maximum(np.abs(v) - np.where(v > 0, left, right), 0.0)
        depth = self.outline.distance(np.column_stack([narrowed, w])) + self.margin_m
        return np.where(w >= self.outline.floor_m, depth, -np.inf)


def widening(curvature: np.ndarray, gauge_m: float | np.ndarray, rule: str, step_m: float) -> np.ndarray:
    """Return the widening on the left and on the right at stations of equal distance, (n, 2) metres.

    `curvature`, (n,), is positive in left-hand curves; the rule is that of the profile, see `profiles.REFERENCE`.
    """
    radius_m = 1.0 / np.maximum(np.abs(curvature), 1e-9)
    at, *sides = TIGHT[SPACE if rule == SPACE else REFERENCE]
    tight = np.array([np.interp(radius_m, at, values) for values in sides]) / 1000
    if rule == LIMIT:
        tight = np.maximum(tight - LIMIT_LESS_M, 0.0)
    nominal, least, most = GAUGES_M
    loose = (np.clip(np.nan_to_num(gauge_m, nan=least), least, most) - nominal) / 2
    wide = OVERHANG_M2 / radius_m + loose if rule == REFERENCE else 0.0
    inside, outside = np.where(radius_m >= FREE_RADIUS_M, wide, tight)
    is_left = curvature > 0
    both = np.column_stack([np.where(is_left, inside, outside), np.where(is_left, outside, inside)])
    return maximum_filter1d(both, 2 * int(round(REACH_M / step_m)) + 1, axis=0, mode="nearest")
