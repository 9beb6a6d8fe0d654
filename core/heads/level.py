"""What points say of one railhead before its line is exact: rough level, noise, and slope across the head."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

BIN_M = 0.5
"""Length of the bins: a handful of points on the sparsest rail, and no more than 2 cm of height at 4 % gradient."""

LEVEL_BINS = 5
"""Bins whose medians are compared: a growth of weeds up to 1 m long can't lift the level."""

CROSSING_M, CROSSING_BINS = 1.0, 41
"""Bins that lie so far from the median of so many, 20 m of rail, are of a rail on a bridge across: no rail rises so
fast, and what a bridge hides is shorter."""

SLOPE_BINS = 9
"""Bins that share one slope across: over 4.5 m cant changes by 1 % of its slope at most."""

CROWN_SHARE = 0.35
"""Part of the head width, to either side of the axis, that the corners do not reach: 25 mm of a 72 mm head."""

PRIOR_SLOPE = 0.1
"""Slopes to be expected: 0.05 from inclined rails and 0.1 from 150 mm cant; holds the slope where points are few."""

SLOPE_ROUNDS = 3
"""Rounds of fitting and leaving out what lies off; the third no longer changes the slope by a thousandth."""

OFF_TOP_SIGMAS = 2.5
"""Points further off the top than this many standard deviations take no part in the slope."""

LEAST_NOISE_M = 0.001
"""No scanner's points are better; keeps the limits open where heights are rounded or made up."""

LEAST_ON_HEAD = 80
"""Points on a head from which its top can be told: fewer give no slope."""

DEPTH_M, DEPTH_SIGMAS = 0.006, 1.5
"""Points further below the top, in metres and in standard deviations of the noise, may be of a side face or a corner.
Tighter than noise would ask for: what it costs in points on top it costs across the whole head alike."""

ABOVE_SIGMAS = 3.0
"""Points further above the top, in standard deviations of the noise, are weeds."""


def rough_level(t: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Height of most points around each point's chainage: medians of short bins, themselves filtered by a median.

    Parameters
    ----------
    t : (n,) array
        Chainage in metres, increasing.
    z : (n,) array

    Returns
    -------
    (n,) array
    """
    number = np.floor((t - t[0]) / BIN_M).astype(int)
    _, first, number, count = np.unique(number, return_index=True, return_inverse=True, return_counts=True)
    middle = first + count // 2
    middle_t, middle_z = t[middle], z[np.lexsort((z, number))][middle]
    return np.interp(t, middle_t, _without_steps(middle_t, middle_z))


def _without_steps(t: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Apply a running median to what is left of heights after their trend, so that a gradient keeps its ends."""
    trend = np.polynomial.Polynomial.fit(t, z, 1)(t) if len(t) > LEVEL_BINS else 0.0
    level = z - trend
    own = np.abs(level - median_filter(level, CROSSING_BINS, mode="nearest")) <= CROSSING_M
    if own.any():
        level = np.interp(t, t[own], level[own])
    return trend + median_filter(level, LEVEL_BINS, mode="nearest")


def spread(values: np.ndarray) -> float:
    """Estimate the standard deviation of values from the median of their deviations, where outliers hardly count."""
    if not len(values):
        return LEAST_NOISE_M
    return max(1.4826 * float(np.median(np.abs(values - np.median(values)))), LEAST_NOISE_M)


def cross_slope(t: np.ndarray, across: np.ndarray, height: np.ndarray, head_width_m: float) -> np.ndarray:
    """Fit how the top of a head slopes across, from its cant and its lean.

    Parameters
    ----------
    t : (n,) array
        Chainage in metres, increasing.
    across : (n,) array
        Offset to the left of the head's axis, metres.
    height : (n,) array
        Metres above the rough level.
    head_width_m : float

    Returns
    -------
    (n,) array
        Rise per metre to the left, at each point.
    """
    crown = np.abs(across) <= CROWN_SHARE * head_width_m
    limit = OFF_TOP_SIGMAS * spread(height[crown])
    number = np.floor((t - t[0]) / BIN_M).astype(int)
    slope, level = np.zeros(len(t)), np.full(len(t), np.median(height[crown]) if crown.any() else 0.0)
    for _ in range(SLOPE_ROUNDS):
        on_top = crown & (np.abs(height - level - slope * across) <= limit)
        slope, level = _moving_fit(number, on_top, across, height, limit / OFF_TOP_SIGMAS)
    return slope


def on_top(t: np.ndarray, across: np.ndarray, z: np.ndarray, head_width_m: float) -> tuple[np.ndarray, float]:
    """Tell which points lie on the top of the head, its slope across considered, and how noisy these are.

    Parameters
    ----------
    t, across, z : (n,) arrays
        Points near the line: chainage, increasing, offset to its left, and height; metres.
    head_width_m : float

    Returns
    -------
    top : (n,) bool array
    noise_m : float
        Standard deviation of their heights.
    """
    head = np.abs(across) <= 0.5 * head_width_m
    if head.sum() < LEAST_ON_HEAD:
        return np.zeros(len(t), dtype=bool), LEAST_NOISE_M
    above = z - np.interp(t, t[head], rough_level(t[head], z[head]))
    slope = np.interp(t, t[head], cross_slope(t[head], across[head], above[head], head_width_m))
    flat = above - slope * across
    flat -= np.interp(t, t[head], rough_level(t[head], flat[head]))
    noise = spread(flat[head & (np.abs(flat) < 2 * DEPTH_M)])
    noise = spread(flat[head & (np.abs(flat) < max(2 * DEPTH_M, OFF_TOP_SIGMAS * noise))])
    return (flat >= -max(DEPTH_M, DEPTH_SIGMAS * noise)) & (flat <= max(DEPTH_M, ABOVE_SIGMAS * noise)), noise


def _moving_fit(
    number: np.ndarray, used: np.ndarray, x: np.ndarray, y: np.ndarray, noise: float
) -> tuple[np.ndarray, np.ndarray]:
    """Fit y = level + slope x in windows of bins; slope and level at each point."""
    moments = np.stack([np.ones_like(x), x, y, x * x, x * y])[:, used]
    size = int(number[-1]) + 1
    sums = np.stack([np.bincount(number[used], row, minlength=size) for row in moments])
    sums = uniform_filter1d(sums, SLOPE_BINS, axis=1, mode="constant") * SLOPE_BINS
    count, x_sum, y_sum, xx, xy = sums
    count = np.maximum(count, 1e-9)
    slope = (xy - x_sum * y_sum / count) / (xx - x_sum**2 / count + (noise / PRIOR_SLOPE) ** 2)
    level = (y_sum - slope * x_sum) / count
    return slope[number], level[number]
