"""The cross-section of the ridge under each piece: how wide it is, and how blunt.

Dense matching of photographs and wide beams blur what they see: a head becomes a round ridge. The blur widens its foot
and rounds its top; in between, it is as wide as a head is in any cloud (docs/classification.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from .lines import Lines
from .pieces import lengths, linked, links, pieces_of, to_one_side
from .tops import MILLIMETRES, Grid

REACH_M = 0.30
"""Half the width of a cross-section: a head that is blurred by 8 cm, and the bed beside it."""

SLICE_M = 0.15
"""Distance along the rail within which a point counts to the cross-section of a cell."""

BIN_M = 0.01
"""Width of a bin: a seventh of a head."""

BINS = 2 * round(REACH_M / BIN_M)

MIDDLES_M = (np.arange(BINS) - BINS / 2 + 0.5) * BIN_M
"""Middles of the bins, from the axis to the left."""

BASE_M = 0.20
"""Distance from the axis within which a side is lowest at its base, and of which the outer half must be seen: the
shoulder of the ballast may fall further on."""

LEVELS = (0.25, 0.75)
"""Parts of the way down from the top to the base at which the width of a side is measured."""

EDGE_PER_SIGMA = 0.907
"""Distance between the levels of 25 and 75 % of a Gaussian ridge, by its standard deviation."""

BLUR_QUANTILE = 0.25
"""Quantile of the ridges' roundness, by length, that stands for the blur of the square: earth is round in any cloud."""

WIDER_M = 0.048
"""Width of a ridge a quarter of the way down, beyond that of a head, up to which it may be one. Measured: rails in
images that blur by 2 to 8 cm 0 to 40 mm; a head with a guard rail beside it and walls of earth between fields 55 mm and
more."""

NEXT_HEAD_M = 0.12
"""How much wider the ridge of a rail and a guard, check or wing rail beside it is: the distance of their axes."""

LEVEL_M = 0.035
"""Difference in height above the bed between the two ridges of a track, averaged as their axes are: measured 0 to 24 mm
over a piece; a low wall at gauge from a rail 49 and 54 mm."""

STEADY_M = 1.0, 0.08
"""Distances along and across within which axes are averaged. Those of single cells scatter by 5 to 30 mm, and the
nearest of many is at the distance that is looked for; an arc of 25 m bends by 7 mm on average over this length, and
both of its rails alike."""

CRESTS_M = np.arange(-0.06, 0.061, 0.004)
"""Places across at which a crest is looked for: half a head and a cell to either side of the axis of the cells."""

HALF_WAY = (0.5,)
"""Part of the way down at which the two sides of a ridge are: there, blur does not move the side of a head."""

REPOSE = 1.0
"""Steepest slope at which earth and stones lie, height per length. Walls are steeper."""

GROUND_M, GROUND_SEEN = (0.10, 0.30), 0.5
"""Distances from the axis between which the ground on one side of a ridge shows its slope, from beyond the head and its
blurred side on, and share of the bins there that must be seen."""

LIT_SHARE = 0.75
"""Least share of the points of the other side from which a bin shows the ground. Where fewer are, a part of them is of
beams that also meet the head, and their mean is up to 20 mm too high."""

IN_SHADOW_M = 0.005
"""Least depth of these points below a crest, on average: what is as high as it is not in its shadow, however few points
there are. Measured: 9 mm and more beside heads, and none beside the edge of a trough."""

CREST_M = 0.04
"""Distance from the axis up to which the crest of a ridge is looked for: the axis of a head of which one side is hidden
is as far off."""

SIDES_M = np.linspace(-1.0, 1.0, 11)
"""Places along the line at which the sides of a ridge are looked at: check rails are 3 m long and more."""

TOP_BINS = 6
"""Bins on either side of the axis within which the top of a ridge is: the axis may be at the side of a wide one."""

ALONG_M = 2.0
"""Length to either side whose points show one crest: noise of 15 mm moves it by 4 mm over 4 m, and by 8 mm over 1 m."""

LEAST_POINTS = 1.0
"""Points that the fit of a crest is short of: it keeps the fit finite where few are seen."""


