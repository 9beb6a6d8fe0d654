"""Edges of the railhead and the middle between them, from histograms of points across the line; and blunt heads.

Edges are those of docs/method.md section 6.2. Beams from the air and dense matching of photographs blur a head to a
ridge, which is a parabola across; its crest is the axis. See docs/method.md section 6.10.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from .head_points import BLUR_BINS, HALF_HEAD_BINS, HALF_RANGE_BINS, STATION_STEP_M, HeadPoints
from .level import OFF_TOP_SIGMAS, SLOPE_ROUNDS, robust_sigma, rough_level

MAX_SHIFT_BINS = 15
"""Largest shift of a line, about 3 cm: half a cell of the raster and a little noise."""

BLURRED_BINS, RIM_BINS = 3, 9
"""Bins next to an edge that are affected by its blur, and bins beyond these that give the density on either side."""

MAX_OUTSIDE_SHARE = 0.4
"""Maximum density outside an edge relative to that inside; with more, no edge is visible."""

MIN_RIM_POINTS = 6
"""Minimum number of points just inside an edge."""

MIN_RIM_SHARE = 0.5
"""Minimum density just inside an edge relative to that on the crown: a shadow on the head has edges of its own."""

EVEN_EXCESS, ASKEW_EXCESS = 0.05, 0.3
"""Relative excess of the density at one edge over that at the other from which the weight of the other decreases, and
from which it is zero: a scanner abreast of the rail sees both corners alike, one at 45 degrees half of the far one."""

INSET_BINS = 1.6
"""How far inside the edge of a head the round corner ends what is level with its top, where no part of the line shows
both edges: 3 mm, less where noise of 8 mm also takes points deeper on the corner for points on top."""

VIEW_STATIONS = 161
"""Stations, 40 m, over which the excess is averaged: a scanner on a train keeps its view, and 60 points give the excess
to 20 % only."""

EDGE_SIGMA_M = 0.0012
"""Standard error of the middle between edges that more points would not reduce: how much of the corners is seen depends
on the view. Seen from above a track, the left and the right corner differ by 1.7 mm."""

EDGE_ROUNDS = 2
"""The first round finds out how the scanner sees the head, the second uses the edges that count."""

REACH_HEADS, TOP_HEADS = 1.0, 0.4
"""Distances from the line, in head widths, within which the ridge is a parabola, as a Gaussian of 7 cm is to a tenth,
and within which points are on the top. Those beyond it show what lies beside the head, too, which may differ on both
sides: a road, or echoes of beams that only an edge of the head meets, as high as the head."""

ASIDE_SIGMAS = 3.0
"""Standard errors by which the crest of the top must differ from that of all points to be the right one: the points on
the top of a line of a few metres show it to 5 mm only."""

LEAST_ON_RIDGE = 8
"""Least points that a parabola is fitted to, whose three unknowns they determine with as many to spare."""

WINDOW = 33
"""Stations that share one crest, 8.25 m: 16 mm of noise moves the crest by 3 mm over this length, and by 6 mm over 2 m.
The line itself follows curves; only its offsets are averaged."""

MIN_BEND = 0.5
"""Least bend of the parabola, 1/m: a radius of 2 m. A flatter top has no crest."""

CREST_SIGMA_M = 0.003
"""Standard error of a crest that more points would not reduce: a blur of 4 cm blends a head with ballast that is higher
by 2 or 3 cm on one side, and an oblique beam with what it sees on its own side of the rail."""

LEAST_POINTS = 1e-6
"""Points that the fit of a window is short of: it keeps the fit finite where none are seen."""

WIDE_WINDOW = 9
"""Stations, 2.25 m, over which it is measured how far a ridge is bent: check rails are 3 m long and more."""

MOST_BENT = 0.25
"""Quantile of the windows of a line whose bend is that of a single head: up to half of a short line may be wide."""

WIDE_BEND = 0.67
"""Bend of a ridge by that of a single head below which it is wider. Two heads side by side, as of a check or wing rail,
make a ridge whose crest is 10 to 60 mm off the axis (median in seven worlds from images); from 0.75 on, it is 5 to 7 mm
off. Half of it, as bent as a head on one side only, is bent by 0.5."""

WIDE_SIGMA_M = 0.04
"""Standard error of a metre of line along such a ridge: it stays where it was drawn, in a cell of the raster."""

TILT = 0.035
"""Standard deviation of the slope across of tracks, whose cant is up to 90 mm. A blurred head does not show it, and its
crest moves to the higher side, by slope over bend."""

LEANING_M = 0.008
"""Standard deviation of the mean of the points about the crest: labels lean to the side on which the bed is higher.
Where noise hides the crest, the mean says more."""


def edge_middles(points: HeadPoints, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the middle between the edges of a head at its stations; `free`, (2, s), says where either can be seen.

    Returns metres to the left of the line, (s,), NaN where no edges are visible, and the inverse of the variance that
    the points next to a station alone contribute, (s,) 1/m². The densities come from the long windows, because the
    scanner's view of the head changes slowly along the line.
    """
    (top, noise_m), (counts, wide_counts) = points.top, points.histograms
    bin_m, wide = points.width_m / (2 * HALF_HEAD_BINS), np.maximum(wide_counts.sum(axis=1), 1)
    edges = CrossSections.of(wide_counts).find_edges(free)
    own = replace(edges, density=edges.density * (counts.sum(axis=1) / wide))
    middle = CrossSections.of(counts).middles(own) + edges.inset
    middle = np.where(edges.seen & (np.abs(middle) < MAX_SHIFT_BINS), middle, np.nan)
    density = edges.density * (points[top].per_station() / wide) / bin_m
    return middle * bin_m, _information(density, edges.weight, noise_m, BLUR_BINS * bin_m)


