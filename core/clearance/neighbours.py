"""How far tracks are apart, and where two that join foul each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import runs
from .frame import STEP_M, Course

REACH_M = 8.0
"""Between tracks further apart there is room for another one."""

PARALLEL_DEG = 20.0
"""Largest angle between neighbour tracks: others cross."""

JOINED_M, APART_M = 2.5, 3.5
"""Tracks nearer than the first join in a switch; nothing is judged from there to where the second is reached."""

ERROR_M = 0.002
"""Error of a distance between two measured lines: tracks that are built at the least distance are not too near."""

EBO_DISTANCE_M = 4.0
"""Least distance of tracks on the open line (EBO section 10)."""

TIGHT_M = np.array(
    [[250, 0], [225, 0.055], [200, 0.120], [180, 0.180], [170, 0.215], [150, 0.305], [120, 0.700], [100, 1.100]]
)
"""Radius, and what the least distance grows by there, metres (EBO annex 4)."""

CANT_LEVER = 3.53 / 1.50
"""Height of the widest place of a vehicle by the spacing of the rails: what the distance grows by, per metre by which
the outer track has more cant (EBO annex 4)."""


@dataclass(frozen=True)
class Side:
    """The nearest neighbour on one side of a track, by station; (n,) arrays, NaN where there is none.

    Attributes
    ----------
    distance_m, above_m : array
        In plan, and how much higher the neighbour's track is.
    track : int array
        Its number among the courses, -1 where there is none.
    least_m : array
        Least distance that is required.
    judged : bool array
        Whether the distance is judged: not where the tracks join.
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


def neighbours(courses: Sequence[Course], number: int, least_m: float, is_of_ebo: bool) -> tuple[Side, Side]:
    """Return the neighbours of a track on the left and on the right.

    Parameters
    ----------
    least_m : float
        Required distance; NaN if none is.
    is_of_ebo : bool
        Whether the additions for tight curves and cant apply.
    """
    own = courses[number]
    best = [[np.full(len(own.xyz), np.nan), np.full(len(own.xyz), np.nan), np.full(len(own.xyz), -1)] for _ in "lr"]
    for at, other in enumerate(courses):
        if at == number or not _touch(own, other):
            continue
        left, above = distances(own, other)
        for side, sense in zip(best, (1.0, -1.0)):
            with np.errstate(invalid="ignore"):
                nearer = (sense * left > 0) & ~(sense * left >= side[0])
            side[0][nearer], side[1][nearer], side[2][nearer] = sense * left[nearer], above[nearer], at
    return tuple(_judged(own, courses, one, least_m, is_of_ebo) for one in best)  # type: ignore[return-value]


def distances(course: Course, other: Course) -> tuple[np.ndarray, np.ndarray]:
    """Return how far another track is to the left, and above, at the stations, (n,) each; NaN where it is not near."""
    away, nearest = cKDTree(other.xyz[:, :2]).query(course.xyz[:, :2], distance_upper_bound=REACH_M + STEP_M)
    near = np.flatnonzero(np.isfinite(away))
    same = np.cos(course.heading[near] - other.heading[nearest[near]])
    near, same = (one[np.abs(same) > np.cos(np.radians(PARALLEL_DEG))] for one in (near, same))
    left, above = np.full((2, len(course.xyz)), np.nan)
    if len(near):
        s, _, _ = other.located(course.xyz[near], nearest[near])
        _, across = other.on_arc(course.xyz[near], other.station(np.nan_to_num(s)))
        is_beside = np.isfinite(s) & (np.abs(across) <= REACH_M)
        left[near] = np.where(is_beside, -across * np.sign(same), np.nan)
        above[near] = np.where(is_beside, np.interp(s, other.s, other.xyz[:, 2]) - course.xyz[near, 2], np.nan)
    return left, above


def _touch(one: Course, other: Course) -> bool:
    """Return whether the rectangles of two tracks come near each other."""
    low, high = one.xyz[:, :2].min(axis=0) - REACH_M, one.xyz[:, :2].max(axis=0) + REACH_M
    return bool((other.xyz[:, :2].max(axis=0) >= low).all() and (other.xyz[:, :2].min(axis=0) <= high).all())


def _judged(own: Course, courses: Sequence[Course], side: list[np.ndarray], least_m: float, is_of_ebo: bool) -> Side:
    """Return a side with the distance that is required."""
    distance_m, above_m, track = side
    needed = np.full(len(own.xyz), least_m)
    if is_of_ebo:
        radius_m = 1.0 / np.maximum(np.abs(own.curvature), 1e-9)
        needed = needed + np.interp(radius_m, TIGHT_M[::-1, 0], TIGHT_M[::-1, 1])
        needed = needed + CANT_LEVER * _more_cant_outside(own, courses, track)
    with np.errstate(invalid="ignore"):
        joined, apart = distance_m < JOINED_M, ~(distance_m < APART_M)
    judged = np.isfinite(distance_m) & np.isfinite(needed)
    for first, last in runs(~apart):
        if joined[first : last + 1].any():
            judged[first : last + 1] = False
    return Side(distance_m, above_m, track, needed, judged)


def _more_cant_outside(own: Course, courses: Sequence[Course], track: np.ndarray) -> np.ndarray:
    """Return how much more cant the outer one of two tracks has, (n,) metres; 0 where it has less or none is near."""
    found = np.zeros(len(own.xyz))
    for at in np.unique(track[track >= 0]):
        mine, other = track == at, courses[at]
        _, nearest = cKDTree(other.xyz[:, :2]).query(own.xyz[mine, :2])
        theirs, ours = np.abs(other.cant_m[nearest]), np.abs(own.cant_m[mine])
        is_outside = np.abs(other.curvature[nearest]) < np.abs(own.curvature[mine])
        found[mine] = np.maximum(np.where(is_outside, theirs - ours, ours - theirs), 0.0)
    return found
