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

REACH_M = 1.2
"""Distance from a centerline within which its rails are: half of the widest gauge, and a head."""

MIN_STEP_M = 0.012
"""Smallest step. An arc of 190 m that begins abruptly looks like 6 mm, as do clothoids of trams, and waves of 1 mm that
are 5 m long."""


def find_steps(line: np.ndarray) -> list[tuple[float, float]]:
    """Find the steps of a track.

    On either side of a place, a cubic and a step are fitted to the track.

    Parameters
    ----------
    line : (n, 2) or (n, 3) array
        Centerline.

    Returns
    -------
    list of tuple of float
        Chainage of each step, and its size to the left in metres.
    """
    along = length_along(line[:, :2])
    t = np.arange(0.0, along[-1], STATION_M)
    weights = _weights()
    half = len(weights) // 2
    if len(t) < len(weights):
        return []
    places, normals = interpolate(line[:, :2], along, t), interpolate(left_normals(line), along, t)
    steps = np.column_stack([np.correlate(column, weights, "valid") for column in places.T])
    across = np.einsum("ij,ij->i", steps, normals[half:-half])
    found = []
    size = np.abs(across)
    while len(size) and size.max() >= MIN_STEP_M:
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
    steps = [(line, find_steps(line.xyz)) for line in centerlines]
    doubted = []
    for rail in rails:
        found = [
            (interpolate(line.xyz[:, :2], length_along(line.xyz[:, :2]), np.array([at_m]))[0], step_m)
            for line, own in steps
            if rail.rail_id in (*line.left_ids, *line.right_ids)
            for at_m, step_m in own
        ]
        doubted.append(_doubting(rail, found) if found else rail)
    return doubted


def _doubting(rail: RailLine, found: Sequence[tuple[np.ndarray, float]]) -> RailLine:
    """Add half of the nearest step, given the places on the centerline and the sizes, to the error of a rail."""
    support, line = rail.support, rail.xyz[:, :2]
    feet = project([line], np.array([place for place, _ in found]), REACH_M)
    if support is None or not len(feet.t):
        return rail
    # A rail shows a step more sharply than the centerline, which is smoothed once more.
    own = find_steps(rail.xyz)
    sizes_m = [
        max([abs(found[number][1])] + [abs(step_m) for at_m, step_m in own if abs(at_m - t) < ARM_M])
        for number, t in zip(feet.point, feet.t)
    ]
    nearest = np.argmin(np.abs(support.t[:, None] - feet.t), axis=1)
    step_m = np.array(sizes_m)[nearest]
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
