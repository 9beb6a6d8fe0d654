"""Rails of a blunt cloud: ridges, which are as wide as the blur."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .cells import Kept, Shown, Standing, as_wanted, fitting
from .labels import Near, label
from .lines import SINGLE_COVER
from .pieces import mean_of, pieces_of, with_partner
from .ridges import Ridges, cells_beside, on_crests
from .settings import BLUNT, Settings


def on_ridges(kept: Kept, thin: bool, shown: Shown, settings: Settings) -> Standing:
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
        kept = fitting(kept, piece, heads, settings, BLUNT)
        kept = replace(kept, lines=on_crests(shown.xy, shown.height, kept.lines, blur_m))
    cells = cells_beside(shown.tops.grid, kept.lines, settings.head_width_m / 2 + BLUNT.beside_m)
    chosen = label(shown.tops, cells, shown.cell, shown.height, BLUNT)
    beside = Near.find(shown.xy[chosen], kept.lines)
    every = np.ones(len(kept.cell), dtype=bool)
    return replace(as_wanted(kept, every, chosen, beside, thin, settings, BLUNT), blur_m=blur_m)
