"""Closed rails, such as those of a turning loop: the rails of a track must start abreast to be paired all around.

See docs/method.md section 8.8.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lines.uniting import united
from ..polyline import MIN_RING_M, is_closed, length_along, resample
from ..rails import RailLine

START_STEP_M = 0.05
"""Spacing of the places where a closed rail may start: the rails of a track then start abreast to within half of it."""

MAX_SEAM_M = 0.5
"""Maximum distance between the ends of a ring's centerline, which may overlap or leave a gap: matches end a little
early."""


def started_abreast(rails: Sequence[RailLine]) -> list[RailLine]:
    """Move the start of closed rails to the place nearest to the start of the first one.

    The rails of a track then start on a common normal, wherever they started before.
    """
    place = next((rail.xyz[0, :2] for rail in rails if is_closed(rail.xyz)), None)
    if place is None:
        return list(rails)
    return [_started_near(rail, place) if is_closed(rail.xyz) else rail for rail in rails]


def _started_near(rail: RailLine, place: np.ndarray) -> RailLine:
    """Move the start of a closed rail to the place nearest to a given one, (2,)."""
    stations, t = resample(rail.xyz[:, :2], START_STEP_M)
    start = t[np.argmin(np.linalg.norm(stations - place, axis=1))]
    if start in (0.0, t[-1]):
        return rail
    return united([rail.between(start, t[-1]), rail.between(0.0, start)])


def closed_centerline(xyz: np.ndarray) -> np.ndarray:
    """Close a centerline, (n, d), drawn along closed rails if its ends are close together."""
    away = np.linalg.norm(xyz[:, :2] - xyz[0, :2], axis=1)
    along = length_along(xyz[:, :2])
    if away[-1] > MAX_SEAM_M or along[-1] <= MIN_RING_M:
        return xyz
    ahead = (xyz[:, :2] - xyz[0, :2]) @ (xyz[1, :2] - xyz[0, :2])
    past = (along > along[-1] - 2 * MAX_SEAM_M) & (away <= 2 * MAX_SEAM_M) & (ahead >= 0)
    return np.concatenate([xyz[~past], xyz[:1]])


def extended_ring(xyz: np.ndarray, margin_m: float) -> tuple[np.ndarray, float]:
    """Extend a closed line, (n, d), at both ends by at least `margin_m`; returns it and the length before its start."""
    along = length_along(xyz[:, :2])
    margin_m = min(margin_m, along[-1])
    first, last = np.searchsorted(along, [along[-1] - margin_m, margin_m])
    first, last = max(first - 1, 0), min(last + 1, len(xyz))
    return np.concatenate([xyz[first:-1], xyz, xyz[1:last]]), float(along[-1] - along[first])