def _information(density: np.ndarray, weight: np.ndarray, noise_m: float, blur_m: float) -> np.ndarray:
    """Return the inverse of the variance of the middle between both edges that is due to chance, (s,) 1/m².

    An edge, of the given weight, (2, s), is where the blurred density, (2, s) points per metre across, falls to half.
    There the density has, like any count, the variance density / (4 √π blur), and it falls by density / (√2π spread)
    per metre; the spread of the edge comes from blur and noise.
    """
    spread_m = np.hypot(blur_m, noise_m)
    variance = np.sqrt(np.pi) * spread_m**2 / (2 * blur_m * np.maximum(density, 1e-9))
    return np.sum(weight, axis=0) ** 2 / np.maximum(np.sum(weight**2 * variance, axis=0), 1e-12)


@dataclass(frozen=True)
class Edges:
    """Right and left edge of the head in s windows.

    `density`, (2, s), is in points per bin just inside the edge. `weight`, (2, s), is 0 to 1: the edge that faces the
    scanner counts fully, while the corner of the other is hardly visible; `seen`, (s,), holds where the edges that
    count are visible. `inset`, (s,), corrects a middle found from one edge alone, in bins to the left: the round corner
    hides part of the head.
    """

    density: np.ndarray
    weight: np.ndarray
    seen: np.ndarray
    inset: np.ndarray

    @classmethod
    def initial(cls, free: np.ndarray) -> Edges:
        """Return equal weights for all edges that are `free`, (2, s) bool: those of the first round."""
        return cls(np.ones(free.shape), free.astype(float), free[0] | free[1], np.zeros(free.shape[1]))


