"""Points around the rails of a classified cloud: weeds and ballast, in part classified as rail, and ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

HEAD_ABOVE_GROUND_M = 0.15
"""Height of the railhead above sleepers and ballast (Gribov and Chang, section 3)."""

BALLAST_WIDTH_M = 1.6
"""Distance from the axis of a track to the shoulder of its bed."""

BED_SLOPE, BED_HEIGHT_M = 1 / 1.5, 0.5
"""Slope and height of the shoulder of the bed."""

GROUND_ROUGHNESS_M = 0.015
"""Standard deviation of the height of the ground."""

WEED_POINTS = (5, 60)
"""Smallest and largest number of points in a weed."""


def weeds(
    rng: np.random.RandomState, lines: Sequence[np.ndarray], count: int, reach_m: float, height_m: tuple[float, float]
) -> np.ndarray:
    """Draw weeds, (n, 3), next to lines at railhead height: round tufts, some narrow, some as wide as a sleeper.

    They are up to `reach_m` away in x and in y, and between two heights above the heads.
    """
    roots = _beside(rng, lines, count, reach_m)
    sizes = rng.randint(*WEED_POINTS, size=count)
    widths = rng.uniform(0.02, 0.12, count)
    plant = np.repeat(np.arange(count), sizes)
    points = roots[plant]
    points[:, :2] += widths[plant, None] * rng.standard_normal((len(plant), 2))
    points[:, 2] += rng.uniform(*height_m, size=len(plant))
    return points


def stones(rng: np.random.RandomState, lines: Sequence[np.ndarray], count: int, reach_m: float) -> np.ndarray:
    """Draw single points, (count, 3), of ballast and rail feet up to `reach_m` from lines at railhead height."""
    points = _beside(rng, lines, count, reach_m)
    points[:, 2] -= rng.uniform(0.6, 1.1, count) * HEAD_ABOVE_GROUND_M
    return points


def ground(rng: np.random.RandomState, centerlines: Sequence[np.ndarray], margin_m: float, step_m: float) -> np.ndarray:
    """Draw ground points, (n, 3), on a jittered grid around the tracks: a flat bed with shoulders, `margin_m` wide."""
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


def _beside(rng: np.random.RandomState, lines: Sequence[np.ndarray], count: int, reach_m: float) -> np.ndarray:
    """Draw places around lines, at most `reach_m` from the line in x and in y; (count, 3)."""
    along = np.concatenate(lines)
    places = along[rng.randint(len(along), size=count)]
    places[:, :2] += rng.uniform(-reach_m, reach_m, (count, 2))
    return places
