"""How a line looks near one of its ends: the stretch there and the direction in which it would run on."""

from __future__ import annotations

import numpy as np

from ..polyline import interpolate, length_along

STEP_M = 0.1
"""Distance between the points that stand for a stretch; raster vertices are spaced by corners, not by length."""


def turned(vertices: np.ndarray, end: int) -> np.ndarray:
    """Turn a line around if it is seen from its end, or is to be stored as seen from there."""
    return vertices[::-1] if end % 2 else vertices


def stretch(from_end: np.ndarray, length_m: float) -> np.ndarray:
    """Points every `STEP_M` along the first `length_m` of a line given from its end, (n, 2), at least two."""
    along = length_along(from_end)
    length_m = min(length_m, along[-1])
    stations = np.linspace(0.0, length_m, max(int(length_m / STEP_M), 1) + 1)
    return interpolate(from_end, along, stations)


def cut_back(from_end: np.ndarray, length_m: float) -> np.ndarray:
    """Take the first `length_m` off a longer line given from its end."""
    if length_m <= 0:
        return from_end
    along = length_along(from_end)
    return np.concatenate([interpolate(from_end, along, [length_m]), from_end[along > length_m]])


def way_out(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Straight line through a stretch: its point beside the stretch's first one, and the unit vector out of the line.

    Parameters
    ----------
    points : (n, 2) array
        From the end inward.
    """
    middle = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - middle, full_matrices=False)
    outward = axes[0] if np.dot(axes[0], points[0] - points[-1]) >= 0 else -axes[0]
    return middle + np.dot(points[0] - middle, outward) * outward, outward