@dataclass(frozen=True)
class CrossSections:
    """Cumulative counts across the line at the borders of the bins, (s, 2 HALF_RANGE_BINS + 1)."""

    sums: np.ndarray

    @classmethod
    def of(cls, counts: np.ndarray) -> CrossSections:
        """Sum up the counts of windows, (s, 2 HALF_RANGE_BINS)."""
        return cls(np.pad(np.cumsum(counts, axis=1), ((0, 0), (1, 0))))

    def middles(self, edges: Edges) -> np.ndarray:
        """Find the middle of the head whose edges are where the density falls to half, (s,) in bins to the left.

        All shifts are evaluated at once: the best one maximizes the integral, over the shift, of the difference between
        the density at each edge and half of that just inside it.
        """
        shifts = np.arange(-MAX_SHIFT_BINS - 1, MAX_SHIFT_BINS + 2)
        held = np.zeros((len(self.sums), len(shifts)))
        for side, density, weight in zip((-1, 1), edges.density, edges.weight):
            within = self.sums[:, HALF_RANGE_BINS + shifts + side * HALF_HEAD_BINS] / np.maximum(density, 1e-6)[:, None]
            held += side * weight[:, None] * (within - shifts / 2)
        rows = np.arange(len(held))
        top = np.clip(np.argmax(held, axis=1), 1, len(shifts) - 2)
        before, at, after = (held[rows, top + step] for step in (-1, 0, 1))
        bend = np.maximum(2 * at - before - after, 1e-9)
        return shifts[top] + np.clip(0.5 * (after - before) / bend, -1, 1)

    def find_edges(self, free: np.ndarray) -> Edges:
        """Find the edges and their weights among those that are `free`, (2, s) bool."""
        edges = Edges.initial(free)
        for _ in range(EDGE_ROUNDS):
            edges = self._edges_of(self.middles(edges), free)
        return replace(edges, inset=self._inset(edges, free))

    def _inset(self, edges: Edges, free: np.ndarray) -> np.ndarray:
        """Return the correction for heads with one free edge, (s,): measured on that edge where both are free."""
        whole = edges.seen & free.all(axis=0)
        inset = np.zeros(len(whole))
        middle = self.middles(edges)
        for side, outward in enumerate((-1, 1)):
            alone = replace(edges, weight=np.eye(2)[side][:, None] * np.ones(len(whole)))
            seen = (middle - self.middles(alone))[whole]
            inset[free[side] & ~free[1 - side]] = np.median(seen) if len(seen) else outward * INSET_BINS
        return inset

    def _edges_of(self, middle: np.ndarray, free: np.ndarray) -> Edges:
        """Evaluate the edges of heads at `middle`, (s,) bins to the left."""
        centre = np.round(middle).astype(int)
        inside = np.array([self._density(centre + side * (HALF_HEAD_BINS - BLURRED_BINS), -side) for side in (-1, 1)])
        beyond = np.array([self._density(centre + side * (HALF_HEAD_BINS + BLURRED_BINS), side) for side in (-1, 1)])
        crown = self._density(centre - RIM_BINS // 2, 1)
        both = free.all(axis=0)
        excess = _excess(uniform_filter1d(inside * both, VIEW_STATIONS, axis=1, mode="nearest"))
        weight = 1 - np.clip((excess - EVEN_EXCESS) / (ASKEW_EXCESS - EVEN_EXCESS), 0, 1)
        weight = np.where(both, weight, free)  # a single free edge has nothing to be compared with
        clear = (
            (inside >= MIN_RIM_SHARE * crown)
            & (beyond <= MAX_OUTSIDE_SHARE * inside)
            & (inside * RIM_BINS >= MIN_RIM_POINTS)
        )
        return Edges(inside, weight, np.all(clear | (weight == 0), axis=0) & free.any(axis=0), np.zeros(len(centre)))

    def _density(self, start: np.ndarray, direction: int) -> np.ndarray:
        """Return the points per bin on the RIM_BINS bins from `start`, (s,), to the left (1) or to the right (-1)."""
        rows = np.arange(len(start))
        start = start + HALF_RANGE_BINS
        return np.abs(self.sums[rows, start + direction * RIM_BINS] - self.sums[rows, start]) / RIM_BINS


def _excess(density: np.ndarray) -> np.ndarray:
    """Return the relative excess of density at the other edge, (2, s)."""
    return density[::-1] / np.maximum(density, 1e-6) - 1


@dataclass(frozen=True)
class Ridge:
    """The crest of a blunt head along its line, at equidistant chainages as in `HeadPoints.stations`, (s,) each.

    `offset_m` is the offset of the crest to the left of the line that the points next to a station alone show, and
    `information` the inverse of its variance by the noise of single points, 1/m², 0 where no points are near.
    `common_m` is the standard error that more points would not reduce.
    """

    t: np.ndarray
    offset_m: np.ndarray
    information: np.ndarray
    common_m: np.ndarray

    @classmethod
    def find(cls, points: HeadPoints) -> Ridge | None:
        """Fit one parabola, and a crest for each window, to points; None with too few, or if they are not blunt.

        Next to another head, both are one ridge, whose crest is between them: where it is wider than one head, the line
        stays as it is. Points on the top decide alone where those beside it draw the crest of the line aside.
        """
        near = points[points.within(REACH_HEADS)]
        near = near[near.alone] if np.count_nonzero(near.alone) >= LEAST_ON_RIDGE else near
        if not points.is_blunt or len(near.t) < LEAST_ON_RIDGE:
            return None
        sums = np.array([near.per_station().astype(float), near.per_station(near.across)])
        count, across = uniform_filter1d(sums, WINDOW, axis=1, mode="constant")
        likely, top = across / np.maximum(count, 1e-9), near[near.within(TOP_HEADS)]
        up = _above_level(near)
        crest, information, bend = _fitted(near, up, likely)
        if len(top.t) >= LEAST_ON_RIDGE:
            of_top = _fitted(top, _above_level(top), likely)
            doubt_m = np.hypot(CREST_SIGMA_M, ASIDE_SIGMAS / np.sqrt(of_top[1].sum()))
            if abs(np.average(of_top[0] - crest, weights=of_top[1])) > doubt_m:
                crest, information, bend = of_top
        wide = _are_wide(near, up)
        crest[wide], information[wide] = 0.0, STATION_STEP_M / WIDE_SIGMA_M**2
        return cls(near.stations, crest, information, np.full(len(crest), np.hypot(CREST_SIGMA_M, TILT / bend)))


def _above_level(points: HeadPoints) -> np.ndarray:
    """Return the heights of points above the rough level of their line, (n,) metres."""
    return points.z - rough_level(points.t, points.z)


def _fitted(near: HeadPoints, up: np.ndarray, likely: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the crest at each station and the information about it, (s,) each, and the bend of the parabola.

    `up`, (n,), are the heights of the points above the rough level of the line.
    """
    row, x = near.station, near.across
    used = np.ones(len(x), dtype=bool)
    for _ in range(SLOPE_ROUNDS):
        bend = max(-2 * float(np.polynomial.polynomial.polyfit(x[used], up[used], 2)[2]), MIN_BEND)
        flat = up + 0.5 * bend * x**2
        noise_m = robust_sigma(flat[used])
        level, slope, crest, information = _crests(row[used], likely, x[used], flat[used], bend, noise_m)
        off = np.abs(flat - level[row] - slope[row] * x) > OFF_TOP_SIGMAS * noise_m
        if np.count_nonzero(~off) < LEAST_ON_RIDGE:
            break
        used = ~off
    return crest, information, bend


def _are_wide(near: HeadPoints, up: np.ndarray) -> np.ndarray:
    """Return at which stations the ridge is certainly bent less than that of a single head, (s,) bool.

    Where few points are seen, the standard error of a window is larger than this difference: then none is.
    """
    x = near.across / near.width_m
    terms = np.stack([np.ones_like(x), x, x**2])
    whole, count = np.linalg.lstsq(terms.T, up, rcond=None)[0], len(terms)
    sums = np.array([near.per_station(one * other) for one in terms for other in (*terms, up)])
    windows = uniform_filter1d(sums, WIDE_WINDOW, axis=1, mode="constant") * WIDE_WINDOW
    normal, right = np.split(windows.T.reshape(-1, count, count + 1), [count], axis=2)
    inverse = np.linalg.inv(normal + LEAST_POINTS * np.eye(count))
    curve, error = (inverse @ right)[:, 2, 0], robust_sigma(up - whole @ terms) * np.sqrt(inverse[:, 2, 2])
    seen = normal[:, 0, 0] >= LEAST_ON_RIDGE
    if not seen.any():
        return seen
    single = min(float(np.quantile(curve[seen], MOST_BENT)), 0.0)
    wide = (curve - error > WIDE_BEND * single) & (error < (WIDE_BEND - 1) * single)
    return minimum_filter1d(maximum_filter1d(wide, WIDE_WINDOW), WIDE_WINDOW)  # without gaps shorter than a window


def _crests(
    row: np.ndarray, likely: np.ndarray, x: np.ndarray, flat: np.ndarray, bend: float, noise_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Fit level and slope across to the points of each window, and the crest to those of each station, (s,) each.

    The fourth array is the information about the crest, 1/m²: from the offsets of the points about their mean, and from
    the prior of the window, by which the crest is at its `likely` place, (s,).
    """
    rows = len(likely)
    sums = np.array([np.bincount(row, one, rows) for one in (np.ones_like(x), x, flat, x * x, x * flat)])
    count, sx, sy, xx, xy = uniform_filter1d(sums, WINDOW, axis=1, mode="constant") * WINDOW
    count = np.where(count > 0.5, count, np.inf)
    mean, level = sx / count, sy / count
    prior_m2 = (noise_m / bend / LEANING_M) ** 2
    slope = (xy - mean * sy + prior_m2 * bend * likely) / (xx - mean * sx + prior_m2)
    points, sx, sy, xx, xy = sums
    own_prior = prior_m2 / WINDOW * (count < np.inf)
    spread = xx - 2 * mean * sx + points * mean**2 + own_prior
    product = xy - mean * sy - level * sx + points * mean * level + own_prior * bend * likely
    crest = product / (bend * np.maximum(spread, 1e-12))
    return level - slope * mean, slope, crest, spread * (bend / noise_m) ** 2
