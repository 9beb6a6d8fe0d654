"""Where the middle of a railhead lies: histograms of points across it, and the edges that these show."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d, uniform_filter1d

STATION_M = 0.25
"""Spacing of the windows' middles, a third of the smoothing's length."""

WINDOWS = (5, 9, 17, 33)
"""Lengths of windows in stations, 1.25 to 8.25 m: the shortest with enough points is taken."""

ENOUGH_POINTS = 80
"""Points on top that a window should hold: they give the middle to 2 mm before smoothing."""

HALF_HEAD = 18
"""Bins across half a head: about 2 mm each, finer than any cloud's noise."""

BLUR_BINS = 1.5
"""Sigma of the blur across: with fewer points than bins the best place would jump; the edges stay sharp to 3 mm."""

FURTHEST = 15
"""Largest shift in bins, about 3 cm: half a cell of the raster and a little noise."""

NEAR_EDGE, RIM = 3, 9
"""Bins from the edge that its blur covers, and bins beyond these that tell the density on either side of it."""

CLEAR_EDGE = 0.4
"""Density outside of an edge over that inside, at most: with more there is no edge to be seen."""

LEAST_ON_RIM = 6
"""Points that have to lie just inside of an edge."""

LEAST_RIM = 0.5
"""Density just inside of an edge over that on the crown, at least: a shadow on the head has edges of its own."""

EVEN_EXCESS, ASKEW_EXCESS = 0.05, 0.3
"""Relative excess of density at one edge over the other from which the other counts less, and no longer: a scanner
abreast of the rail sees the corners alike, one at 45 degrees sees half a corner on the far side."""

VIEW = 161
"""Stations, 40 m, that share the excess: a scanner on a train keeps its view, and 60 points tell it to 20 % only."""

SURE_SIGMAS = 2.0
"""Standard deviations by which an excess has to stand out from chance, to count without its neighbours."""

HALF_RANGE = HALF_HEAD + FURTHEST + 2 + NEAR_EDGE + RIM
"""Bins to either side of a line that all of this can reach."""

EDGE_ROUNDS = 2
"""Once to see how the scanner looks at the head, and once more at the edges that count."""


def widest_reach(head_width_m: float) -> float:
    """Distance from a line up to which points take part, metres."""
    return HALF_RANGE * head_width_m / (2 * HALF_HEAD)


def station_count(length_m: float) -> int:
    """Count the stations along a line."""
    return int(length_m / STATION_M) + 1


def stations_along(length_m: float) -> np.ndarray:
    """Middles of the windows along a line, (s,) metres."""
    return (np.arange(station_count(length_m)) + 0.5) * STATION_M


