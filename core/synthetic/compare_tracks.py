"""Gauge and cant between extracted rails, held against those between the true ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import left_normals
from ..rails import Centerline, RailLine, length_along
from .compare import cut, nearest

ASTRAY_M = 0.10
"""A rail this far from where the centerline has it is another one, or none."""

STEP_M = 0.5
"""Distance between the places at which tracks are measured."""


@dataclass(frozen=True)
class TrackErrors:
    """Measured less true values along all centerlines, metres: mean and root mean square."""

    gauge_bias_m: float
    gauge_rmse_m: float
    cant_bias_m: float
    cant_rmse_m: float


def compare_tracks(
    centerlines: Sequence[Centerline], rails: Sequence[RailLine], truth: Sequence[np.ndarray], head_width_m: float
) -> TrackErrors:
    """Compare gauge and cant every `STEP_M` of the centerlines, where both lines and truth have both rails.

    Parameters
    ----------
    centerlines : sequence of Centerline
    rails : sequence of RailLine
        Those the centerlines were made of.
    truth : sequence of (n, 3) array
        True rails, metres, in the same frame.
    head_width_m : float
    """
    errors = [np.empty((0, 2))]
    for centerline in centerlines:
        own = [rail.xyz for rail in rails if rail.rail_id in (*centerline.left_ids, *centerline.right_ids)]
        middle, left = _places(centerline.xyz)
        half_m = (centerline.gauge_mm / 1000 + head_width_m) / 2
        found, true = (_gauge_and_cant(middle, half_m * left, lines) for lines in (own, truth))
        errors.append(found - true)
    error = np.concatenate(errors)
    error = error[np.isfinite(error).all(axis=1)]
    if not len(error):
        return TrackErrors(*[float("nan")] * 4)
    bias, rmse = error.mean(axis=0), np.sqrt(np.mean(error**2, axis=0))
    return TrackErrors(float(bias[0]), float(rmse[0]), float(bias[1]), float(rmse[1]))


def _places(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places every `STEP_M` of a line and unit vectors to its left there, (n, 2) each."""
    t = length_along(line[:, :2])
    at = np.arange(STEP_M / 2, t[-1], STEP_M)
    normals = left_normals(line[:, :2])
    return tuple(np.column_stack([np.interp(at, t, c) for c in values[:, :2].T]) for values in (line, normals))


def _gauge_and_cant(middle: np.ndarray, to_left: np.ndarray, lines: Sequence[np.ndarray]) -> np.ndarray:
    """Distance and difference in height of the rails to the left and right of places, (n, 2); NaN where one lacks."""
    pieces = cut(lines)
    sides = []
    for place in (middle + to_left, middle - to_left):
        feet, _ = nearest(np.column_stack([place, np.zeros(len(place))]), pieces)
        astray = np.linalg.norm(feet[:, :2] - place, axis=1) > ASTRAY_M
        sides.append(np.where(astray[:, None], np.nan, feet))
    step = sides[0] - sides[1]
    return np.column_stack([np.linalg.norm(step, axis=1), step[:, 2]])
