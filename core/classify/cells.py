"""Cells of a square: which may be on heads, which are kept as rails, and the steps that all searches share."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from .bed import COARSE_M, Bed, Coarse
from .labels import Near
from .lines import SINGLE_COVER, Ground, Lines, Marks, centred, find_lines, joined
from .partner import CANT, are_within_gauge, have_partners, runs_inside
from .pieces import (
    links,
    long_enough,
    lower_than_beside,
    shares_of_length,
    stands_free,
)
from .ridges import LEVEL_M, steadied
from .settings import MARGIN_M, Settings, Tolerances
from .tops import (
    MILLIMETRES,
    TOP_M,
    Band,
    Tops,
    highest_of_blocks,
    means,
    middles_of_tops,
    narrow_tops,
)

DENSITY_QUANTILE = 0.75
"""Quantile, over the coarse cells with candidates, of the points per square metre that stand for the square."""

NOISE_ACROSS_M = 0.01
"""Largest distance beyond the side of a head at which the top of a cell counts towards its axis. With half the gap to
a guard rail, the axis would lie between both rails."""

DEPTH_SHARE = 0.5
"""Share of its height above the bed by which the ground beside a rail is lower, at most: where a head stands 6 cm out
of its bed, half of the stones beside it are less than 5 cm below its top."""


@dataclass(frozen=True)
class Shown:
    """What a square shows near its bed: places, (n, 2), of points, and their cells, heights and heights above the bed.

    `z`, (n,), are metres from any level, the same for all.
    """

    xy: np.ndarray
    cell: np.ndarray
    z: np.ndarray
    height: np.ndarray
    bed: Bed
    tops: Tops

    def of(self, chosen: np.ndarray) -> Shown:
        """Choose some of the points, (n,) bool; the tops stay."""
        return replace(self, xy=self.xy[chosen], cell=self.cell[chosen], z=self.z[chosen], height=self.height[chosen])

    def mean_heights(self) -> np.ndarray:
        """Mean height of the points of each cell up to `TOP_M` above the bed, (rows, columns); NaN without any."""
        low = self.height <= TOP_M
        return means(self.tops.top.size, self.cell[low], self.height[low, None]).reshape(self.tops.top.shape)


@dataclass(frozen=True)
class Candidates:
    """Cells that may be on railheads: those with narrow tops, (n,).

    `marks`, (m,), has the highest one of each block of 2 x 2 cells, and `places`, (rows * columns, 2), the middles of
    the tops of all cells.
    """

    tops: Tops
    cells: np.ndarray
    marks: np.ndarray
    places: np.ndarray

    @classmethod
    def of(cls, shown: Shown, cells: np.ndarray) -> Candidates:
        """Take cells as candidates, at the mean places of all of their points."""
        places = means(shown.tops.top.size, shown.cell, shown.xy)
        return cls(shown.tops, cells, highest_of_blocks(shown.tops, cells), places)

    @classmethod
    def find(cls, shown: Shown, band: Band) -> Candidates:
        """Find the narrow tops in a band."""
        tops, cells = shown.tops, narrow_tops(shown.tops, band)
        middles = middles_of_tops(tops, band, cells, shown.xy, shown.cell, shown.height)
        return cls(tops, cells, highest_of_blocks(tops, cells), middles)

    def at(self, cells: np.ndarray) -> Marks:
        """Return places and heights of some of the cells."""
        return Marks(self.places[cells], self.tops.top.ravel()[cells] / MILLIMETRES)


@dataclass(frozen=True)
class Kept:
    """Cells of railheads, one of each block of 2 x 2: their numbers in the grid, (n,).

    `paired`, (n,) bool, says which have a partner, and `pairs`, (m, 2), which continue each other.
    """

    lines: Lines
    cell: np.ndarray
    paired: np.ndarray
    pairs: np.ndarray

    def of(self, chosen: np.ndarray) -> Kept:
        """Choose some of the cells, (n,) bool, and the pairs among them."""
        number = np.cumsum(chosen) - 1
        pairs = number[self.pairs[chosen[self.pairs].all(axis=1)]]
        return Kept(self.lines.of(chosen), self.cell[chosen], self.paired[chosen], pairs)

    def slopes(self, bed: Bed) -> np.ndarray:
        """Return the slopes of the bed at the axes, (n, 2): NaN where it is steeper across than a track."""
        slope = bed.gradients(self.lines.axis)
        steep = np.abs(np.einsum("ij,ij->i", slope, self.lines.across)) > CANT
        return np.where(steep[:, None], np.nan, slope)

    def on_ground(self, tops: Tops, slope: np.ndarray) -> Kept:
        """Add the heights of the cells as such, and the slopes of their beds, (n, 2)."""
        return replace(self, lines=replace(self.lines, ground=Ground(tops.z.ravel()[self.cell], slope)))

    def with_others(self, other: Kept, apart_m: float) -> Kept:
        """Put cells behind these that are further than `apart_m` from all of them; these state the reach of both."""
        if len(self.cell):
            other = other.of(cKDTree(self.lines.axis).query(other.lines.axis)[0] > apart_m)
        return Kept(
            joined(self.lines, other.lines),
            np.append(self.cell, other.cell),
            np.append(self.paired, other.paired),
            np.concatenate([self.pairs, other.pairs + len(self.cell)]),
        )


@dataclass(frozen=True)
class Standing:
    """Rails that stand out of their bed.

    Attributes
    ----------
    points : (k,) int array
        Numbers of the points on heads.
    kept : Kept
    thin : bool
        Whether the square is thin.
    rails : Kept
        Those that the guide leaves out as well.
    sharp_m, round_m, unsure_m, clear_m : float
        See `SearchFigures`.
    blur_m : float
        Blur of the ridges of a blunt cloud.
    """

    points: np.ndarray
    kept: Kept
    thin: bool
    rails: Kept
    sharp_m: float = 0.0
    round_m: float = 0.0
    unsure_m: float = 0.0
    clear_m: float = 0.0
    blur_m: float = 0.0

    def with_others(self, other: Standing, apart_m: float) -> Standing:
        """Add the points of rails that another search found, and those of its cells that are `apart_m` from these."""
        points = np.union1d(self.points, other.points)
        kept, rails = (
            one.with_others(more, apart_m) for one, more in ((self.kept, other.kept), (self.rails, other.rails))
        )
        return replace(self, points=points, kept=kept, rails=rails)


def on_lines(found: Candidates, reach_m: float, tolerances: Tolerances, settings: Settings) -> Kept:
    """Keep the candidates that lie on lines; which have partners is not known yet."""
    lines = find_lines(found.at(found.marks), reach_m, tolerances.along_m, tolerances.beside_line_m)
    good = lines.good()
    lines = _on_middles(lines.of(good), found, tolerances, settings)
    return Kept(lines, found.marks[good], np.zeros(len(good), dtype=bool), links(lines))


def _on_middles(lines: Lines, found: Candidates, tolerances: Tolerances, settings: Settings) -> Lines:
    """Move axes to the middle of all narrow cells of their heads."""
    half_m = settings.head_width_m / 2 + NOISE_ACROSS_M
    return centred(lines, found.at(found.cells), half_m, tolerances.along_m)


def free_standing(found: Candidates, bed: Bed, reach_m: float, tolerances: Tolerances, settings: Settings) -> Kept:
    """Keep the candidates that lie on rails and stand free of what is beside them."""
    kept = on_lines(found, reach_m, tolerances, settings)
    slope = kept.slopes(bed)
    cant = np.nan_to_num(np.einsum("ij,ij->i", slope, kept.lines.across))
    if tolerances.band.shadows:
        kept = kept.on_ground(found.tops, slope)
    kept = kept.of(are_free(kept, found.tops, _depth_m(kept, tolerances), cant))
    kept = with_pairs(kept, settings, tolerances)
    alone = kept.of(~kept.paired)
    free = kept.paired.copy()  # only a track is canted
    free[~kept.paired] = are_free(alone, found.tops, _depth_m(alone, tolerances))
    return on_rails(kept, free, settings, tolerances)


def on_rails(kept: Kept, free: np.ndarray, settings: Settings, tolerances: Tolerances) -> Kept:
    """Keep cells that stand free, (n,) bool, unless they belong to guard rails, feet of rails, or short pieces."""
    kept = kept.of(are_certain(kept.lines, kept.paired, kept.pairs) & free)
    inside = runs_inside(kept.lines, kept.paired, kept.pairs, settings.gauges_m, settings.head_width_m)
    kept = kept.of(~inside)
    kept = kept.of(~lower_than_beside(kept.lines, tolerances.spread_m))
    return kept.of(are_long(kept, settings, settings.keep_single, tolerances.least_m))


def with_pairs(kept: Kept, settings: Settings, tolerances: Tolerances) -> Kept:
    """Find out which cells have a partner."""
    return replace(kept, paired=are_paired(kept.lines, settings, tolerances))


def fitting(kept: Kept, piece: np.ndarray, heads: np.ndarray, settings: Settings, tolerances: Tolerances) -> Kept:
    """Keep the pieces, of (n,) cells, that may be heads, (pieces,) bool, and are at gauge from another one."""
    heads = heads & are_within_gauge(steadied(kept.lines), piece, settings.spacings_m, LEVEL_M)
    kept = with_pairs(kept.of(heads[piece]), settings, tolerances)
    return kept.of(are_long(kept, settings, False, tolerances.least_m))


def _depth_m(kept: Kept, tolerances: Tolerances) -> np.ndarray:
    """Return how far below each line what is beside it must be, (n,) metres."""
    return np.minimum(tolerances.band.depth_m(kept.lines.height), DEPTH_SHARE * kept.lines.height)


def are_free(kept: Kept, tops: Tops, depth_m: np.ndarray, slope: np.ndarray | float = 0.0) -> np.ndarray:
    """Return which cells stand free of what is beside them, (n,) bool; see `pieces.stands_free`."""
    return stands_free(tops, depth_m, kept.cell, kept.lines, np.broadcast_to(slope, len(kept.cell)), kept.pairs)


def are_paired(lines: Lines, settings: Settings, tolerances: Tolerances) -> np.ndarray:
    """Return which cells have a partner, (n,) bool."""
    return have_partners(lines, settings.spacings_m, tolerances.partner_m, tolerances.worse_m)


def are_long(kept: Kept, settings: Settings, keep_single: bool, least_m: float) -> np.ndarray:
    """Return which cells belong to pieces that are long enough or run out of the square, (n,) bool."""
    inset_m = MARGIN_M - kept.lines.reach_m / 2
    low, high = -inset_m, settings.side_m + inset_m
    open_ended = np.any((kept.lines.axis < low) | (kept.lines.axis > high), axis=1)
    return long_enough(kept.lines, kept.pairs, kept.paired, open_ended, keep_single, least_m)


def are_certain(lines: Lines, paired: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return which cells have a partner or lie on a line without gaps, and those that continue one to its end."""
    certain = paired | (lines.cover >= SINGLE_COVER)
    reached = pairs[certain[pairs].any(axis=1)]
    certain[reached.ravel()] = True
    return certain


