"""How far a rail's line may lie beside the head's axis: one standard deviation at stations along it.

Four parts, each independent of the others: how few and noisy points draw the edges (sampling), how much the answer
hangs on one edge that alone is seen well (view), how far away the nearest points are (bridging), and how far off the
middle between the edges is from the line as it stands (remainder). Where no edges are seen, none of them is known.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..lines.smoothing import smooth_profile
from ..polyline import distance_to
from ..rails import Support
from .edges import BLUR_BINS, HALF_HEAD, STATION_M, Heads, histograms
from .level import on_top

VARIANCE_FACTOR = 0.33375
"""Of independent points `spacing` apart, PAEK's result has this variance times spacing / sigma (docs/method.md
section 5.3)."""


def measure_support(
    t: np.ndarray,
    across: np.ndarray,
    z: np.ndarray,
    length_m: float,
    head_width_m: float,
    smoothing_m: float,
    unseen_m: float,
    free: np.ndarray,
) -> Support:
    """Measure how well points support a line.

    Parameters
    ----------
    t, across, z : (n,) arrays
        Points near the line: chainage, increasing, offset to its left, and height; metres.
    length_m : float
        Plan length of the line.
    head_width_m : float
    smoothing_m : float
        Sigma of PAEK that smoothed the line in plan.
    unseen_m : float
        Standard deviation of the line where the points show no edges of a head.
    free : (2, s) bool array
        Where its right and left edge stand free of other heads; see `neighbours.free_edges`.

    Returns
    -------
    Support
    """
    top, noise_m = on_top(t, across, z, head_width_m)
    stations, counts, wide_counts = histograms(t[top], across[top], length_m, head_width_m)
    points = np.bincount(np.minimum((t[top] / STATION_M).astype(int), len(stations) - 1), minlength=len(stations))
    heads, bin_m = Heads.of(wide_counts), head_width_m / (2 * HALF_HEAD)
    edges = heads.seen_edges(free)
    middle = edges.narrowed(counts, wide_counts)
    known = np.isfinite(middle)
    if known.sum() < 2:
        return Support(stations, points, np.full(len(stations), unseen_m))
    averaged = np.maximum(_averaged(points, smoothing_m), counts.sum(axis=1))
    share = averaged / np.maximum(wide_counts.sum(axis=1), 1)
    sampling = _sampling(edges.density * share / bin_m, edges.weight, noise_m, BLUR_BINS * bin_m)
    view = (heads.best(edges) - heads.best(edges.alike(free))) * bin_m / np.sqrt(3)
    bridging = sampling * distance_to(t[top], stations) / smoothing_m
    remainder = smooth_profile(stations[known], middle[known] * bin_m, smoothing_m, stations)
    sigma = np.sqrt(sampling**2 + view**2 + bridging**2 + remainder**2)
    return Support(stations, points, np.where(known, np.minimum(sigma, unseen_m), unseen_m))


def _averaged(points: np.ndarray, smoothing_m: float) -> np.ndarray:
    """Count the points that PAEK averages at each station: as many as an even mean over its length would, (s,)."""
    size = max(int(round(smoothing_m / VARIANCE_FACTOR / STATION_M)), 1)
    return uniform_filter1d(points.astype(float), size, mode="constant") * size


def _sampling(density: np.ndarray, weight: np.ndarray, noise_m: float, blur_m: float) -> np.ndarray:
    """Estimate how far chance moves the middle between both edges, (s,), given (2, s) points a metre across.

    An edge is where the blurred density falls to half. There it varies, as counts do, by density / (4 √π blur), and
    falls by density / (√2π spread) a metre, with the spread that blur and noise together give the edge.
    """
    spread_m = np.hypot(blur_m, noise_m)
    variance = np.sqrt(np.pi) * spread_m**2 / (2 * blur_m * np.maximum(density, 1e-9))
    return np.sqrt(np.sum(weight**2 * variance, axis=0)) / np.maximum(np.sum(weight, axis=0), 1e-9)
