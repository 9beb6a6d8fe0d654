"""Standard error of a rail's line across the head's axis, at stations along the line.

It has six independent parts: the number and noise of the points at the edges or on the outline (sampling), what all
stations of a section share, because the parts of the head that the scanner sees are not known exactly (view), the
distance to the nearest points (bridging), the distance between the line and the middle of the head (remainder), what
the windows are too long to show (wander), and the curvature of bridges, which nothing shows. Only the last is known
where no edges are visible. See docs/method.md section 6.6.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from ..lines.paek import VARIANCE_FACTOR
from ..lines.smoothing import smooth_profile
from ..polyline import distance_to
from ..rails import Support
from .edges import BLUR_BINS, HALF_HEAD_BINS, STATION_STEP_M, VIEW_STATIONS, CrossSections, histograms
from .flank import FLANK_TOP_SIGMA_M, Flank
from .level import on_top
from .roads import MIN_WIDER_M, bands, hidden_edges
from .sections import Middles, outline_middles, with_outline

UNSURE_CURVATURE = 0.007
"""Standard error, 1/m, of the curvature of a bridge across a gap, which follows from the lines on either side. On the
scene `gaps`, with gaps of 1.5 to 4.5 m in a curve of 250 m with transitions, errors in the middle are 1.6 to 20 mm."""

TOP_SIGMA_M = 0.0002
"""Standard error of the height that does not depend on the points: worn crowns are flatter than new ones."""

UNSURE_GRADIENT_CHANGE = 1e-4
"""The same as `UNSURE_CURVATURE` for the height, 1/m: vertical curves have radii of 2 to 20 km, settled track has waves
of 10 mm that are 60 m long."""

ALONE_SIGMA_M = 0.0012
"""Standard error of the middle that comes from a single edge: how much of its corner is seen depends on the view. Seen
from above a track, the left and the right corner differ by 1.7 mm."""

BESIDE_HEADS = 0.5
"""Standard error, in head widths, of a line that follows what covers a head: wheels and flangeways are next to it."""


def measure_support(
    t: np.ndarray,
    across: np.ndarray,
    z: np.ndarray,
    length_m: float,
    head_width_m: float,
    smoothing_m: float,
    unseen_m: float,
    free: np.ndarray,
    near: np.ndarray | None = None,
    marked: bool = False,
) -> Support:
    """Measure how well points support a line.

    Parameters
    ----------
    t, across, z : (n,) arrays
        Chainage (increasing), offset to the left and height of points near the line, metres.
    length_m : float
        Plan length of the line.
    head_width_m : float
    smoothing_m : float
        Sigma of PAEK that smoothed the line in plan.
    unseen_m : float
        Standard deviation of the line where no edges of the head are visible.
    free : (2, s) bool array
        Where the right and the left edge are free of other heads; see `neighbours.free_edges`.
    near : (k,) array, optional
        Chainages of these points and of those near the line that are at another height than the rail, increasing.
    marked : bool
        Whether the points state their strips, so that strips are compared elsewhere.

    Returns
    -------
    Support
        Its error of height is only what passes of the scanner differ by; `height_error` is the rest.
    """
    top, noise_m = on_top(t, across, z, head_width_m)
    stations, counts, wide_counts = histograms(t[top], across[top], length_m, head_width_m)
    free = free & ~hidden_edges(t[top], across[top], length_m, head_width_m, free)
    points = np.bincount(np.minimum((t[top] / STATION_STEP_M).astype(int), len(stations) - 1), minlength=len(stations))
    sections, bin_m = CrossSections.of(wide_counts), head_width_m / (2 * HALF_HEAD_BINS)
    edges = sections.find_edges(free)
    by_edges = edges.middles_in(counts, wide_counts) * bin_m
    known = np.isfinite(by_edges)
    unseen = np.hypot(unseen_m, _either_end(wide_counts, head_width_m))
    bridge = bridge_error(t, stations)
    if near is not None and len(near) > len(t):
        # The line follows what covers the head, which lies on it or next to it.
        bridge = np.minimum(bridge, np.hypot(bridge_error(near, stations), BESIDE_HEADS * head_width_m))
    if known.sum() < 2:
        return Support(stations, points, np.hypot(unseen, bridge if len(t) else 0.0))
    averaged = np.maximum(_averaged(points, smoothing_m), counts.sum(axis=1))
    share = averaged / np.maximum(wide_counts.sum(axis=1), 1)
    sampling = _sampling(edges.density * share / bin_m, edges.weight, noise_m, BLUR_BINS * bin_m)
    view = (sections.middles(edges) - sections.middles(edges.equally_weighted(free))) * bin_m / np.sqrt(3)
    by_outline = outline_middles(t, across, z, length_m, head_width_m, known & free.all(axis=0))
    outlined = np.isfinite(by_outline.offset)
    by_chance = 1 / np.sqrt(np.maximum(_combined(by_outline, smoothing_m), 1e-9))
    view = np.hypot(view, np.where(free.sum(axis=0) == 1, ALONE_SIGMA_M, 0.0))
    sampling, view = np.where(outlined, by_chance, sampling), np.where(outlined, by_outline.common, view)
    bridging = sampling * distance_to(t[top], stations) / smoothing_m
    middle = with_outline(by_edges, by_outline)
    remainder = smooth_profile(stations[known], middle[known], smoothing_m, stations)
    beyond_chance = np.maximum(remainder**2 - np.where(outlined, sampling, 0.0) ** 2, 0.0)
    wander = _wander(points, counts.sum(axis=1), head_width_m, smoothing_m)
    sigma = np.sqrt(sampling**2 + view**2 + bridging**2 + beyond_chance + wander**2)
    support = Support(stations, points, np.hypot(np.where(known, sigma, unseen), bridge))
    return support if marked else _with_blur(support, by_outline.blur, by_outline.blur_up)


def _with_blur(support: Support, blur_m: np.ndarray, blur_up_m: np.ndarray) -> Support:
    """Add what blurs the head across and in height, (s,) metres, as of passes of the scanner apart by twice that.

    Next to it, where one of the passes may go on alone, the line is as much in doubt.
    """
    largest_m = np.maximum(blur_m, blur_up_m)
    if not largest_m.any():
        return support
    across_m, up_m = (maximum_filter1d(one, 2 * VIEW_STATIONS + 1) for one in (blur_m, blur_up_m))
    strips = np.column_stack([np.ones(len(blur_m)), np.where(largest_m > 0, 2 * largest_m, np.nan), across_m])
    return replace(support, sigma_m=np.hypot(support.sigma_m, across_m), strips=strips, sigmaz_m=up_m)


def _wander(points: np.ndarray, in_window: np.ndarray, head_width_m: float, smoothing_m: float) -> np.ndarray:
    """Estimate how far a line wanders within the windows in which edges are looked for, (s,) metres.

    The raster draws it through the points that there are: the mean of n that are spread over the head errs by the
    width of the head over the root of 12 n. Of this, windows correct what is longer than they are.

    Parameters
    ----------
    points, in_window : (s,) arrays
        Points on top that are nearest to the stations, and those in the windows.
    head_width_m, smoothing_m : float
    """
    seen = np.flatnonzero(points)
    count = np.maximum(_averaged(points, smoothing_m), 1.0)
    count = count[seen][np.minimum(np.searchsorted(seen, np.arange(len(points))), len(seen) - 1)]
    left = np.clip(1 - count / np.maximum(in_window, 1.0), 0.0, 1.0)
    return head_width_m * np.sqrt(left / (12 * count))


def _combined(middles: Middles, smoothing_m: float) -> np.ndarray:
    """Return the information about the middle in what PAEK averages of the windows at each station, (s,) 1/m²."""
    return np.hypot(_averaged(middles.information, smoothing_m), middles.in_window)


def on_one_face(support: Support, t: np.ndarray, flank: Flank) -> Support:
    """Replace the support of a line whose points, at chainages `t` (n,), are on one face."""
    places = np.minimum((t / STATION_STEP_M).astype(int), len(support.t) - 1)
    points = np.bincount(places, minlength=len(support.t))
    sigma_m = np.hypot(flank.sigma_m, bridge_error(t, support.t))
    return replace(support, points=points, sigma_m=sigma_m, sigmaz_m=np.full(len(points), FLANK_TOP_SIGMA_M))


def height_error(t: np.ndarray, by_chance_m: np.ndarray, slope: np.ndarray, support: Support) -> np.ndarray:
    """Estimate the standard error of a line's height at its stations, (s,) metres.

    Parameters
    ----------
    t, slope : (n,) arrays
        Chainage (increasing) of the points on the head, and the slope of its top across, by which an error across is
        one of height.
    by_chance_m : (s,) array
        Standard error of the smoothed heights of the points.
    support : Support
    """
    bridge = bridge_error(t, support.t) * (UNSURE_GRADIENT_CHANGE / UNSURE_CURVATURE)
    leaning = np.interp(support.t, t, slope) * support.sigma_m
    return np.sqrt(by_chance_m**2 + TOP_SIGMA_M**2 + bridge**2 + leaning**2)


def _either_end(counts: np.ndarray, head_width_m: float) -> np.ndarray:
    """Estimate by how much the middle of a band of points that is wider than a head may be off the head, (s,) metres.

    Road next to a grooved rail is as high as its head, which may be at either end of the band.
    """
    right_m, left_m = bands(counts, head_width_m)
    wider_m = left_m - right_m - head_width_m
    return np.where(wider_m > MIN_WIDER_M, 0.5 * wider_m, 0.0)


def bridge_error(t: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """Estimate by how much a line errs where it has no point at all, (s,) metres: nothing shows its curvature there.

    Between two known places, at distances a and b, an error k of the curvature moves a line by k a b / 2; beyond the
    last known place by k a² / 2.
    """
    after = np.searchsorted(t, stations)
    before_m = stations - np.concatenate([[-np.inf], t])[after]
    behind_m = np.append(t, np.inf)[after] - stations
    nearest_m = np.minimum(before_m, behind_m)
    other_m = np.maximum(before_m, behind_m)
    return UNSURE_CURVATURE * nearest_m * np.where(np.isinf(other_m), nearest_m, other_m) / 2


def _averaged(points: np.ndarray, smoothing_m: float) -> np.ndarray:
    """Sum up points over what PAEK averages at each station, (s,): the length of an equivalent moving average."""
    size = max(int(round(smoothing_m / VARIANCE_FACTOR / STATION_STEP_M)), 1)
    return uniform_filter1d(points.astype(float), size, mode="constant") * size


def _sampling(density: np.ndarray, weight: np.ndarray, noise_m: float, blur_m: float) -> np.ndarray:
    """Estimate the standard deviation of the middle between both edges that is due to chance, (s,) metres.

    An edge is where the blurred density falls to half. There the density has, like any count, the variance density /
    (4 √π blur), and it falls by density / (√2π spread) per metre; the spread of the edge comes from blur and noise.

    Parameters
    ----------
    density : (2, s) array
        Points per metre across, just inside the edges.
    weight : (2, s) array
        Weights of the edges.
    noise_m, blur_m : float
    """
    spread_m = np.hypot(blur_m, noise_m)
    variance = np.sqrt(np.pi) * spread_m**2 / (2 * blur_m * np.maximum(density, 1e-9))
    return np.sqrt(np.sum(weight**2 * variance, axis=0)) / np.maximum(np.sum(weight, axis=0), 1e-9)
