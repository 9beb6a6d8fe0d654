"""Heads opposite rails without a partner: at gauge and as high, but too little of them is seen to be found alone.

A guard or check rail between the scanner and a head hides its face and the ground beside it, so that nothing shows that
its top is narrow. But every rail has another one at gauge, and what is as narrow as a head there and as high as the
rail is its partner.
"""

from __future__ import annotations

import numpy as np

from .cells import Kept, Shown
from .labels import quantiles, sections
from .lines import Lines
from .partner import MAJORITY, STEEP
from .pieces import pieces_of, shares_of_length, to_one_side
from .ridges import nearest
from .settings import Settings

LEVEL_M = 0.06
"""Largest difference in height of the two heads of a track beyond the slope of the bed across: a bed whose slope
differs by 1 in 25 from the cant of the track. Measured in world 15177: 10 mm."""

TOP_SHARE, ON_TOP_M = 0.8, 0.02
"""Share of the points in this height that are below the level of the top, and distance from this level up to which
points are on the top: noise of 5 mm and the slope of a head."""

BESIDE_M, FREE_M = 0.015, 0.03
"""Distance beyond the side of a head up to which points are on it, by the error of the axis; and width beyond this that
hardly shows points as high: a guard rail is further away."""

FREE_SHARE = 0.25
"""Most points there and above the head, by those on the head: a pavement has six tenths, a head none."""

LEAST_PER_M, LEAST_M = 8.0, 3.0
"""Points on the top per metre, and length, that show a head: world 15177 has 21 to 47 points, and the length is twice
that of the shortest piece with a partner."""


def opposite_heads(kept: Kept, shown: Shown, settings: Settings) -> np.ndarray:
    """Find the points of heads at gauge from cells of rails without a partner, (k,) numbers in rising order."""
    found = [np.empty(0, dtype=np.int64)]
    alone = ~kept.paired
    if alone.any():
        piece = pieces_of(len(kept.cell), kept.pairs)
        across, z = to_one_side(kept.lines, piece), shown.tops.z.ravel()[kept.cell]
        slope = shown.bed.gradients(kept.lines.axis)
        slope[np.hypot(*slope.T) > STEEP] = 0.0
        for left_m in [side * spacing_m for spacing_m in settings.spacings_m for side in (1, -1)]:
            step = left_m * across
            up_m = z + np.einsum("ij,ij->i", slope, step)
            found.append(_heads(kept.lines.of(alone), piece[alone], step[alone], up_m[alone], shown, settings))
    return np.unique(np.concatenate(found))


def _heads(
    lines: Lines, piece: np.ndarray, step: np.ndarray, up_m: np.ndarray, shown: Shown, settings: Settings
) -> np.ndarray:
    """Find the points of heads that are a `step`, (n, 2), from cells of pieces, (n,), at a height `up_m`, (n,)."""
    section, half_m = sections(lines, piece), settings.head_width_m / 2 + BESIDE_M
    places, reach_m = lines.axis + step, half_m + FREE_M
    near, cell = nearest(shown.xy, places, reach_m)
    level = np.abs(shown.z[near] - up_m[cell]) < LEVEL_M + ON_TOP_M
    near, cell = near[level], cell[level]
    off_m = np.abs(np.einsum("ij,ij->i", shown.xy[near] - places[cell], lines.across[cell]))
    rise_m, of, count = shown.z[near] - up_m[cell], section[cell], int(section.max()) + 1
    inside = off_m < half_m
    level = inside & (np.abs(rise_m) < LEVEL_M)
    top_m = np.zeros(count)
    tops = quantiles(rise_m[level], of[level], TOP_SHARE)
    top_m[: len(tops)] = tops
    above_m = rise_m - top_m[of]
    flat = np.abs(above_m) < ON_TOP_M
    on, beside, higher = (
        np.bincount(of[chosen], minlength=count)
        for chosen in (flat & inside, flat & ~inside, inside & (above_m >= ON_TOP_M))
    )
    share_m = shares_of_length(lines, settings.head_width_m)
    length_m = np.bincount(section, share_m, count)
    good = (on >= LEAST_PER_M * length_m) & (np.maximum(beside, higher) <= FREE_SHARE * on)
    good_m = np.bincount(piece, share_m * good[section])
    heads = (good_m >= LEAST_M) & (good_m > MAJORITY * np.bincount(piece, share_m))
    return near[flat & inside & good[of] & heads[piece[cell]]]
