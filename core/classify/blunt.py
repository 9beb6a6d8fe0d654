"""Rails of a blunt cloud: ridges, which are as wide as the blur."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .cells import Kept, Shown, Standing, are_paired, as_wanted, fitting
from .labels import Near, label
from .lines import SINGLE_COVER, Lines, joined
from .partner import off_gauge
from .pieces import LEAST_PAIRED, links, mean_of, pieces_of, with_partner
from .ridges import Ridges, cells_beside, mean_along, on_crests, sides_of
from .settings import BLUNT, Settings

WIDER_M = 0.03
"""How much wider half-way down than most ridges of one head in the square one is that has more heads in it, and a
quarter of the way down than its partner. Up to 20 mm more, crests are 8 mm off the axis (median in four worlds from
images), from 40 mm on 38 to 55 mm."""

SHOWN_SHARE = 0.1
"""Least share of the points of the other side from which a bin of a ridge counts. Images show fewer points on some
ridges by chance, and none in shadow; but a sharp cloud that is searched in this way must not show its shadows as the
sides of ridges (world 14957)."""

AVERAGED_M = 1.0
"""Length to either side over which this is averaged: that of single cells scatters by 12 mm."""

AT_GAUGE_M = 0.04
"""Deviation of the distance of the two heads of a track, as blurred images show it. A check rail is 0.11 m from its
rail."""


def on_ridges(kept: Kept, thin: bool, shown: Shown, settings: Settings) -> Standing:
    """Keep the cells of ridges that may be heads, with their axes on the crests.

    All of them have a partner, because a mound of this width is as round; and only they show the blur, because the
    width of other things is not known.
    """
    blur_m = 0.0
    kept = kept.of(with_partner(kept.pairs, kept.paired))
    if len(kept.cell):
        piece = pieces_of(len(kept.cell), kept.pairs)
        ridges = Ridges.measure(shown.xy, shown.height, kept.lines, piece, SHOWN_SHARE)
        blur_m = ridges.blur_m
        one = ridges.may_be_heads(settings.head_width_m)
        of_one = kept.cell[one[piece]]
        heads = one | _are_two(kept, piece, ridges, one, settings)
        heads &= mean_of(kept.lines.cover, piece) >= SINGLE_COVER  # sleepers show gaps in images, and rails none
        kept = fitting(kept, piece, heads, settings, BLUNT)
        crests = on_crests(shown.xy, shown.height, kept.lines, blur_m)
        kept = _on_heads(kept, crests, np.isin(kept.cell, of_one), shown, settings)
    cells = cells_beside(shown.tops.grid, kept.lines, settings.head_width_m / 2 + BLUNT.beside_m)
    chosen = label(shown.tops, cells, shown.cell, shown.height, BLUNT)
    beside = Near.find(shown.xy[chosen], kept.lines)
    every = np.ones(len(kept.cell), dtype=bool)
    return replace(as_wanted(kept, every, chosen, beside, thin, settings, BLUNT), blur_m=blur_m)


def _are_two(kept: Kept, piece: np.ndarray, ridges: Ridges, one: np.ndarray, settings: Settings) -> np.ndarray:
    """Return which pieces, of (n,) cells, are two heads side by side whose partner is `one`, (pieces,) bool each.

    Images blur a rail and its guard rail to one ridge. A wall is as wide, but so is the wall at its side.
    """
    two = ridges.may_be_two_heads(settings.head_width_m) & ~one
    for number in np.flatnonzero(two):
        own = piece == number
        among = own | (one & (ridges.width_m < ridges.width_m[number] - WIDER_M))[piece]
        two[number] = are_paired(kept.lines.of(among), settings, BLUNT)[own[among]].mean() >= LEAST_PAIRED
    return two


def _on_heads(kept: Kept, crests: Lines, of_one: np.ndarray, shown: Shown, settings: Settings) -> Kept:
    """Move cells onto the crests of their ridges, and those of wide ridges onto the heads at their sides.

    Two heads side by side, as of a check or wing rail, are one ridge with a head at either side, wider than most that
    are `of_one`, (n,) bool. Each is a rail if it is at gauge from another one, and both only if the ridge is as wide as
    two. If neither is, the crest stays.
    """
    left_m, right_m = sides_of(shown.mean_heights(), shown.tops.grid, kept.lines)
    width_m = left_m + right_m
    if not np.isfinite(width_m[of_one]).any():
        return replace(kept, lines=crests)
    head_m = float(np.nanmedian(width_m[of_one]))
    wider_m = mean_along(width_m - head_m, kept.lines, AVERAGED_M)
    is_wide = (wider_m > WIDER_M) & np.isfinite(width_m)
    wide, narrow = np.flatnonzero(is_wide), np.flatnonzero(~is_wide)
    left, right = (kept.lines.moved(by_m).of(wide) for by_m in (left_m - head_m / 2, head_m / 2 - right_m))
    heads = joined(crests.of(narrow), joined(left, right))
    off_m = off_gauge(heads, settings.spacings_m, AT_GAUGE_M, BLUNT.partner_m)[len(narrow) :].reshape(2, -1)
    best = np.isfinite(off_m) & ((off_m <= off_m.min(axis=0)) | (wider_m[wide] >= settings.head_width_m))
    chosen = np.concatenate([np.ones(len(narrow), dtype=bool), *best, ~best.any(axis=0)])
    lines, number = joined(heads, crests.of(wide)).of(chosen), np.concatenate([narrow, wide, wide, wide])[chosen]
    return Kept(lines, kept.cell[number], kept.paired[number], links(lines))
