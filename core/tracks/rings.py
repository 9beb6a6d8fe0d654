"""Closed rails, as of a turning loop: those of one track begin abreast, so that it is matched and drawn whole."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..lines.uniting import united
from ..polyline import MIN_RING_M, is_closed, length_along, resample
from ..rails import RailLine

STATION_M = 0.05
"""Spacing of the places where a closed rail may begin: two of a track then begin abreast within half of it."""

SEAM_M = 0.5
"""The ends of a ring's centerline lie this close together, ahead of each other or past: matches end a little short."""


def begun_abreast(rails: Sequence[RailLine]) -> list[RailLine]:
    """Let closed rails begin where they are nearest to the beginning of the first: parallel lines have their normals.

    Wherever each of a track's rails began before, none of the other rail is then left over at its beginning.
    """
    place = next((rail.xyz[0, :2] for rail in rails if is_closed(rail.xyz)), None)
    return [_begun_near(rail, place) if is_closed(rail.xyz) else rail for rail in rails]


def _begun_near(rail: RailLine, place: np.ndarray) -> RailLine:
    stations, t = resample(rail.xyz[:, :2], STATION_M)
    start = t[np.argmin(np.linalg.norm(stations - place, axis=1))]
    if start in (0.0, t[-1]):
        return rail
    return united([rail.between(start, t[-1]), rail.between(0.0, start)])


def closed_up(xyz: np.ndarray) -> np.ndarray:
    """Let a centerline, (n, d), drawn along closed rails end exactly where it begins; others stay as they are."""
    away = np.linalg.norm(xyz[:, :2] - xyz[0, :2], axis=1)
    along = length_along(xyz[:, :2])
    if away[-1] > SEAM_M or along[-1] <= MIN_RING_M:
        return xyz
    ahead = (xyz[:, :2] - xyz[0, :2]) @ (xyz[1, :2] - xyz[0, :2])
    past = (along > along[-1] - 2 * SEAM_M) & (away <= 2 * SEAM_M) & (ahead >= 0)
    return np.concatenate([xyz[~past], xyz[:1]])


def run_on(xyz: np.ndarray, margin_m: float) -> tuple[np.ndarray, float]:
    """Let a closed line, (n, d), run on beyond both its ends by `margin_m` or a little more; gives also by how much."""
    along = length_along(xyz[:, :2])
    margin_m = min(margin_m, along[-1])
    first, last = np.searchsorted(along, [along[-1] - margin_m, margin_m])
    first, last = max(first - 1, 0), min(last + 1, len(xyz))
    return np.concatenate([xyz[first:-1], xyz, xyz[1:last]]), float(along[-1] - along[first])
