"""Lines that leave the course of their rail and come back to it are led along that course.

A check rail or a wing rail hides the rail beside it from a scanner on its own side, and the raster then shows a single
line that changes over to it and back. See docs/method.md section 4.6.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.signal import find_peaks
from scipy.spatial import cKDTree

from ..lines.ends import FIT_M, STEADY_TRANSITION_M, STEP_M, Bridge, bridge, even_points
from ..lines.network import LineNetwork
from ..polyline import Polyline
from ..progress import SILENT, Progress
from .joining import unseen_m

LENGTHS_M = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0)
"""Lengths of detours: check rails are up to 10 m long. The line shows its course on as much of either side, because of
two courses the longer one is the rail's, and on `FIT_M` at least."""

ASIDE_M = 0.07
"""Smallest detour: half of the distance between the axes of a rail and its check rail, 0.14 m, as where both are one
ridge. Stairs are up to 0.02 m aside."""

SWERVE_DEG = 3.0
"""A detour turns away and back, so that its directions, measured over a metre, differ by this much more than those of
its course: a change by 0.14 m within 2 m takes 4 degrees either way. A curve that a course would cut short does not."""

MAX_UNSEEN_M = 0.5
"""Longest part of the course away from all cells. Beside it are those of its rail or of what hides it."""

APART_M = 1.0
"""Smallest distance between the places at which detours are looked for, and length over which directions are measured:
the stairs of a raster are shorter."""


def straighten(network: LineNetwork, seen: cKDTree, progress: Progress = SILENT) -> LineNetwork:
    """Lead lines past their detours, given the cells, `seen`. The network has no passes yet."""
    lines = progress.follow(network.lines, len(network.lines))
    return replace(network, lines=tuple(_straightened(line, seen) for line in lines))


def _straightened(line: np.ndarray, seen: cKDTree) -> np.ndarray:
    """Replace the detours of a line, (n, 2), the widest one first."""
    found = _detour(line, seen)
    if found is None:
        return line
    own, (start, end, course) = Polyline(line), found
    before, after = own.part(0.0, start).xyz, own.part(end, own.length_m).xyz
    return np.concatenate([_straightened(before, seen), course, _straightened(after, seen)])


def _detour(line: np.ndarray, seen: cKDTree) -> tuple[float, float, np.ndarray] | None:
    """Find a detour of a line: chainage of its start and of its end, and the points, (k, 2), of the course between."""
    own = Polyline(line)
    aside_m = _aside(even_points(line))
    peaks = find_peaks(aside_m, height=ASIDE_M, distance=int(APART_M / STEP_M))[0]
    for peak in peaks[np.argsort(-aside_m[peaks], kind="stable")].tolist():
        middle = own.length_m * peak / (len(aside_m) - 1)
        courses = [found for length_m in LENGTHS_M if (found := _course(own, middle, length_m, seen)) is not None]
        if courses:
            _, start, end, course = min(courses, key=lambda found: found[0])
            return start, end, course
    return None


def _aside(points: np.ndarray) -> np.ndarray:
    """Measure how far even points of a line, (n, 2), are off the course that both sides show, at most; (n,) metres."""
    aside_m = np.zeros(len(points))
    for length_m in LENGTHS_M:
        weights = _weights(length_m)
        reach = len(weights) // 2
        if len(points) <= len(weights):
            break
        course = np.column_stack([np.convolve(ordinates, weights, "valid") for ordinates in points.T])
        inside = slice(reach, len(points) - reach)
        aside_m[inside] = np.maximum(aside_m[inside], np.hypot(*(points[inside] - course).T))
    return aside_m


@cache
def _weights(length_m: float) -> np.ndarray:
    """Return the weights of even points by which a cubic through both legs predicts the middle of a detour, (k,)."""
    reach = int((length_m / 2 + _leg_m(length_m)) / STEP_M)
    x = STEP_M * np.arange(-reach, reach + 1)
    on_legs = np.abs(x) >= length_m / 2
    return np.linalg.pinv(np.vander(x, 4) * on_legs[:, None])[-1]


def _leg_m(length_m: float) -> float:
    """Return the length of line on either side that shows the course of a detour of this length."""
    return max(FIT_M, length_m)


def _course(
    own: Polyline, middle: float, length_m: float, seen: cKDTree
) -> tuple[float, float, float, np.ndarray] | None:
    """Find the course past a detour about a chainage: its cost per metre, start, end, and points between; or None."""
    start, end, leg_m = middle - length_m / 2, middle + length_m / 2, _leg_m(length_m)
    if start < leg_m or end > own.length_m - leg_m:
        return None
    found = _led_past(own, start, end, leg_m)
    if found is None or not len(found.points) or unseen_m(found.points, seen) > MAX_UNSEEN_M:
        return None
    start, end = start - found.cuts_m[0], end + found.cuts_m[1]
    detour = own.part(start, end).xyz
    course = np.concatenate([detour[:1], found.points, detour[-1:]])
    aside_m = np.hypot(*(found.points - own.at(np.array([middle]))).T).min()
    if aside_m < ASIDE_M or _spread(detour) - _spread(course) < np.radians(SWERVE_DEG):
        return None
    return found.cost / length_m, start, end, found.points


def _led_past(own: Polyline, start: float, end: float, leg_m: float) -> Bridge | None:
    """Find the curve between two chainages that keeps its curvature and explains the legs before and after them."""
    before, after = own.part(start - leg_m, start).xyz[::-1], own.part(end, end + leg_m).xyz
    return bridge(before, after, transition_m=STEADY_TRANSITION_M, fit_m=leg_m)


def _spread(line: np.ndarray) -> float:
    """Return by how much the directions of a line differ, radians."""
    ahead = np.diff(Polyline(line).resampled(APART_M).xy, axis=0)
    return float(np.ptp(np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))))
