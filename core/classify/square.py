"""One square classified: from its points to labels, cells and figures."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..rails import SearchFigures
from .alone import are_solid, may_hide_partner
from .bed import COARSE_M, Bed, Coarse
from .flush import NO_FLUSH, Flush, NearBed, flush_rails
from .labels import Near, label, whole_heads
from .lines import SINGLE_COVER, Lines, Marks, centred, find_lines, reach_at
from .low import find_low
from .partner import MAJORITY, are_within_gauge, have_partners, runs_inside
from .pieces import (
    LEAST_SINGLE_M,
    lengths,
    links,
    long_enough,
    lower_than_beside,
    mean_of,
    pieces_of,
    shares_of_length,
    stands_free,
    with_partner,
)
from .ridges import LEVEL_M, Ridges, cells_beside, on_crests, steadied
from .settings import BLUNT, MARGIN_M, Settings, Tolerances, Way
from .tops import (
    EMPTY,
    HIGH_M,
    LOW_M,
    MILLIMETRES,
    TOP_M,
    Band,
    Grid,
    Tops,
    highest_of_blocks,
    means,
    middles_of_tops,
    narrow_tops,
    tops_of,
)

THIN_PER_M2 = 400.0
"""Points per square metre below which a square is thin: no scanner on a vehicle, or far from it."""

LEAST_DENSE_M2 = 20.0
"""Area of a square that is not thin without which nothing just above the ballast is seen: 5 m of track."""

DENSITY_QUANTILE = 0.75
"""Quantile, over the coarse cells with candidates, of the points per square metre that stand for the square."""

SINGLE_HEIGHT_M = 0.12
"""Least height above the bed of a rail without a partner: lower things are edges of slopes, kerbs and boards."""

AS_HIGH_M = 0.03
"""A rail without a partner may be lower if it stands as high as the rails of the square that have one, within this:
ballast differs as much from track to track. Measured: 11 mm; kerbs and edges of slopes beside tracks 41 mm and more.
Guard rails stand as high as the rail that they guard, or up to 20 mm higher."""

GUARD_SHORTER_M = 2.0
"""Least difference in length of a guard rail and the rail that it guards: it ends a metre before it on both sides. Two
lone rails that are as long as each other are both rails, as where one of each of two tracks is hidden."""

SINGLE_WIDTH = 0.2
"""Least width of a rail without a partner by that of a head. A single profile of the scanner is a bar of no width where
the ground falls beside it, as at the edge of a road: measured 2 to 4 mm. Heads measure 68 mm, and 19 mm where a train
hides most of them."""

SINGLE_SLOPE = 0.3
"""Steepest bed of a rail without a partner: cant of 180 mm is 0.12, and a shoulder beside the rail makes it 0.22 at
most; at the shoulder of a ballast bed it is 0.67. Where the far side of a slope is hidden, its crest looks like a bar
on a bed of 0.38 and more."""

DEPTH_SHARE = 0.5
"""Share of its height above the bed by which the ground beside a rail is lower, at most: where a head stands 6 cm out
of its bed, half of the stones beside it are less than 5 cm below its top."""

SINGLE_DEPTH = 0.4
"""Share of its height above the bed by which the ground on either side of a rail without a partner is lower. The plane
of the bed bends at the crest of a bank, which then seems to be high. Measured: 0.31 to 0.35 there, and 0.55 and more
on rails beside which the ground is seen."""

SHARP_WIDER_M = 0.016
"""Width beyond that of a head up to which a piece shows that the cloud is sharp. Measured over half of the rails of a
cloud and more: up to 11 mm by scanners on vehicles, 13 mm by wide beams from the air, and from 20 mm on in images that
blur by 3 cm, where a wider limit kept one rail and dropped the next."""

CANT = 0.12
"""Steepest slope of a track across, height per length: 180 mm over 1.5 m."""

NOISE_ACROSS_M = 0.01
"""Largest distance beyond the side of a head at which the top of a cell counts towards its axis. With half the gap to
a guard rail, the axis would lie between both rails."""


@dataclass(frozen=True)
class Shown:
    """What a square shows near its bed: places, (n, 2), of points, their cells and heights above the bed, (n,)."""

    xy: np.ndarray
    cell: np.ndarray
    height: np.ndarray
    bed: Bed
    tops: Tops

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


@dataclass(frozen=True)
class Classified:
    """The answer for one square: which points are on railheads, (n,) bool; those in the margin are not."""

    rail: np.ndarray
    figures: SearchFigures


@dataclass(frozen=True)
class ByShape(Classified):
    """The answer of geometry for one square.

    `flush` is what of it is in pavements; its figures leave out points and squares.
    """

    flush: Classified


def classify_square(xyz: np.ndarray, settings: Settings) -> ByShape:
    """Find the points on railheads in a square.

    All points of the square and those in a margin of `MARGIN_M` are given, (n, 3) metres from its south-western corner,
    which lies at a multiple of `Settings.side_m` from the zero of the coordinate system.
    """
    rail = np.zeros(len(xyz), dtype=bool)
    nothing = ByShape(rail, SearchFigures(), Classified(rail, SearchFigures()))
    if not len(xyz):
        return nothing
    bed, height, level, z = Bed.under(xyz)
    near = np.flatnonzero(_in_reach(bed, height, level, settings))
    if not len(near):
        return nothing
    height, xy = height[near], xyz[near, :2]
    grid, cell = Grid.around(xy[:, 0], xy[:, 1], settings.cell_m)
    tops = tops_of(grid, cell, height, z[near])
    standing = _standing(Shown(xy, cell, height, bed, tops), settings)
    near_bed = NearBed(xy, z[near], height, bed.coarse.cell[near], level[near])
    paved = NO_FLUSH if settings.blunt else flush_rails(bed.coarse.shape, near_bed, grid, cell, settings)
    in_pavement = rail.copy()
    in_pavement[near[paved.points]] = True
    found = np.append(near[standing.points], near[paved.points])
    rail[found] = settings.own(xyz[found])
    in_pavement &= rail
    flush = Classified(in_pavement, _flush_figures(paved, cell[in_pavement[near]], settings))
    figures = _standing_figures(standing, settings) + flush.figures
    there = bool(rail.any())
    figures = replace(
        figures,
        points=int(rail.sum()),
        cells=len(np.unique(cell[rail[near]])),
        squares=int(there),
        thin=int(there and standing.thin),
    )
    return ByShape(rail, figures, flush)


def _in_reach(bed: Bed, height: np.ndarray, level: np.ndarray, settings: Settings) -> np.ndarray:
    """Return which points may show rails, (n,) bool, given their heights above the bed and their levels."""
    in_reach = height <= HIGH_M
    if settings.way is not Way.FILLED:
        return in_reach
    dense_m2 = COARSE_M**2 * np.count_nonzero(bed.coarse.count >= THIN_PER_M2 * COARSE_M**2)
    return in_reach & (level == 0) & (dense_m2 >= LEAST_DENSE_M2)  # the vault of a tunnel is as rough as ballast


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
    sharp_m, round_m, unsure_m : float
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
    blur_m: float = 0.0


def _standing(shown: Shown, settings: Settings) -> Standing:
    """Find rails that stand out of their bed: bars as narrow as a head, or the ridges of a blunt cloud."""
    if settings.way is Way.FILLED:
        return _on_low(shown, settings)
    band = settings.tolerances(thin=False).band
    found = Candidates.find(shown, band)
    density = _density(shown.bed.coarse, shown.tops.grid.middles(found.marks))
    thin = density < THIN_PER_M2
    if thin and band.shadows:  # few points fill a strip by chance
        found = Candidates.find(shown, replace(band, shadows=False))
    tolerances = settings.tolerances(thin)
    kept = _kept(found, shown.bed, reach_at(density), tolerances, settings)
    if settings.blunt:
        return _on_ridges(kept, thin, shown, settings)
    return _on_bars(kept, thin, found, shown, settings, tolerances)


def _on_bars(
    kept: Kept, thin: bool, found: Candidates, shown: Shown, settings: Settings, tolerances: Tolerances
) -> Standing:
    """Keep the cells of pieces that are as narrow as a head."""
    heads = whole_heads(shown.tops, _completed(found, kept, settings, tolerances), tolerances)
    chosen = label(shown.tops, heads, shown.cell, shown.height, tolerances)
    beside = Near.find(shown.xy[chosen], kept.lines)
    piece = pieces_of(len(kept.cell), kept.pairs)
    width_m, share_m = beside.widths(piece), _share_m(kept, settings)
    narrow = (width_m < settings.head_width_m + tolerances.wider_m)[piece]
    kinds = _by_shape(kept, piece, width_m, narrow, shown, settings)
    sharp_m, round_m, unsure_m = (float(share_m[kind].sum()) for kind in kinds)
    kept = _with_kept_partners(kept.of(narrow), settings, tolerances)
    beside = Near.find(shown.xy[chosen], kept.lines)
    rails = _are_rails(kept, beside, shown, settings, tolerances)
    standing = _wanted(kept, rails, chosen, beside, thin, settings, tolerances)
    return replace(standing, sharp_m=sharp_m, round_m=round_m, unsure_m=unsure_m)


def _on_ridges(kept: Kept, thin: bool, shown: Shown, settings: Settings) -> Standing:
    """Keep the cells of ridges that may be heads, with their axes on the crests.

    All of them have a partner, because a mound of this width is as round; and only they show the blur, because the
    width of other things is not known.
    """
    blur_m = 0.0
    kept = kept.of(with_partner(kept.pairs, kept.paired))
    if len(kept.cell):
        piece = pieces_of(len(kept.cell), kept.pairs)
        ridges = Ridges.measure(shown.xy, shown.height, kept.lines, piece)
        blur_m = ridges.blur_m
        heads = ridges.may_be_heads(settings.head_width_m)
        heads &= mean_of(kept.lines.cover, piece) >= SINGLE_COVER  # sleepers show gaps in images, and rails none
        kept = _fitting(kept, piece, heads, settings, BLUNT)
        kept = replace(kept, lines=on_crests(shown.xy, shown.height, kept.lines, blur_m))
    cells = cells_beside(shown.tops.grid, kept.lines, settings.head_width_m / 2 + BLUNT.beside_m)
    chosen = label(shown.tops, cells, shown.cell, shown.height, BLUNT)
    beside = Near.find(shown.xy[chosen], kept.lines)
    every = np.ones(len(kept.cell), dtype=bool)
    return replace(_wanted(kept, every, chosen, beside, thin, settings, BLUNT), blur_m=blur_m)


def _on_low(shown: Shown, settings: Settings) -> Standing:
    """Find heads that stand just out of the ballast: lines above both sides, as wide as a head and with a partner."""
    grid, tolerances = shown.tops.grid, settings.tolerances(thin=False)
    low = find_low(grid, shown.mean_heights())
    rise = np.where(np.isfinite(low.rise), np.round(low.rise * MILLIMETRES), EMPTY).astype(np.int16)
    above = (shown.height - np.nan_to_num(low.base).ravel()[shown.cell]).astype(np.float32)
    shown = replace(shown, height=above, tops=replace(shown.tops, top=rise))
    found = Candidates.of(shown, np.flatnonzero(low.crest))
    density = _density(shown.bed.coarse, grid.middles(found.marks))
    kept = _with_pairs(_on_lines(found, reach_at(density), tolerances, settings), settings, tolerances)
    kept = _on_rails(kept, np.ones(len(kept.cell), dtype=bool), settings, tolerances)
    kept = kept.of(with_partner(kept.pairs, kept.paired))
    if len(kept.cell):
        piece = pieces_of(len(kept.cell), kept.pairs)
        width_m = Ridges.measure(shown.xy, shown.height, kept.lines, piece).width_m
        too_wide = width_m >= settings.head_width_m + tolerances.wider_m  # where one side is hidden, this is not known
        kept = _fitting(kept, piece, ~too_wide, settings, tolerances)
    chosen = label(shown.tops, whole_heads(shown.tops, kept.cell, tolerances), shown.cell, shown.height, tolerances)
    beside = Near.find(shown.xy[chosen], kept.lines)
    return _wanted(kept, np.ones(len(kept.cell), dtype=bool), chosen, beside, False, settings, tolerances)


def _fitting(kept: Kept, piece: np.ndarray, heads: np.ndarray, settings: Settings, tolerances: Tolerances) -> Kept:
    """Keep the pieces, of (n,) cells, that may be heads, (pieces,) bool, and are at gauge from another one."""
    heads = heads & are_within_gauge(steadied(kept.lines), piece, settings.spacings_m, LEVEL_M)
    kept = _with_pairs(kept.of(heads[piece]), settings, tolerances)
    return kept.of(_long(kept, settings, False, tolerances.least_m))


def _wanted(
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


def _standing_figures(standing: Standing, settings: Settings) -> SearchFigures:
    """Sum up the lengths of rails that stand out of their bed, in the square without its margin."""
    kept = standing.kept
    share_m = _share_m(kept, settings)
    along_m, across_m = beside_guide(standing.rails.lines, settings)
    blunt_m = float(share_m.sum()) if settings.blunt else 0.0
    return SearchFigures(
        paired_m=float(share_m[kept.paired].sum()),
        single_m=float(share_m[~kept.paired].sum()),
        along_m=float(along_m),
        across_m=float(across_m),
        blunt_m=blunt_m,
        blur_m2=blunt_m * standing.blur_m,
        filled_m=float(share_m[kept.lines.height < LOW_M].sum()) if settings.way is Way.FILLED else 0.0,
        sharp_m=standing.sharp_m,
        round_m=standing.round_m,
        unsure_m=standing.unsure_m,
    )


def _share_m(kept: Kept, settings: Settings) -> np.ndarray:
    """Return the length of rail that each cell stands for in the square without its margin, (n,) metres."""
    return np.where(settings.own(kept.lines.axis), shares_of_length(kept.lines, settings.head_width_m), 0.0)


def _flush_figures(flush: Flush, cell: np.ndarray, settings: Settings) -> SearchFigures:
    """Sum up rails in pavements, in the square without its margin; `cell` are those of their points."""
    share_m = shares_of_length(flush.lines, settings.head_width_m)[settings.own(flush.lines.axis)]
    along_m, across_m = beside_guide(flush.rails, settings)
    return SearchFigures(
        paired_m=float(share_m.sum()),
        unsure_m=float(share_m.sum()),
        cells=len(np.unique(cell)),
        paved=int(len(share_m) > 0),
        along_m=float(along_m),
        across_m=float(across_m),
    )


def beside_guide(lines: Lines, settings: Settings) -> np.ndarray:
    """Return the length of rails in the square that run along the guide, and across it, (2,) metres."""
    if settings.guide is None or not len(lines.axis):
        return np.zeros(2)
    share_m = np.where(settings.own(lines.axis), shares_of_length(lines, settings.head_width_m), 0.0)
    return np.array([share_m[chosen].sum() for chosen in settings.guide.crosses(lines)])


def _density(coarse: Coarse, xy: np.ndarray) -> float:
    """Points per square metre around candidates, (k, 2) places."""
    cell, inside = coarse.cells(xy)
    cells = np.unique(cell[inside])
    counts = coarse.count[cells]
    counts = counts[counts > 0]
    return float(np.quantile(counts, DENSITY_QUANTILE)) / COARSE_M**2 if len(counts) else np.inf


def _kept(found: Candidates, bed: Bed, reach_m: float, tolerances: Tolerances, settings: Settings) -> Kept:
    """Keep the candidates that lie on rails and stand free of what is beside them."""
    kept = _on_lines(found, reach_m, tolerances, settings)
    cant = np.einsum("ij,ij->i", bed.gradients(kept.lines.axis), kept.lines.across)
    cant[np.abs(cant) > CANT] = 0.0
    kept = kept.of(_stands_free(kept, cant, found.tops, _depth_m(kept, tolerances)))
    kept = _with_pairs(kept, settings, tolerances)
    alone = kept.of(~kept.paired)
    free = kept.paired.copy()  # only a track is canted
    free[~kept.paired] = _stands_free(alone, np.zeros(len(alone.cell)), found.tops, _depth_m(alone, tolerances))
    return _on_rails(kept, free, settings, tolerances)


def _on_lines(found: Candidates, reach_m: float, tolerances: Tolerances, settings: Settings) -> Kept:
    """Keep the candidates that lie on lines; which have partners is not known yet."""
    lines = find_lines(found.at(found.marks), reach_m, tolerances.along_m, tolerances.beside_line_m)
    good = lines.good()
    half_m = settings.head_width_m / 2 + NOISE_ACROSS_M
    lines = centred(lines.of(good), found.at(found.cells), half_m, tolerances.along_m)
    return Kept(lines, found.marks[good], np.zeros(len(good), dtype=bool), links(lines))


def _on_rails(kept: Kept, free: np.ndarray, settings: Settings, tolerances: Tolerances) -> Kept:
    """Keep cells that stand free, (n,) bool, unless they belong to guard rails, feet of rails, or short pieces."""
    kept = kept.of(_certain(kept.lines, kept.paired, kept.pairs) & free)
    inside = runs_inside(kept.lines, kept.paired, kept.pairs, settings.gauges_m, settings.head_width_m)
    kept = kept.of(~inside)
    kept = kept.of(~lower_than_beside(kept.lines, tolerances.spread_m))
    return kept.of(_long(kept, settings, settings.keep_single, tolerances.least_m))


def _with_pairs(kept: Kept, settings: Settings, tolerances: Tolerances) -> Kept:
    """Find out which cells have a partner."""
    return replace(kept, paired=_paired(kept.lines, settings, tolerances))


def _depth_m(kept: Kept, tolerances: Tolerances) -> np.ndarray:
    """Return how far below each line what is beside it must be, (n,) metres."""
    return np.minimum(tolerances.band.depth_m(kept.lines.height), DEPTH_SHARE * kept.lines.height)


def _stands_free(kept: Kept, slope: np.ndarray, tops: Tops, depth_m: np.ndarray) -> np.ndarray:
    """Return which cells stand free of what is beside them, (n,) bool; see `pieces.stands_free`."""
    return stands_free(tops, depth_m, kept.cell, kept.lines, slope, kept.pairs)


def _paired(lines: Lines, settings: Settings, tolerances: Tolerances) -> np.ndarray:
    """Return which cells have a partner, (n,) bool."""
    return have_partners(lines, settings.spacings_m, tolerances.partner_m)


def _long(kept: Kept, settings: Settings, keep_single: bool, least_m: float) -> np.ndarray:
    """Return which cells belong to pieces that are long enough or run out of the square, (n,) bool."""
    inset_m = MARGIN_M - kept.lines.reach_m / 2
    low, high = -inset_m, settings.side_m + inset_m
    open_ended = np.any((kept.lines.axis < low) | (kept.lines.axis > high), axis=1)
    return long_enough(kept.lines, kept.pairs, kept.paired, open_ended, keep_single, least_m)


def _certain(lines: Lines, paired: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return which cells have a partner or lie on a line without gaps, and those that continue one to its end."""
    certain = paired | (lines.cover >= SINGLE_COVER)
    reached = pairs[certain[pairs].any(axis=1)]
    certain[reached.ravel()] = True
    return certain


