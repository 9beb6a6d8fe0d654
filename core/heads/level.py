"""Rough level, noise and slope across of one railhead, estimated while its line is still inexact.

See docs/method.md section 6.1.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial
from scipy.ndimage import median_filter, uniform_filter1d

from ..spread import sigma_by_median

LEVEL_BIN_M = 0.5
"""Length of the bins: a handful of points on the sparsest rail, and at most 2 cm of height at 4 % gradient."""

MEDIAN_BINS = 5
"""Bins in the running median: weeds up to 1 m long cannot lift the level."""

SLOPE_BINS = 9
"""Bins that share one slope across: over 4.5 m cant changes by at most 1 % of its slope."""

CROWN_SHARE = 0.35
"""Part of the head width on either side of the axis that excludes the round corners: 25 mm of a 72 mm head."""

AXIS_SHARE = 0.25
"""Part of the head width on either side of the axis that gives the height: the crown falls by at most 0.5 mm there, and
no point of a face is near it, even where the line is a centimetre off."""

PRIOR_SLOPE = 0.1
"""Expected slope, which keeps the fit stable where points are few: 0.05 from inclined rails, 0.1 from 150 mm cant."""

SLOPE_ROUNDS = 3
"""Rounds of fitting and rejecting outliers; the third changes the slope by less than a thousandth."""

OFF_TOP_SIGMAS = 2.5
"""Distance from the top, in standard deviations, beyond which points do not count for the slope."""

MIN_NOISE_M = 0.001
"""No scanner is better than this; it keeps the limits open where heights are rounded or synthetic."""


def rough_level(t: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the height of most points around each point, (n,): medians of short bins, filtered by a running median.

    Chainages `t`, metres, increase. The trend of the line is removed before and added again, so that the ends of a
    gradient are kept.
    """
    number = np.floor((t - t[0]) / LEVEL_BIN_M).astype(int)
    first = np.concatenate([[0], np.flatnonzero(np.diff(number)) + 1])
    count = np.diff(np.append(first, len(t)))
    middle_t = t[first + count // 2]
    level = medians(z, first, count)
    trend = Polynomial.fit(middle_t, level, 1) if len(middle_t) > MEDIAN_BINS else Polynomial([0.0])
    return trend(t) + np.interp(t, middle_t, median_filter(level - trend(middle_t), MEDIAN_BINS, mode="nearest"))


def medians(values: np.ndarray, first: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Return the median of each group of successive values, (k,); of an even number, the upper one of the middle two.

    Groups, given by first value and number, follow each other without gaps. Sorting short rows is several times as fast
    as sorting all values by their group.
    """
    found = np.empty(len(count))
    order = np.argsort(count, kind="stable")
    for groups in np.split(order, np.flatnonzero(np.diff(np.log2(count[order]).astype(int))) + 1):
        filled = np.full((len(groups), count[groups[-1]]), np.inf)
        own = np.arange(filled.shape[1]) < count[groups, None]
        filled[own] = values[(first[groups, None] + np.arange(filled.shape[1]))[own]]
        found[groups] = np.sort(filled, axis=1)[np.arange(len(groups)), count[groups] // 2]
    return found


def robust_sigma(values: np.ndarray) -> float:
    """Estimate the standard deviation of values from their median absolute deviation, which outliers hardly affect."""
    if not len(values):
        return MIN_NOISE_M
    return max(sigma_by_median(values - np.median(values)), MIN_NOISE_M)


def cross_slope(t: np.ndarray, across: np.ndarray, height: np.ndarray, head_width_m: float) -> np.ndarray:
    """Fit the slope of the top across the head, rise per metre to the left, (n,), due to cant and inclination.

    Points are given by chainage, increasing, offset to the left of the axis, and height above the rough level, metres.
    """
    crown = np.abs(across) <= CROWN_SHARE * head_width_m
    limit = OFF_TOP_SIGMAS * robust_sigma(height[crown])
    number = np.floor((t - t[0]) / LEVEL_BIN_M).astype(int)
    slope, level = np.zeros(len(t)), np.full(len(t), np.median(height[crown]) if crown.any() else 0.0)
    for _ in range(SLOPE_ROUNDS):
        on_top = crown & (np.abs(height - level - slope * across) <= limit)
        slope, level = _moving_fit(number, on_top, across, height, limit / OFF_TOP_SIGMAS)
    return slope


def _moving_fit(
    number: np.ndarray, used: np.ndarray, x: np.ndarray, y: np.ndarray, noise: float
) -> tuple[np.ndarray, np.ndarray]:
    """Fit y = level + slope x in windows of bins; returns slope and level at each point."""
    moments = np.stack([np.ones_like(x), x, y, x * x, x * y])[:, used]
    size = int(number[-1]) + 1
    sums = np.stack([np.bincount(number[used], row, minlength=size) for row in moments])
    sums = uniform_filter1d(sums, SLOPE_BINS, axis=1, mode="constant") * SLOPE_BINS
    count, x_sum, y_sum, xx, xy = sums
    count = np.maximum(count, 1e-9)
    slope = (xy - x_sum * y_sum / count) / (xx - x_sum**2 / count + (noise / PRIOR_SLOPE) ** 2)
    level = (y_sum - slope * x_sum) / count
    return slope[number], level[number]
