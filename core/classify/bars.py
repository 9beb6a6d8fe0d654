"""Rails that stand out of their bed as bars that are as narrow as a head."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .alone import UNDER_FOOT_M, are_solid, may_hide_partner
from .cells import (
    Candidates,
    Kept,
    Shown,
    Standing,
    are_certain,
    are_long,
    are_paired,
    as_wanted,
    own_lengths,
)
from .labels import Near, label, whole_heads
from .lines import Marks
from .opposite import opposite_heads
from .partner import MAJORITY, SPACING_M, STEEP, partner_sides, rise_above, runs_inside
from .pieces import LEAST_SINGLE_M, SHOWN_SHARE, lengths, mean_of, pieces_of, with_partner
from .ridges import Ridges, above_sides
from .settings import Settings, Tolerances
from .tops import LOW_M

SINGLE_HEIGHT_M = 0.12
"""Least height above the bed of a rail without a partner: lower things are edges of slopes, kerbs and boards."""

AS_HIGH_M = 0.03
"""A rail without a partner may be lower if it stands as high as the rails of the square that have one, within this:
ballast differs as much from track to track. Measured: 11 mm; kerbs and edges of slopes beside tracks 41 mm and more.
Guard rails stand as high as the rail that they guard, or up to 20 mm higher."""

GUARD_SHORTER_M = 2.0
"""Least difference in length of a guard rail and the rail that it guards: it ends a metre before it on both sides. Two
lone rails that are as long as each other are both rails, as where one of each of two tracks is hidden."""

THIRD_RAIL_M, HIGHER_M = 0.5, 0.04
"""Largest distance of a third rail beyond the place of the other rail of a track, and its least height above the rails.
Third rails are 0.3 to 0.45 m from a rail and 50 to 80 mm higher; a rail of another track as near is as high as both."""

SINGLE_WIDTH = 0.2
"""Least width of a rail without a partner by that of a head. A single profile of the scanner is a bar of no width where
the ground falls beside it, as at the edge of a road: measured 2 to 4 mm. Heads measure 68 mm, and 19 mm where a train
hides most of them."""

SINGLE_RISE_M = 0.06
"""Least height of a rail without a partner above the ground on either side as it would go on below: half of
`SINGLE_HEIGHT_M`. The ground leads up to the crest of a bank, or on to the edge of a cutting."""

SHARP_WIDER_M = 0.011
"""Width beyond that of a head up to which a piece shows that the cloud is sharp. Measured over half of the rails of a
cloud and more: up to 5 mm by scanners on the ground, 10 mm by some wide beams from the air, and from 11 mm on
in images that blur by 2 cm."""

CLEAR_M = LOW_M + 0.045
"""Least mean height above its bed of a piece that stands clear of it: ballast scatters by up to 15 mm, and passes
differ by up to 30 mm in height, so that tops of lower ones are too low to count in places."""


def on_bars(
    kept: Kept,
    thin: bool,
    found: Candidates,
    shown: Shown,
    settings: Settings,
    tolerances: Tolerances,
    low: Kept | None = None,
) -> Standing:
    """Keep the cells of pieces that are as narrow as a head; `low` are rails that hardly stand out of their bed."""
    cells = _completed(found, kept, settings, tolerances)
    heads = whole_heads(shown.tops, cells, tolerances)
    chosen = label(shown.tops, heads, shown.cell, shown.height, tolerances)
    beside = Near.find(shown.xy[chosen], kept.lines)
    piece = pieces_of(len(kept.cell), kept.pairs)
    width_m, share_m = beside.widths(kept.lines, piece), own_lengths(kept, settings)
    narrow = (width_m < settings.head_width_m + tolerances.wider_m)[piece]
    kinds = _by_shape(kept, piece, width_m, narrow, shown, settings)
    clear = kinds[0] & (mean_of(kept.lines.height, piece) >= CLEAR_M)[piece]
    sharp_m, round_m, unsure_m, clear_m = (float(share_m[kind].sum()) for kind in (*kinds, clear))
    kept = _with_kept_partners(kept.of(narrow), settings, tolerances)
    beside = Near.find(shown.xy[chosen], kept.lines)
    others = _are_guards(kept, low, shown, settings, tolerances.partner_m)
    rails = _are_rails(kept, others, thin, beside, shown, settings, tolerances)
    standing = as_wanted(kept, rails, chosen, beside, thin, settings, tolerances)
    points = standing.points
    if not thin:  # from the air, nothing hides a head
        points = np.union1d(points, opposite_heads(standing.kept, shown, settings))
    return replace(standing, points=points, sharp_m=sharp_m, round_m=round_m, unsure_m=unsure_m, clear_m=clear_m)


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
    partnered = with_partner(kept.pairs, are_paired(kept.lines, settings, tolerances))
    kept = replace(kept, paired=kept.paired & partnered)
    kept = kept.of(partnered | are_certain(kept.lines, kept.paired, kept.pairs))
    return kept.of(are_long(kept, settings, settings.keep_single, tolerances.least_m))


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
        spread_m = Ridges.measure(shown.xy, shown.height, kept.lines, piece, SHOWN_SHARE).spread_m
        rounded = rounded & (spread_m > settings.head_width_m / 2)[piece]
        unsure = unsure & narrow & (spread_m <= settings.head_width_m / 2)[piece]
    return sharp, rounded, unsure


def _are_rails(
    kept: Kept,
    others: np.ndarray,
    thin: bool,
    beside: Near,
    shown: Shown,
    settings: Settings,
    tolerances: Tolerances,
) -> np.ndarray:
    """Return which cells of narrow pieces belong to rails, (n,) bool: those of a track, and some others.

    Rails without a partner are as narrow as a head and no narrower, stand as high as a rail does that is not buried in
    ballast, or as those that have a partner, on a bed that is not steep, and above the ground on either side. They are
    not guard or third rails, which are `others`, (n,) bool, they overhang, which thin squares do not show, and the
    other rail may be hidden. `beside` has the points in the height of the heads, and the cells near them.
    """
    partnered = with_partner(kept.pairs, kept.paired) & ~others
    piece = pieces_of(len(kept.cell), kept.pairs)
    if partnered.all():
        return partnered
    width_m, height_m = beside.widths(kept.lines, piece), mean_of(kept.lines.height, piece)
    narrow = width_m < settings.head_width_m + tolerances.wider_single_m
    narrow &= width_m >= SINGLE_WIDTH * settings.head_width_m
    high = height_m >= SINGLE_HEIGHT_M
    rails = kept.lines.height[partnered & (lengths(kept.lines.axis, piece) >= LEAST_SINGLE_M)[piece]]
    if len(rails):
        off_m = np.abs(height_m - np.median(rails))
        high = np.where(height_m > UNDER_FOOT_M, off_m < tolerances.partner_m, high | (off_m < AS_HIGH_M))
    slope = np.hypot(*shown.bed.gradients(kept.lines.axis).T)
    alone = narrow & high & (mean_of(slope, piece) <= STEEP)
    alone &= (
        above_sides(shown.xy, shown.z, replace(kept.lines, height=shown.tops.z.ravel()[kept.cell]), piece)
        >= SINGLE_RISE_M
    )
    mine = alone[piece] & ~partnered
    lines, (numbers, number) = kept.lines.of(mine), np.unique(piece[mine], return_inverse=True)
    alone[numbers] = may_hide_partner(lines, number, kept.cell[mine], shown.tops, settings, tolerances.partner_m)
    if not thin:  # wide beams blend a face with what is below it
        alone[numbers] &= ~are_solid(lines, number, shown.xy, shown.height, settings.head_width_m)
    return partnered | (alone[piece] & ~others)


def _are_guards(kept: Kept, low: Kept | None, shown: Shown, settings: Settings, height_m: float) -> np.ndarray:
    """Return which cells are of guard or third rails of a longer one, or of one with a partner, (n,) bool.

    Rails of a track may be among the kept ones, or among those that hardly stand out of their bed, `low`.

    A guard rail is as high as the rail within a gauge that it guards; it ends before that, and hides it from a scanner
    beside the track, so that the rail seems to go on as the guard rail. A third rail is higher and at most a little
    further away than the other rail; what is as far from a track on its outer side is a rail of the next one.
    `height_m` is the largest difference of partners.
    """
    count = len(kept.cell)
    if low is not None:
        kept = kept.with_others(low, settings.head_width_m)
    lines, z = kept.lines, shown.tops.z.ravel()[kept.cell]
    pairs = kept.pairs
    piece = pieces_of(len(kept.cell), pairs)
    length_m = np.where(with_partner(pairs, kept.paired), np.inf, lengths(lines.axis, piece)[piece])

    def inside(beyond_m: float, fits: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
        return runs_inside(
            lines, length_m, pairs, settings.gauges_m, settings.head_width_m, beyond_m, GUARD_SHORTER_M, fits
        )

    def as_high(own: np.ndarray, rail: np.ndarray) -> np.ndarray:
        return np.minimum(*(np.abs(one[own] - one[rail]) for one in (lines.height, z))) < AS_HIGH_M

    guards = inside(SPACING_M, as_high)
    to_partner = partner_sides(lines, settings.spacings_m, height_m)

    def higher(own: np.ndarray, rail: np.ndarray) -> np.ndarray:
        left_m = np.einsum("ij,ij->i", lines.axis[own] - lines.axis[rail], lines.across[rail])
        outside = left_m * to_partner[rail] < -THIRD_RAIL_M
        return (rise_above(lines, rail, own, rail) > HIGHER_M) & ~outside

    thirds = inside(THIRD_RAIL_M, higher)
    return ((mean_of(guards, piece) > MAJORITY) | (mean_of(thirds, piece) > MAJORITY))[piece[:count]]