@dataclass(frozen=True)
class Ridges:
    """The ridges under pieces of line, (pieces,) each; NaN where a side is not seen as far down.

    `width_m` is the width a quarter of the way down, `spread_m` the standard deviation of the Gaussian ridge whose
    sides are as steep.
    """

    width_m: np.ndarray
    spread_m: np.ndarray
    length_m: np.ndarray

    @classmethod
    def measure(cls, xy: np.ndarray, height: np.ndarray, lines: Lines, piece: np.ndarray, share: float) -> Ridges:
        """Measure ridges, given points by place and height above the bed, and the piece of each line's cell.

        Bins show nothing with less than this `share` of the points of the other side.
        """
        sections = _shown(*_profiles(xy, height, lines, to_one_side(lines, piece), piece), share)
        middle = BINS // 2
        sides = sections[:, middle:], sections[:, middle - 1 :: -1]
        with np.errstate(invalid="ignore"):
            top = np.fmax(*(side[:, 0] for side in sides))
            places = np.array([_levels(side, top, LEVELS) for side in sides])
            spread_m = np.mean(places[:, 1] - places[:, 0], axis=0) / EDGE_PER_SIGMA
        return cls(places[:, 0].sum(axis=0), spread_m, lengths(lines.axis, piece))

    @property
    def blur_m(self) -> float:
        """Blur of the square: a standard deviation, metres; 0 where nothing shows it."""
        seen = np.flatnonzero(np.isfinite(self.spread_m))
        if not len(seen):
            return 0.0
        order = seen[np.argsort(self.spread_m[seen])]
        below = np.cumsum(self.length_m[order])
        return float(self.spread_m[order[np.searchsorted(below, BLUR_QUANTILE * below[-1])]])

    def may_be_heads(self, head_width_m: float) -> np.ndarray:
        """Return which ridges are as narrow as a head, (pieces,) bool."""
        with np.errstate(invalid="ignore"):
            return self.width_m < head_width_m + WIDER_M

    def may_be_two_heads(self, head_width_m: float) -> np.ndarray:
        """Return which ridges are as narrow as two heads side by side, (pieces,) bool."""
        return self.may_be_heads(head_width_m + NEXT_HEAD_M)


def on_crests(xy: np.ndarray, height: np.ndarray, lines: Lines, blur_m: float, reach_m: float = REACH_M) -> Lines:
    """Move axes onto the crests of their ridges, of standard deviation `blur_m`, given points by place and height.

    The tops of the cells of a ridge are led aside by ballast that is higher on one side. The ridge is a Gaussian on a
    plane bed, and the slope of the bed does not move it. Points within `reach_m` of the axes show it.
    """
    if not len(lines.axis):
        return lines
    pairs, own = links(lines, ALONG_M), np.arange(len(lines.axis))
    across = to_one_side(lines, pieces_of(len(own), pairs))
    count, rise = _profiles(xy, height, lines, across, own)
    same = linked(len(own), pairs)
    beyond = np.abs(MIDDLES_M) > reach_m
    count, rise = same @ count, same @ rise
    count[:, beyond] = rise[:, beyond] = 0.0
    fits = np.array([_explained(count, rise, crest_m, blur_m) for crest_m in CRESTS_M])
    best = np.clip(np.argmax(fits, axis=0), 1, len(CRESTS_M) - 2)
    before, at, after = (fits[best + step, np.arange(len(best))] for step in (-1, 0, 1))
    part = np.clip(0.5 * (after - before) / np.maximum(2 * at - before - after, 1e-12), -0.5, 0.5)
    offset_m = CRESTS_M[best] + part * (CRESTS_M[1] - CRESTS_M[0])
    return replace(lines, axis=lines.axis + offset_m[:, None] * across)


def above_sides(xy: np.ndarray, height: np.ndarray, lines: Lines, piece: np.ndarray) -> np.ndarray:
    """Find how high ridges stand above the ground on either side as it would go on below them, (pieces,) metres.

    Points are given by place and height above the bed. The edge of a slab or a shoulder is a crest as well, but the
    ground on one side leads up to it. A side that is not seen does not count; without a crest, the height is NaN.
    What is higher above a ridge than ground at the angle of repose is a train, a roof or a bridge, and does not count.
    What lies on steeper ground is on a wall, and does not stand above it at all.
    """
    count, rise = _profiles(xy, height, lines, to_one_side(lines, piece), piece, REPOSE * GROUND_M[1])
    lit, every = (_shown(count, rise, share) for share in (LIT_SHARE, 0.0))
    tops = np.flatnonzero(np.abs(MIDDLES_M) < CREST_M)
    with np.errstate(invalid="ignore"):
        crest_m = _of_three(rise, tops) / _of_three(count, tops)
    lit_from_m, rises = np.fmax.reduce(crest_m, axis=1) - IN_SHADOW_M, []
    for way in (1, -1):
        out_m = way * MIDDLES_M
        beside = (out_m > GROUND_M[0]) & (out_m < GROUND_M[1])
        is_lit = _known_mean(every[:, beside]) > lit_from_m
        side = np.where(is_lit[:, None], every[:, beside], lit[:, beside])
        at_axis_m, slope, seen = _straight(side, out_m[beside])
        ground_m = at_axis_m[:, None] + slope[:, None] * way * MIDDLES_M[tops]
        rise_m = np.where(np.abs(slope[:, None]) > REPOSE, 0.0, crest_m - ground_m)
        rises.append(np.where(seen[:, None] < GROUND_SEEN, np.inf, rise_m))
    return np.fmax.reduce(np.min(rises, axis=0), axis=1)