def histograms(
    t: np.ndarray, across: np.ndarray, length_m: float, head_width_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Count points by offset in windows along the line.

    Returns
    -------
    stations : (s,) array
        Middles of the windows, metres.
    counts, wide_counts : (s, 2 HALF_RANGE) arrays
        In the shortest window with enough points and in the longest. Bins of 1 / (2 HALF_HEAD) of a head, the first
        half to the right of the line.
    """
    rows = station_count(length_m)
    row = np.minimum((t / STATION_M).astype(int), rows - 1)
    column = np.floor(across * (2 * HALF_HEAD / head_width_m)).astype(int) + HALF_RANGE
    inside = (column >= 0) & (column < 2 * HALF_RANGE)
    counts = np.bincount(row[inside] * 2 * HALF_RANGE + column[inside], minlength=rows * 2 * HALF_RANGE)
    counts = gaussian_filter1d(counts.reshape(rows, -1).astype(np.float32), BLUR_BINS, axis=1, mode="constant")
    windows = [uniform_filter1d(counts, size, axis=0, mode="constant") * size for size in WINDOWS]
    chosen = windows[-1].copy()
    for window in windows[-2::-1]:
        enough = window.sum(axis=1) >= ENOUGH_POINTS
        chosen[enough] = window[enough]
    return stations_along(length_m), chosen, windows[-1]


def middles(counts: np.ndarray, wide_counts: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Offset of the head's middle in each window, in bins to the left; NaN where its edges are not to be seen.

    How the scanner looks at the head does not change from window to window, so the wide ones tell the densities.
    """
    return Heads.of(wide_counts).seen_edges(free).narrowed(counts, wide_counts)


@dataclass(frozen=True)
class Edges:
    """Right and left edge of the heads in s windows.

    Attributes
    ----------
    density : (2, s) array
        Points a bin just inside of the edge.
    weight : (2, s) array
        From 0 to 1: the edge that the scanner looks at counts fully; of the other one the corner is hardly seen.
    seen : (s,) bool array
        Whether the edges that count are there.
    inset : (s,) array
        What a single edge lacks of half a head, in bins to the left: its corner is round.
    """

    density: np.ndarray
    weight: np.ndarray
    seen: np.ndarray
    inset: np.ndarray

    @classmethod
    def evenly(cls, free: np.ndarray) -> Edges:
        """Take both edges alike where they are `free`, (2, s) bool, for a first look."""
        return cls(np.ones(free.shape), free.astype(float), free.any(axis=0), np.zeros(free.shape[1]))

    def alike(self, free: np.ndarray) -> Edges:
        """Trust both edges alike, whatever is seen of them, where both are free."""
        return replace(self, weight=np.where(free.all(axis=0), 1.0, self.weight))

    def narrowed(self, counts: np.ndarray, wide_counts: np.ndarray) -> np.ndarray:
        """Find the middle in narrower windows than those the edges were seen in, (s,); NaN where they were not."""
        share = counts.sum(axis=1) / np.maximum(wide_counts.sum(axis=1), 1)
        middle = Heads.of(counts).best(replace(self, density=self.density * share)) + self.inset
        return np.where(self.seen & (np.abs(middle) < FURTHEST), middle, np.nan)


@dataclass(frozen=True)
class Heads:
    """Cumulative counts across at the borders of the bins, (s, 2 HALF_RANGE + 1)."""

    sums: np.ndarray

    @classmethod
    def of(cls, counts: np.ndarray) -> Heads:
        """Sum the (s, 2 HALF_RANGE) counts of windows."""
        return cls(np.pad(np.cumsum(counts, axis=1), ((0, 0), (1, 0))))

    def best(self, edges: Edges) -> np.ndarray:
        """Offset of the head whose edges lie where the density falls to half, (s,) in bins to the left of the line.

        Found as the best of all places at once, by the integral over the place of what each edge lacks of its half.
        """
        shifts = np.arange(-FURTHEST - 1, FURTHEST + 2)
        held = np.zeros((len(self.sums), len(shifts)))
        for side, density, weight in zip((-1, 1), edges.density, edges.weight):
            within = self.sums[:, HALF_RANGE + shifts + side * HALF_HEAD] / np.maximum(density, 1e-6)[:, None]
            held += side * weight[:, None] * (within - shifts / 2)
        rows = np.arange(len(held))
        top = np.clip(np.argmax(held, axis=1), 1, len(shifts) - 2)
        before, at, after = (held[rows, top + step] for step in (-1, 0, 1))
        bend = np.maximum(2 * at - before - after, 1e-9)
        return shifts[top] + np.clip(0.5 * (after - before) / bend, -1, 1)

    def seen_edges(self, free: np.ndarray) -> Edges:
        """Find the edges and what they are worth; only those that are `free`, (2, s) bool, are looked at."""
        edges = Edges.evenly(free)
        for _ in range(EDGE_ROUNDS):
            edges = self.edges(self.best(edges), free)
        return replace(edges, inset=self._inset(edges, free))

    def _inset(self, edges: Edges, free: np.ndarray) -> np.ndarray:
        """Correct the place of heads of which one edge is free by what that edge alone tells where both are, (s,)."""
        whole = edges.seen & free.all(axis=0)
        inset = np.zeros(len(whole))
        if not whole.any():
            return inset
        middle = self.best(edges)
        for side in (0, 1):
            alone = replace(edges, weight=np.eye(2)[side][:, None] * np.ones(len(whole)))
            inset[free[side] & ~free[1 - side]] = np.median((middle - self.best(alone))[whole])
        return inset

    def edges(self, middle: np.ndarray, free: np.ndarray) -> Edges:
        """Look at the edges of heads at `middle`, (s,)."""
        centre = np.round(middle).astype(int)
        inside = np.array([self._density(centre + side * (HALF_HEAD - NEAR_EDGE), -side) for side in (-1, 1)])
        beyond = np.array([self._density(centre + side * (HALF_HEAD + NEAR_EDGE), side) for side in (-1, 1)])
        crown = self._density(centre - RIM // 2, 1)
        both = free.all(axis=0)
        shadow = _sure_excess(inside * RIM)
        view = _excess(uniform_filter1d(inside * both, VIEW, axis=1, mode="nearest"))
        excess = np.where(shadow.max(axis=0) > ASKEW_EXCESS, shadow, view)
        weight = 1 - np.clip((excess - EVEN_EXCESS) / (ASKEW_EXCESS - EVEN_EXCESS), 0, 1)
        weight = np.where(both, weight, free)  # of a single edge that is free nothing else is known than where it is
        clear = (inside >= LEAST_RIM * crown) & (beyond <= CLEAR_EDGE * inside) & (inside * RIM >= LEAST_ON_RIM)
        return Edges(inside, weight, np.all(clear | (weight == 0), axis=0) & free.any(axis=0), np.zeros(len(centre)))

    def _density(self, start: np.ndarray, direction: int) -> np.ndarray:
        """Points a bin on the RIM bins that begin at `start`, (s,), and go to the left (1) or right (-1)."""
        rows = np.arange(len(start))
        start = start + HALF_RANGE
        return np.abs(self.sums[rows, start + direction * RIM] - self.sums[rows, start]) / RIM


def _excess(density: np.ndarray) -> np.ndarray:
    """How much more is seen at the other edge, in proportion, (2, s)."""
    return density[::-1] / np.maximum(density, 1e-6) - 1


def _sure_excess(points: np.ndarray) -> np.ndarray:
    """Excess that points just inside of the edges, (2, s), show beyond chance: shadows come and go along the line."""
    chance = SURE_SIGMAS * np.sqrt(points[0] + points[1])
    return (points[::-1] - points - chance) / np.maximum(points, 1e-6)