def _completed(found: Candidates, kept: Kept, settings: Settings, tolerances: Tolerances) -> np.ndarray:
    """Add to the kept cells the other candidates on their axes: the line that such a cell saw was a wrong one."""
    others = np.setdiff1d(found.marks, kept.cell)
    return np.union1d(kept.cell, others[_near_axes(found.at(others), kept, settings, tolerances.along_m)])


def _near_axes(marks: Marks, kept: Kept, settings: Settings, height_m: float) -> np.ndarray:
    """Return which marks lie on the axes of kept cells, and within `height_m` of them in height, (k,) bool."""
    near = Near.find(marks.xy, kept.lines)
    level = np.abs(kept.lines.height[near.cell] - marks.height[near.place]) < height_m
    return near.on((settings.head_width_m + settings.cell_m) / 2, level)


def _with_kept_partners(kept: Kept, settings: Settings, tolerances: Tolerances) -> Kept:
    """Keep the pieces whose partners are kept as well, and of the others what may be a rail without a partner.

    What was at gauge from a piece may have turned out to be too wide for a head, or too short for a rail.
    """
    partnered = with_partner(kept.pairs, _paired(kept.lines, settings, tolerances))
    kept = replace(kept, paired=kept.paired & partnered)
    kept = kept.of(partnered | _certain(kept.lines, kept.paired, kept.pairs))
    return kept.of(_long(kept, settings, settings.keep_single, tolerances.least_m))