def _of_three(values: np.ndarray, bins: np.ndarray) -> np.ndarray:
    """Sum the values of bins, (k,) numbers, with those before and after each, (pieces, k)."""
    return values[:, bins - 1] + values[:, bins] + values[:, bins + 1]


def sides_of(level: np.ndarray, grid: Grid, lines: Lines) -> tuple[np.ndarray, np.ndarray]:
    """Find how far the left and the right side of each ridge is from its line, half-way down, (n,) metres.

    `level`, (rows, columns), is the mean height of each cell above the bed. NaN where a side is not seen as far down.
    A wide ridge may have two rows of lines, so points are not divided among the nearest ones, as in `_profiles`.
    """
    rise, seen = np.zeros((2, len(lines.axis), BINS))
    for ahead_m in SIDES_M:
        for number, across_m in enumerate(MIDDLES_M.tolist()):
            cell, inside = grid.cells(lines.axis + ahead_m * lines.along + across_m * lines.across)
            up = level.ravel()[cell] - lines.height
            known = inside & np.isfinite(up)
            rise[known, number] += up[known]
            seen[:, number] += known
    with np.errstate(invalid="ignore"):
        sections, middle = rise / seen, BINS // 2
    top = np.fmax.reduce(sections[:, middle - TOP_BINS : middle + TOP_BINS], axis=1)
    left, right = sections[:, middle:], sections[:, middle - 1 :: -1]
    return _levels(left, top, HALF_WAY)[0], _levels(right, top, HALF_WAY)[0]


def mean_along(values: np.ndarray, lines: Lines, within_m: float) -> np.ndarray:
    """Mean of the values of the cells that are on each cell's line within a distance, (n,); NaN where none is known."""
    known = np.isfinite(values)
    same = linked(len(values), links(lines, within_m))
    with np.errstate(invalid="ignore"):
        return (same @ np.where(known, values, 0.0)) / (same @ known.astype(float))


def steadied(lines: Lines) -> Lines:
    """Move axes to the mean of those near them, see `STEADY_M`, and heights to theirs."""
    if not len(lines.axis):
        return lines
    along_m, across_m = STEADY_M
    pairs = cKDTree(lines.axis).query_pairs(along_m, output_type="ndarray")
    own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    left_m = np.einsum("ij,ij->i", lines.axis[other] - lines.axis[own], lines.across[own])
    near = np.abs(left_m) < across_m
    own, other, left_m = own[near], other[near], left_m[near]
    some = 1 + np.bincount(own, minlength=len(lines.axis))
    offset_m = np.bincount(own, left_m, len(lines.axis)) / some
    height = (lines.height + np.bincount(own, lines.height[other], len(lines.axis))) / some
    return replace(lines.moved(offset_m), height=height)


def cells_beside(grid: Grid, lines: Lines, half_m: float) -> np.ndarray:
    """Cells within `half_m` of the axes, on either side alike, (k,) numbers in rising order."""
    steps = np.linspace(-half_m, half_m, 2 * int(np.ceil(half_m / grid.cell_m)) + 1)
    cell, inside = grid.cells(np.concatenate([lines.axis + step * lines.across for step in steps]))
    return np.unique(cell[inside])


def _explained(count: np.ndarray, rise: np.ndarray, crest_m: float, blur_m: float) -> np.ndarray:
    """Sum of squares that a ridge at `crest_m` and a plane bed explain of cross-sections, (k,).

    `count` and `rise`, (k, BINS), are the points by bin and the sum of their heights; `blur_m` is the standard
    deviation of the ridge.
    """
    model = np.stack([np.ones(BINS), MIDDLES_M / REACH_M, np.exp(-0.5 * ((MIDDLES_M - crest_m) / blur_m) ** 2)])
    normal = np.einsum("kb,ib,jb->kij", count, model, model) + LEAST_POINTS * np.eye(len(model))
    right = rise @ model.T
    return np.einsum("ki,ki->k", right, np.linalg.solve(normal, right[:, :, None])[:, :, 0])


def _known_mean(values: np.ndarray) -> np.ndarray:
    """Return the means of rows of values, (k, n), without those that are NaN: (k,), NaN without any."""
    known = np.isfinite(values)
    with np.errstate(invalid="ignore"):
        return np.where(known, values, 0.0).sum(axis=1) / known.sum(axis=1)


