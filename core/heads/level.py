"""Rough level, noise and slope across of one railhead, estimated while its line is still inexact.

See docs/method.md section 6.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from scipy.ndimage import median_filter, uniform_filter1d

from .outline import CROWN_RADIUS_M

LEVEL_BIN_M = 0.5
"""Length of the bins: a handful of points on the sparsest rail, and at most 2 cm of height at 4 % gradient."""

MEDIAN_BINS = 5
"""Bins in the running median: weeds up to 1 m long cannot lift the level."""

OTHER_RAIL_M, OTHER_RAIL_BINS = 1.0, 41
"""Bins that differ by more than this from the median of this number of bins, 20 m of rail, belong to a rail on a bridge
above or below: no rail rises so steeply, and the part that a bridge hides is shorter."""

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

MIN_ON_HEAD = 80
"""Points needed on a head to find its top; fewer do not determine a slope."""

MAX_DEPTH_M, MAX_DEPTH_SIGMAS = 0.006, 1.5
"""Depth below the top, in metres and in standard deviations of the noise, beyond which a point may be on a side face or
a corner. Tighter than the noise requires: points on top are lost evenly across the head, so the estimate stays
unbiased."""

MAX_ABOVE_SIGMAS = 3.0
"""Height above the top, in standard deviations of the noise, beyond which a point is a weed."""

BLENDED_M = 0.006
"""Fall of both rims of a head below its crown from which beams blend the head and the ballast, as those from the air
do. Seen by narrow beams, the round corners fall by 1 to 2 mm, and the rim of a line that is off the head by more, but
not both."""

CROWN_HEADS, RIM_HEADS, SHOULDER_HEADS = 0.2, (0.3, 0.5), (0.55, 0.75)
"""Parts of the head width on either side of the axis: the crown, the rims, and what is beyond a head that is not
blurred."""

LEAST_INFORMATION = 1e-6
"""Information about level, slope and fall of a crown that is always there, so that few points are enough."""

SHOULDER_SHARE = 0.2
"""Points per width on either shoulder, as a share of those on the crown, from which a blurred head goes on there."""


@dataclass(frozen=True)
class Crown:
    """How the top of a head falls beside its axis: in proportion to the square of the distance, up to the rims.

    Attributes
    ----------
    bend, sigma : float
        Fall per square of the distance, and its standard error, 1/m.
    rim_m : float
        Distance from the axis up to which the top falls.
    """

    bend: float
    sigma: float
    rim_m: float

    def fall(self, across: np.ndarray) -> np.ndarray:
        """Return how far points are lower than the axis of their head because they are beside it, (n,) metres."""
        return self.bend * np.minimum(np.abs(across), self.rim_m) ** 2

    def error(self, head_width_m: float) -> float:
        """Return the standard error of the height on the axis, metres, from points up to `AXIS_SHARE` beside it."""
        return self.sigma * (AXIS_SHARE * head_width_m) ** 2 / 3


def rough_level(t: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the height of most points around each point: medians of short bins, filtered by a running median.

    The trend of the line is removed before and added again, so that the ends of a gradient are kept.

    Parameters
    ----------
    t : (n,) array
        Chainage in metres, increasing.
    z : (n,) array

    Returns
    -------
    (n,) array
    """
    number = np.floor((t - t[0]) / LEVEL_BIN_M).astype(int)
    first = np.concatenate([[0], np.flatnonzero(np.diff(number)) + 1])
    count = np.diff(np.append(first, len(t)))
    middle_t = t[first + count // 2]
    level = medians(z, first, count)
    trend = Polynomial.fit(middle_t, level, 1) if len(middle_t) > MEDIAN_BINS else Polynomial([0.0])
    return trend(t) + np.interp(t, middle_t, _median_filtered(middle_t, level - trend(middle_t)))


def medians(values: np.ndarray, first: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Return the median of each group of successive values, (k,); of an even number, the upper one of the middle two.

    Sorting short rows is several times as fast as sorting all values by their group.

    Parameters
    ----------
    values : (n,) array
    first, count : (k,) int arrays
        First value and number of values of each group, at least one; the groups follow each other without gaps.
    """
    found = np.empty(len(count))
    order = np.argsort(count, kind="stable")
    for groups in np.split(order, np.flatnonzero(np.diff(np.log2(count[order]).astype(int))) + 1):
        filled = np.full((len(groups), count[groups[-1]]), np.inf)
        own = np.arange(filled.shape[1]) < count[groups, None]
        filled[own] = values[(first[groups, None] + np.arange(filled.shape[1]))[own]]
        found[groups] = np.sort(filled, axis=1)[np.arange(len(groups)), count[groups] // 2]
    return found


def _median_filtered(t: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Apply a running median to heights without their trend, and leave out those of another rail."""
    own = np.abs(level - median_filter(level, OTHER_RAIL_BINS, mode="nearest")) <= OTHER_RAIL_M
    if own.any():
        level = np.interp(t, t[own], level[own])
    return median_filter(level, MEDIAN_BINS, mode="nearest")


def is_blended(t: np.ndarray, across: np.ndarray, z: np.ndarray, head_width_m: float) -> bool:
    """Return whether heights fall from the crown to both sides, so that the head has no edges that could be seen.

    Beams from the air show this on the rims of the head, dense matching of photographs on shoulders beyond them.
    """
    near = np.abs(across) <= SHOULDER_HEADS[1] * head_width_m
    head = np.abs(across[near]) <= RIM_HEADS[1] * head_width_m
    if head.sum() < MIN_ON_HEAD:
        return False
    level = rough_level(t[near][head], z[near][head])
    above, heads = z[near] - np.interp(t[near], t[near][head], level), across[near] / head_width_m
    crown = np.abs(heads) < CROWN_HEADS
    if not crown.any():
        return False
    for low, high in (RIM_HEADS, SHOULDER_HEADS):
        sides = [(side * heads > low) & (side * heads <= high) for side in (1, -1)]
        least = max(SHOULDER_SHARE * (high - low) / (2 * CROWN_HEADS) * crown.sum(), 1) if low > RIM_HEADS[0] else 1
        if min(side.sum() for side in sides) >= least:
            fall_m = np.median(above[crown]) - max(np.median(above[side]) for side in sides)
            if fall_m > BLENDED_M:
                return True
    return False


def fit_crown(t: np.ndarray, across: np.ndarray, z: np.ndarray, head_width_m: float) -> Crown:
    """Fit a parabola to the crown of a head.

    New crowns have a radius, and worn ones are flatter. Where beams blend the head and the ballast, the share of the
    ballast grows with the distance from the axis, and the fall may be of any size.

    Parameters
    ----------
    t, across, z : (n,) arrays
        Chainage (increasing), offset to the left and height of points near the line, metres.
    head_width_m : float
    """
    usual, rim_m = 0.5 / CROWN_RADIUS_M, RIM_HEADS[0] * head_width_m
    near = np.abs(across) <= rim_m
    if not near.any():
        return Crown(usual, usual, rim_m)
    expected = np.array([0.0, 0.0, 0.0 if is_blended(t, across, z, head_width_m) else usual**-2])
    above, powers = z[near] - rough_level(t[near], z[near]), np.vander(across[near], 3, increasing=True)
    used, off = np.ones(len(above), dtype=bool), above
    for _ in range(SLOPE_ROUNDS):
        noise_m = robust_sigma(off[used])
        information = powers[used].T @ powers[used] / noise_m**2 + np.diag(expected + LEAST_INFORMATION)
        covariance = np.linalg.inv(information)
        found = covariance @ (powers[used].T @ above[used] / noise_m**2 - expected * usual)
        off = above - powers @ found
        used = np.abs(off) <= OFF_TOP_SIGMAS * robust_sigma(off)
    return Crown(max(-found[2], 0.0), float(np.sqrt(covariance[2, 2])), rim_m)


def robust_sigma(values: np.ndarray) -> float:
    """Estimate the standard deviation of values from their median absolute deviation, which outliers hardly affect."""
    if not len(values):
        return MIN_NOISE_M
    return max(1.4826 * float(np.median(np.abs(values - np.median(values)))), MIN_NOISE_M)


def cross_slope(t: np.ndarray, across: np.ndarray, height: np.ndarray, head_width_m: float) -> np.ndarray:
    """Fit the slope of the top across the head, which comes from cant and from the inclination of the rail.

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
    limit = OFF_TOP_SIGMAS * robust_sigma(height[crown])
    number = np.floor((t - t[0]) / LEVEL_BIN_M).astype(int)
    slope, level = np.zeros(len(t)), np.full(len(t), np.median(height[crown]) if crown.any() else 0.0)
    for _ in range(SLOPE_ROUNDS):
        on_top = crown & (np.abs(height - level - slope * across) <= limit)
        slope, level = _moving_fit(number, on_top, across, height, limit / OFF_TOP_SIGMAS)
    return slope


def on_top(t: np.ndarray, across: np.ndarray, z: np.ndarray, head_width_m: float) -> tuple[np.ndarray, float]:
    """Find the points on the top of the head, allowing for its slope across, and their noise.

    Parameters
    ----------
    t, across, z : (n,) arrays
        Chainage (increasing), offset to the left and height of points near the line, metres.
    head_width_m : float

    Returns
    -------
    top : (n,) bool array
    noise_m : float
        Standard deviation of their heights.
    """
    head = np.abs(across) <= 0.5 * head_width_m
    if head.sum() < MIN_ON_HEAD:
        return np.zeros(len(t), dtype=bool), MIN_NOISE_M
    above = z - np.interp(t, t[head], rough_level(t[head], z[head]))
    slope = np.interp(t, t[head], cross_slope(t[head], across[head], above[head], head_width_m))
    flat = above - slope * across
    flat -= np.interp(t, t[head], rough_level(t[head], flat[head]))
    noise = robust_sigma(flat[head & (np.abs(flat) < 2 * MAX_DEPTH_M)])
    noise = robust_sigma(flat[head & (np.abs(flat) < max(2 * MAX_DEPTH_M, OFF_TOP_SIGMAS * noise))])
    lowest, highest = -max(MAX_DEPTH_M, MAX_DEPTH_SIGMAS * noise), max(MAX_DEPTH_M, MAX_ABOVE_SIGMAS * noise)
    return (flat >= lowest) & (flat <= highest), noise


def in_head_frame(
    t: np.ndarray, across: np.ndarray, z: np.ndarray, head_width_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points in the frame of their head: offset to the left and height from the top on the line, (n,) each.

    The third array is the height of the top on the line, (n,). All are NaN if the crown has too few points.

    Parameters
    ----------
    t, across, z : (n,) arrays
        Chainage (increasing), offset to the left and height of points near the line, metres.
    head_width_m : float
    """
    head = np.abs(across) <= 0.5 * head_width_m
    crown = np.abs(across) <= AXIS_SHARE * head_width_m
    if crown.sum() < MIN_ON_HEAD:
        nothing = np.full(len(t), np.nan)
        return nothing, nothing, nothing
    above = z - np.interp(t, t[crown], rough_level(t[crown], z[crown]))
    slope = np.interp(t, t[head], cross_slope(t[head], across[head], above[head], head_width_m))
    flat = above - slope * across
    flat -= np.interp(t, t[crown], rough_level(t[crown], flat[crown]))
    return across + slope * flat, flat, z - slope * across - flat


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