def own_lengths(kept: Kept, settings: Settings) -> np.ndarray:
    """Return the length of rail that each cell stands for in the square without its margin, (n,) metres."""
    return np.where(settings.own(kept.lines.axis), shares_of_length(kept.lines, settings.head_width_m), 0.0)


def density_at(coarse: Coarse, xy: np.ndarray) -> float:
    """Points per square metre around candidates, (k, 2) places."""
    cell, inside = coarse.cells(xy)
    cells = np.unique(cell[inside])
    counts = coarse.count[cells]
    counts = counts[counts > 0]
    return float(np.quantile(counts, DENSITY_QUANTILE)) / COARSE_M**2 if len(counts) else np.inf


def as_wanted(
    kept: Kept,
    rails: np.ndarray,
    chosen: np.ndarray,
    beside: Near,
    thin: bool,
    settings: Settings,
    tolerances: Tolerances,
) -> Standing:
    """Leave out what is not a rail, (n,) bool of cells, and what the guide does not want."""
    wanted = rails.copy()
    if settings.guide is not None:
        wanted &= settings.guide.keeps(kept.lines, kept.pairs, settings.spacings_m, tolerances.partner_m)
    on = beside.on(settings.head_width_m / 2 + tolerances.beside_m, wanted[beside.cell])
    return Standing(chosen[on], kept.of(wanted), thin, kept.of(rails))
