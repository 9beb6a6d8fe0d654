"""The end of a line: even points along the part next to it, and the direction in which the line would continue."""

from __future__ import annotations

import numpy as np

from ..polyline import interpolate, length_along

STEP_M = 0.1
"""Spacing of even points. Vertices of a raster line are spaced by its corners, not by length."""


def turned(vertices: np.ndarray, end: int) -> np.ndarray:
    """Reverse a line if `end` is its last end (an odd number, see `LineNetwork`); doing so twice restores it."""
    return vertices[::-1] if end % 2 else vertices


def even_points(line: np.ndarray, length_m: float = np.inf) -> np.ndarray:
    """Return points about every `STEP_M` along the first `length_m` of a line, (n, 2), at least two."""
    along = length_along(line)
    length_m = min(length_m, along[-1])
    stations = np.linspace(0.0, length_m, max(int(length_m / STEP_M), 1) + 1)
    return interpolate(line, along, stations)


def cut_back(line: np.ndarray, length_m: float) -> np.ndarray:
    """Remove the first `length_m` of a line that is longer."""
    if length_m <= 0:
        return line
    along = length_along(line)
    return np.concatenate([interpolate(line, along, np.array([length_m])), line[along > length_m]])


def tip_and_direction(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fit a straight line to the end of a line.

    Parameters
    ----------
    points : (n, 2) array
        Points from the end inward.

    Returns
    -------
    tip : (2,) array
        Foot of the first point on the straight line.
    outward : (2,) array
        Unit vector out of the line.
    """
    middle = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - middle, full_matrices=False)
    outward = axes[0] if np.dot(axes[0], points[0] - points[-1]) >= 0 else -axes[0]
    return middle + np.dot(points[0] - middle, outward) * outward, outward
