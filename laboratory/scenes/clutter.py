"""What surrounds rails in a classified cloud: weeds and ballast taken for rail, ground, and weeds told apart."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

HEAD_ABOVE_GROUND_M = 0.15
"""Railhead above sleepers and ballast (Gribov and Chang, section 3)."""

BALLAST_WIDTH_M = 1.6
"""From a track's axis to where its bed begins to fall."""

BED_SLOPE, BED_HEIGHT_M = 1 / 1.5, 0.5
"""Fall of the bed's shoulder and how deep it goes."""

GROUND_ROUGHNESS_M = 0.015
"""Standard deviation of stones."""

WEED_POINTS = (5, 60)
"""Points in one weed, fewest and most."""


def weeds(
    rng: np.random.RandomState, lines: list, count: int, reach_m: float, height_m: tuple[float, float]
) -> np.ndarray:
    """Let weeds grow beside lines: round tufts, some narrow, some as wide as a sleeper.

    Parameters
    ----------
    rng : RandomState
    lines : list of (n, 3) array
        Lines at the height of the railheads.
    count : int
    reach_m : float
        Farthest a weed stands from its line.
    height_m : tuple of float
        Lowest and highest point above the railheads.

    Returns
    -------
    (n, 3) array
    """
    roots = _beside(rng, lines, count, reach_m)
    sizes = rng.randint(*WEED_POINTS, size=count)
    widths = rng.uniform(0.02, 0.12, count)
    plant = np.repeat(np.arange(count), sizes)
    points = roots[plant]
    points[:, :2] += widths[plant, None] * rng.standard_normal((len(plant), 2))
    points[:, 2] += rng.uniform(*height_m, size=len(plant))
    return points


def stones(rng: np.random.RandomState, lines: list, count: int, reach_m: float) -> np.ndarray:
    """Scatter single points of ballast and rail feet beside lines, (count, 3)."""
    points = _beside(rng, lines, count, reach_m)
    points[:, 2] -= rng.uniform(0.6, 1.1, count) * HEAD_ABOVE_GROUND_M
    return points


def ground(rng: np.random.RandomState, centerlines: list, margin_m: float, step_m: float) -> np.ndarray:
    """Thin ground on a jittered grid around the tracks: a flat bed with falling shoulders.

    Parameters
    ----------
    rng : RandomState
    centerlines : list of (n, 3) array
    margin_m : float
        How far the ground reaches beyond the outer tracks.
    step_m : float
        Grid of the thinning.

    Returns
    -------
    (n, 3) array
    """
    axes = np.concatenate(centerlines)
    (left, bottom), (right, top) = axes[:, :2].min(axis=0) - margin_m, axes[:, :2].max(axis=0) + margin_m
    x, y = np.meshgrid(np.arange(left, right, step_m), np.arange(bottom, top, step_m))
    xy = np.column_stack([x.ravel(), y.ravel()])
    xy += step_m * (rng.random_sample(xy.shape) - 0.5)
    distance, nearest = cKDTree(axes[:, :2]).query(xy, distance_upper_bound=margin_m)
    kept = np.isfinite(distance)
    fall = np.clip((distance[kept] - BALLAST_WIDTH_M) * BED_SLOPE, 0, BED_HEIGHT_M)
    rough = GROUND_ROUGHNESS_M * rng.standard_normal(np.count_nonzero(kept))
    return np.column_stack([xy[kept], axes[nearest[kept], 2] - HEAD_ABOVE_GROUND_M - fall + rough])


def _beside(rng: np.random.RandomState, lines: list, count: int, reach_m: float) -> np.ndarray:
    """Draw places around lines, each at most `reach_m` from its line in x and in y; (count, 3)."""
    along = np.concatenate(lines)
    places = along[rng.randint(len(along), size=count)]
    places[:, :2] += rng.uniform(-reach_m, reach_m, (count, 2))
    return places
