"""One square classified: from its points to labels, cells and figures."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..rails import SearchFigures
from .bars import on_bars
from .bed import COARSE_M, Bed
from .blunt import on_ridges
from .cells import Candidates, Kept, Shown, Standing, density_at, free_standing, own_lengths
from .flush import NO_FLUSH, Flush, NearBed, flush_rails
from .lines import Lines, reach_at
from .low import on_low
from .pieces import shares_of_length
from .settings import Settings, Way
from .tops import HIGH_M, LOW_M, Grid, tops_of

THIN_PER_M2 = 400.0
"""Points per square metre below which a square is thin: no scanner on a vehicle, or far from it."""

VAULT_M, VAULT_SHARE = 0.25, 0.05
"""Height above the bed that no rail on plates reaches, and share of the points of a level above another one, in a
coarse cell, that are higher, from which it carries no rails: a vault that planes cease to follow rises by 0.35 m across
a cell, and a tenth of it is as high. What is seen of a viaduct at a grazing angle may be rails alone, but these are
lower."""

LEAST_DENSE_M2 = 20.0
"""Area of a square that is not thin without which nothing just above the ballast is seen: 5 m of track."""


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
    near = np.flatnonzero((height <= HIGH_M) & ~_on_vault(bed, height, level))
    if not len(near):
        return nothing
    height, xy = height[near], xyz[near, :2]
    grid, cell = Grid.around(xy[:, 0], xy[:, 1], settings.cell_m)
    tops = tops_of(grid, cell, height, z[near])
    near_bed = NearBed(xy, z[near], height, bed.coarse.cell[near], level[near])
    paved = NO_FLUSH if settings.blunt else flush_rails(bed.coarse.shape, near_bed, grid, cell, settings)
    standing = _standing(Shown(xy, cell, z[near], height, bed, tops), level[near], paved, settings)
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


def _on_vault(bed: Bed, height: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Return which points are on a vault, (n,) bool: a level above another one that is too uneven for a bed."""
    above = np.flatnonzero(level)
    surface = level[above].astype(np.int64) * len(bed.coarse.count) + bed.coarse.cell[above]
    is_high = (height[above] > VAULT_M) & (height[above] <= HIGH_M)
    uneven = np.bincount(surface, is_high) > VAULT_SHARE * np.bincount(surface)
    on_vault = np.zeros(len(level), dtype=bool)
    on_vault[above] = uneven[surface]
    return on_vault


def _standing(shown: Shown, level: np.ndarray, paved: Flush, settings: Settings) -> Standing:
    """Find rails that stand out of their bed, and in a cloud with filled tracks also those that hardly do."""
    if settings.way is not Way.FILLED:
        return _clear(shown, settings)
    sharp = replace(settings, way=Way.SHARP)
    dense_m2 = COARSE_M**2 * np.count_nonzero(shown.bed.coarse.count >= THIN_PER_M2 * COARSE_M**2)
    if dense_m2 < LEAST_DENSE_M2:
        return _clear(shown, sharp)
    ground = level == 0  # the vault of a tunnel is as rough as ballast
    ground[paved.street(shown.xy)] = False  # no head stands out there
    low = on_low(shown.of(ground), settings)
    clear = _clear(shown, sharp, low.rails)
    return clear.with_others(replace(low, points=np.flatnonzero(ground)[low.points]), settings.head_width_m)


def _clear(shown: Shown, settings: Settings, low: Kept | None = None) -> Standing:
    """Find rails that stand clear of their bed: bars as narrow as a head, or the ridges of a blunt cloud.

    Third rails beside `low` rails that hardly stand out are not rails of a track.
    """
    found = Candidates.find(shown, settings.tolerances(thin=False).band)
    density = density_at(shown.bed.coarse, shown.tops.grid.middles(found.marks))
    thin = density < THIN_PER_M2
    tolerances = settings.tolerances(thin)
    kept = free_standing(found, shown.bed, reach_at(density), tolerances, settings)
    if settings.blunt:
        return on_ridges(kept, thin, shown, settings)
    return on_bars(kept, thin, found, shown, settings, tolerances, low)


def _standing_figures(standing: Standing, settings: Settings) -> SearchFigures:
    """Sum up the lengths of rails that stand out of their bed, in the square without its margin."""
    kept = standing.kept
    share_m = own_lengths(kept, settings)
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
        clear_m=standing.clear_m,
    )


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