def _straight(values: np.ndarray, places_m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit straight lines to rows of values, (k, n), at places, (n,), without values that are NaN.

    Returns where each line is at place 0, NaN without values, its slope, and the share of known values, (k,) each.
    """
    known = np.isfinite(values)
    mean, place_m = _known_mean(values), _known_mean(np.where(known, places_m, np.nan))
    step_m = np.where(known, places_m - place_m[:, None], 0.0)
    slope = (np.where(known, values, 0.0) * step_m).sum(axis=1) / np.maximum((step_m**2).sum(axis=1), BIN_M**2)
    return mean - slope * place_m, slope, known.mean(axis=1)


def _shown(count: np.ndarray, rise: np.ndarray, share: float) -> np.ndarray:
    """Mean heights of cross-sections relative to their line, see `_profiles`, (k, BINS); NaN in bins that are unseen.

    What is in the shadow of a head shows few points, of the beams that also meet its edge: their height is between. A
    bin is seen if it has this share of the points that are as far away on the other side.
    """
    with np.errstate(invalid="ignore"):
        return np.where(count < share * count[:, ::-1], np.nan, rise / count)


def _profiles(
    xy: np.ndarray, height: np.ndarray, lines: Lines, across: np.ndarray, piece: np.ndarray, up_to_m: float = np.inf
) -> tuple[np.ndarray, np.ndarray]:
    """Count the points beside each piece, and sum up their heights relative to its line, (pieces, BINS) each.

    Bins are in the direction of the unit vectors `across`, (cells, 2), which are to the same side of what is summed up.
    Points that are higher above the line than `up_to_m` are left out.
    """
    count, reach_m = int(piece.max()) + 1, float(np.hypot(REACH_M, SLICE_M))
    near, cell = nearest(xy, lines.axis, reach_m)
    step = xy[near] - lines.axis[cell]
    bins = np.floor(np.einsum("ij,ij->i", step, across[cell]) / BIN_M).astype(np.int64) + BINS // 2
    inside = np.abs(np.einsum("ij,ij->i", step, lines.along[cell])) < SLICE_M
    up_m = height[near] - lines.height[cell]
    inside &= (bins >= 0) & (bins < BINS) & (up_m <= up_to_m)
    number = (piece[cell] * BINS + bins)[inside]
    # Whole numbers add up to the same sum in any order of the points.
    rise = np.round(up_m[inside] * MILLIMETRES)
    counts = [np.bincount(number, weights, count * BINS).reshape(count, BINS) for weights in (None, rise)]
    return counts[0].astype(float), counts[1] / MILLIMETRES


def nearest(xy: np.ndarray, places: np.ndarray, reach_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Find the points within `reach_m` of a place, and the nearest place of each, (k,) numbers each.

    Given are n points, (n, 2), and places, (m, 2).
    """
    near = _around(xy, places, reach_m)
    distance, place = cKDTree(places).query(xy[near], distance_upper_bound=reach_m)
    seen = np.isfinite(distance)
    return near[seen], place[seen]


def _around(xy: np.ndarray, places: np.ndarray, reach_m: float) -> np.ndarray:
    """Return the points, (k,) numbers, in cells around places: all within `reach_m` of one, and few others.

    This is many times as fast as to ask each point for the nearest place.
    """
    corner = places.min(axis=0) - 2 * reach_m
    columns, rows = np.floor((places - corner) / reach_m).astype(np.int32).T
    around = np.zeros((int(columns.max()) + 3, int(rows.max()) + 3), dtype=bool)
    for right in (-1, 0, 1):
        for up in (-1, 0, 1):
            around[columns + right, rows + up] = True
    column, row = (
        np.clip((values - low) / reach_m, 0, size - 1).astype(np.int32)
        for values, low, size in zip(xy.T, corner, around.shape)
    )
    return np.flatnonzero(around[column, row])


def _levels(side: np.ndarray, top: np.ndarray, levels: Sequence[float]) -> np.ndarray:
    """Distances from the axis at which one side of each ridge falls below levels, (levels, pieces) metres.

    `side`, (pieces, bins), has heights outwards from the axis, and `top`, (pieces,), those of the ridges.
    """
    bins = round(BASE_M / BIN_M)
    unseen = np.isnan(side)
    has_base = ~unseen[:, bins // 2 : bins].all(axis=1)
    base = np.where(has_base, np.fmin.reduce(side[:, :bins], axis=1), np.nan)
    rows = np.arange(len(side))
    found = []
    for share in levels:
        level = top - share * (top - base)
        below = side < level[:, None]
        after = np.argmax(below, axis=1)
        seen = below.any(axis=1) & (after > 0) & ~_any_before(unseen, after)
        before = np.maximum(after - 1, 0)
        high, low = side[rows, before], side[rows, after]
        place = (before + 0.5 + (high - level) / np.where(seen, high - low, 1.0)) * BIN_M
        found.append(np.where(seen, place, np.nan))
    return np.array(found)


def _any_before(flag: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return in which rows, (k, n) bool, a flag is set before a column, (k,) int."""
    return np.where(flag.any(axis=1), np.argmax(flag, axis=1) < end, False)
