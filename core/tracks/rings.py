"""Closed centerlines, such as that of a turning loop.

See docs/method.md section 8.8.
"""

from __future__ import annotations

import numpy as np

from ..polyline import MIN_RING_M, length_along

MAX_SEAM_M = 0.5
"""Maximum distance between the ends of a ring's centerline, which may overlap or leave a gap: matches end a little
early."""


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
