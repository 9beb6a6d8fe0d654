"""Steps of a track to the side, which no track has: passes of a scanner that lie apart meet there.

See docs/method.md section 6.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..polyline import interpolate, left_normals, length_along, project
from ..rails import Centerline, RailLine

STATION_M = 0.25
"""Spacing of the stations at which a track is looked at."""

ARM_M, CORE_M = 5.0, 1.0
"""Length of the track on either side of a place that shows a step, and half the length in the middle that is left out:
smoothing draws a step as a bend 2 m long."""

BESIDE_M = 3.0
"""Distance in plan within which the steps of the track and of its rails are one: a track's width, and some metres
along, because smoothing blurs the place."""

MIN_SHARE = 0.5
"""Smallest step of a rail, relative to that of its track."""

REACH_M = 1.2
"""Distance from a centerline within which its rails are: half of the widest gauge, and a head."""

MIN_STEP_M = 0.012
"""Smallest step. An arc of 190 m that begins abruptly looks like 6 mm, as do clothoids of trams, and waves of 1 mm that
are 5 m long."""


def find_steps(track: Centerline, rails: Sequence[RailLine]) -> list[tuple[float, float]]:
    """Find the steps of a track: places where its centerline and a rail on either side step the same way.

    At switches one of the rails may be off for some metres, as no pass of a scanner puts it.

    Parameters
    ----------
    track : Centerline
    rails : sequence of RailLine
        Rails of the network. Where the track does not name its rails, the centerline decides alone.

    Returns
    -------
    list of tuple of float
        Chainage of each step, and its size to the left in metres: the mean of the rails, which are smoothed less.
    """
    line = track.xyz[:, :2]
    sides = [_steps_of_side(rails, ids) for ids in (track.left_ids, track.right_ids) if ids]
    found = []
    for at_m, across_m in _steps(line, MIN_STEP_M):
        place = interpolate(line, length_along(line), np.array([at_m]))
        sizes_m = [_step_beside(place, across_m, *side) for side in sides]
        if all(abs(size_m) >= MIN_SHARE * abs(across_m) for size_m in sizes_m):
            found.append((at_m, float(np.mean(sizes_m)) if sizes_m else across_m))
    return found


def _steps_of_side(rails: Sequence[RailLine], ids: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the places, (k, 2), and the steps to the left, (k,) metres, of the rails with these numbers.

    A step to the left is one in either direction along the line.
    """
    found = [np.empty((0, 3))]
    for rail in rails:
        if rail.rail_id in ids:
            line = rail.xyz[:, :2]
            at_m, across_m = np.array(_steps(line, MIN_SHARE * MIN_STEP_M)).reshape(-1, 2).T
            found.append(np.column_stack([interpolate(line, length_along(line), at_m), across_m]))
    rows = np.concatenate(found)
    return rows[:, :2], rows[:, 2]


def _step_beside(place: np.ndarray, like_m: float, places: np.ndarray, across_m: np.ndarray) -> float:
    """Return the largest step of a rail next to a place of a track, to the same side as `like_m`; 0 without one."""
    beside = (np.hypot(*(places - place).T) <= BESIDE_M) & (across_m * like_m > 0)
    return float(np.sign(like_m) * np.abs(across_m[beside]).max()) if beside.any() else 0.0


def _steps(line: np.ndarray, least_m: float) -> list[tuple[float, float]]:
    """Find the steps of a line, (n, 2), from a size on: chainages, and sizes to the left in metres.

    On either side of a place, a cubic and a step are fitted to the line.
    """
    along = length_along(line)
    t = np.arange(0.0, along[-1], STATION_M)
    weights = _weights()
    half = len(weights) // 2
    if len(t) < len(weights):
        return []
    places, normals = interpolate(line, along, t), interpolate(left_normals(line), along, t)
    steps = np.column_stack([np.correlate(column, weights, "valid") for column in places.T])
    across = np.einsum("ij,ij->i", steps, normals[half:-half])
    found = []
    size = np.abs(across)
    while len(size) and size.max() >= least_m:
        place = int(np.argmax(size))
        found.append((float(t[place + half]), float(across[place])))
        size[max(place - 2 * half, 0) : place + 2 * half + 1] = 0.0
    return sorted(found)


def doubting_steps(rails: Sequence[RailLine], centerlines: Sequence[Centerline]) -> list[RailLine]:
    """Add half of the steps of tracks to the standard errors of their rails: on either side, one pass may be right.

    Parameters
    ----------
    rails : sequence of RailLine
        With their tracks.
    centerlines : sequence of Centerline
        All tracks of these rails.
    """
    steps = [(line, find_steps(line, rails)) for line in centerlines]
    doubted = []
    for rail in rails:
        found = [
            (interpolate(line.xyz[:, :2], length_along(line.xyz[:, :2]), np.array([at_m]))[0], abs(step_m))
            for line, own in steps
            if rail.rail_id in (*line.left_ids, *line.right_ids)
            for at_m, step_m in own
        ]
        doubted.append(_doubting(rail, found) if found else rail)
    return doubted


def _doubting(rail: RailLine, found: Sequence[tuple[np.ndarray, float]]) -> RailLine:
    """Add half of the nearest step, given the places on the centerline and the sizes, to the error of a rail."""
    support = rail.support
    feet = project([rail.xyz[:, :2]], np.array([place for place, _ in found]), REACH_M)
    if support is None or not len(feet.t):
        return rail
    nearest = np.argmin(np.abs(support.t[:, None] - feet.t), axis=1)
    step_m = np.array([size_m for _, size_m in found])[feet.point][nearest]
    strips = support.every_strip.copy()
    strips[:, 1], strips[:, 2] = np.fmax(strips[:, 1], step_m), np.hypot(strips[:, 2], 0.5 * step_m)
    support = replace(support, sigma_m=np.hypot(support.sigma_m, 0.5 * step_m), strips=strips)
    return replace(rail, sigma_mm=1000 * support.rms_m, support=support)


def _weights() -> np.ndarray:
    """Return the weights of stations around a place whose sum is the step there, (k,)."""
    count = int(round(ARM_M / STATION_M))
    t = np.arange(-count, count + 1) * STATION_M
    used = np.abs(t) >= CORE_M
    weights = np.zeros(len(t))
    weights[used] = np.linalg.pinv(np.stack([t**0, t, t**2, t**3, t > 0], axis=1)[used])[-1]
    return weights