def _by_shape(
    kept: Kept, piece: np.ndarray, width_m: np.ndarray, narrow: np.ndarray, shown: Shown, settings: Settings
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return which cells with a partner show a sharp cloud, which are round, and which are neither, (n,) bool each.

    Those that are as narrow as a head in a sharp cloud, those that are wider and round, and those that are wider and
    steep, but `narrow`, (n,), enough for a rail. Pieces have a width, (pieces,).
    """
    partnered = with_partner(kept.pairs, kept.paired)
    sharp = partnered & (width_m < settings.head_width_m + SHARP_WIDER_M)[piece]
    rounded = unsure = partnered & ~sharp
    if rounded.any():
        spread_m = Ridges.measure(shown.xy, shown.height, kept.lines, piece).spread_m
        rounded = rounded & (spread_m > settings.head_width_m / 2)[piece]
        unsure = unsure & narrow & (spread_m <= settings.head_width_m / 2)[piece]
    return sharp, rounded, unsure


def _are_rails(kept: Kept, beside: Near, shown: Shown, settings: Settings, tolerances: Tolerances) -> np.ndarray:
    """Return which cells of narrow pieces belong to rails, (n,) bool: those with a partner, and some others.

    Rails without a partner are as narrow as a head and no narrower, stand as high as a rail does that is not buried in
    ballast, or as those that have a partner, their bed is not steeper than a track's, the ground beside is lower,
    they are not guard rails, they overhang, and the other rail may be hidden. `beside` has the points in the height of
    the heads, and the cells near them.
    """
    partnered = with_partner(kept.pairs, kept.paired)
    if partnered.all():
        return partnered
    piece = pieces_of(len(kept.cell), kept.pairs)
    width_m, height_m = beside.widths(piece), mean_of(kept.lines.height, piece)
    narrow = width_m < settings.head_width_m + tolerances.wider_single_m
    narrow &= width_m >= SINGLE_WIDTH * settings.head_width_m
    high = height_m >= SINGLE_HEIGHT_M
    rails = kept.lines.height[partnered & (lengths(kept.lines.axis, piece) >= LEAST_SINGLE_M)[piece]]
    if len(rails):
        high |= np.abs(height_m - np.median(rails)) < AS_HIGH_M
    slope = np.hypot(*shown.bed.gradients(kept.lines.axis).T)
    alone = narrow & high & (mean_of(slope, piece) <= SINGLE_SLOPE)
    alone &= ~_are_guards(kept, piece, partnered, settings)
    alone &= mean_of(_stand_free_alone(kept, shown.tops), piece) > MAJORITY
    mine = alone[piece] & ~partnered
    lines, (numbers, number) = kept.lines.of(mine), np.unique(piece[mine], return_inverse=True)
    hidden = may_hide_partner(lines, number, shown.tops, settings, tolerances.partner_m)
    alone[numbers] = hidden & ~are_solid(lines, number, shown.xy, shown.height, settings.head_width_m)
    return partnered | alone[piece]


def _stand_free_alone(kept: Kept, tops: Tops) -> np.ndarray:
    """Return which cells have ground beside them that is as low as beside a rail without a partner, (n,) bool."""
    return _stands_free(kept, np.zeros(len(kept.cell)), tops, SINGLE_DEPTH * kept.lines.height)


def _are_guards(kept: Kept, piece: np.ndarray, partnered: np.ndarray, settings: Settings) -> np.ndarray:
    """Return which pieces run along a longer one, or one with a partner, that is as high, within a gauge, (pieces,).

    A guard rail ends before the rail that it guards, and hides it from a scanner beside the track.
    """
    length_m = np.where(partnered, np.inf, lengths(kept.lines.axis, piece)[piece])
    inside = runs_inside(
        kept.lines, length_m, kept.pairs, settings.gauges_m, settings.head_width_m, AS_HIGH_M, GUARD_SHORTER_M
    )
    return mean_of(inside, piece) > MAJORITY
