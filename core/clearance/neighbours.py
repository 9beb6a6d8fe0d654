"""How far tracks are apart, and where two that join foul each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import Polyline, runs
from .frame import SPACING_M, STEP_M, Course
from .settings import Settings

REACH_M = 8.0
"""Between tracks further apart there is room for another one."""

PARALLEL_DEG = 20.0
"""Largest angle between neighbour tracks: others cross."""

JOINED_M, APART_M = 2.5, 3.5
"""Tracks nearer than the first join in a switch; nothing is judged from there to where the second is reached."""

ERROR_M = 0.002
"""Error of a distance between two measured lines: tracks that are built at the least distance are not too near."""

TIGHT_M = (100, 120, 150, 170, 180, 200, 225, 250), (1.100, 0.700, 0.305, 0.215, 0.180, 0.120, 0.055, 0.0)
"""Radius, and what the least distance grows by there, metres (EBO annex 4)."""

CANT_LEVER = 3.53 / SPACING_M
"""Height of the widest place of a vehicle by the spacing of the rails: what the distance grows by, per metre by which
the outer track has more cant (EBO annex 4)."""


@dataclass(frozen=True)
class Side:
    """The nearest neighbour on one side of a track, by station; (n,) arrays, NaN where there is none.

    Distance in plan, how much higher the neighbour's track is, its number among the courses, -1 where there is none,
    the least distance that is required, and whether the distance is judged: not where the tracks join.
    """

    distance_m: np.ndarray
    above_m: np.ndarray
    track: np.ndarray
    least_m: np.ndarray
    judged: np.ndarray

    @property
    def fouling(self) -> np.ndarray:
        """Stations at which a distance that is judged ends, towards a junction."""
        known = np.isfinite(self.distance_m)
        edge = np.diff(self.judged.astype(np.int8)) != 0
        return np.flatnonzero(edge & known[1:] & known[:-1])

    @property
    def short(self) -> np.ndarray:
        """Which stations, (n,), are nearer to the neighbour than required."""
        return self.judged & (self.distance_m < self.least_m - ERROR_M)


def neighbours(courses: Sequence[Course], number: int, settings: Settings) -> tuple[Side, Side]:
    """Return the neighbours of a track on the left and on the right."""
    own = courses[number]
    best = np.full((2, 4, len(own.xyz)), np.nan)
    for at, other in enumerate(courses):
        if at != number and near(own, other):
            left_m, *more = _beside(own, other)
            for side, sense in zip(best, (1.0, -1.0)):
                with np.errstate(invalid="ignore"):
                    nearer = (sense * left_m > 0) & ~(sense * left_m >= side[0])
                side[:, nearer] = np.array([sense * left_m, *more, np.full(len(left_m), at)])[:, nearer]
    left, right = (_judged(own, side, settings) for side in best)
    return left, right


def near(own: Course, other: Course) -> Course | None:
    """Return the part of another track that is near a track; None if none is."""
    low, high = own.xyz[:, :2].min(axis=0) - REACH_M, own.xyz[:, :2].max(axis=0) + REACH_M
    inside = np.flatnonzero(((other.xyz[:, :2] >= low) & (other.xyz[:, :2] <= high)).all(axis=1))
    return other.part(int(inside[0]), int(inside[-1]) + 1) if len(inside) > 1 else None


def _beside(own: Course, other: Course) -> np.ndarray:
    """Return how far another track is to the left and above, and how much more cant the outer one has, (3, n)."""
    mine, nearest = other.near(own.xyz[:, :2], REACH_M + STEP_M)
    at, across = Polyline(other.xyz, other.s).feet_near(own.xyz[mine, :2], other.s[nearest])
    same = np.cos(own.heading[mine] - other.heading[nearest])
    above = np.interp(at, other.s, other.xyz[:, 2]) - own.xyz[mine, 2]
    more = np.abs(other.cant_m[nearest]) - np.abs(own.cant_m[mine])
    is_outside = np.abs(other.curvature[nearest]) < np.abs(own.curvature[mine])
    rows = np.array([-across * np.sign(same), above, np.maximum(np.where(is_outside, more, -more), 0.0)])
    with np.errstate(invalid="ignore"):
        beside = (np.abs(across) <= REACH_M) & (np.abs(same) > np.cos(np.radians(PARALLEL_DEG)))
    found = np.full((3, len(own.xyz)), np.nan)
    found[:, mine] = np.where(beside, rows, np.nan)
    return found


def _judged(own: Course, side: np.ndarray, settings: Settings) -> Side:
    """Return a side, given distance, height, cant and number of the neighbour, (4, n), with what is required."""
    distance_m, above_m, more_cant_m, track = side
    needed = np.full(len(own.xyz), settings.least_distance_m)
    if settings.profile.is_of_ebo:
        tight_m = np.interp(1.0 / np.maximum(np.abs(own.curvature), 1e-9), *TIGHT_M)
        needed = needed + tight_m + CANT_LEVER * np.nan_to_num(more_cant_m)
    with np.errstate(invalid="ignore"):
        joined, close = distance_m < JOINED_M, distance_m < APART_M
    judged = np.isfinite(distance_m) & np.isfinite(needed)
    for first, last in runs(close):
        if joined[first : last + 1].any():
            judged[first : last + 1] = False
    return Side(distance_m, above_m, np.nan_to_num(track, nan=-1).astype(np.int64), needed, judged)
