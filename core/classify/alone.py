"""Bars without a partner: what tells the visible rail of a hidden pair from kerbs, edges of troughs and third rails.

A rail has another at gauge. So one that stands alone has a place beside it that the cloud does not show, because
something hides the other rail. And the head of a rail overhangs its web, while the face of a kerb goes straight down.
"""

from __future__ import annotations

import numpy as np

from .lines import Lines
from .partner import SPACING_M
from .pieces import mean_of, to_one_side
from .ridges import nearest
from .settings import Settings
from .tops import HIGH_M, MILLIMETRES, Tops

PLACES, ON_HEAD = np.linspace(-1.0, 1.0, 5), np.array([-0.4, 0.0, 0.4])
"""Places of the other head, by the deviation of the distance of two heads, and places on it, by the width of a head."""

WAY = np.linspace(0.2, 0.9, 10)
"""Places on the way to the other head, by its distance."""

SHOWN = 0.5
"""Cells with lower ground at a place, by those on the way there, from which no head is there. Measured: up to 0.25
where the other rail is hidden, and from 0.6 on beside third rails, guard rails and edges of troughs."""

LOWEST_M = 0.02
"""Height by which lower ground may be above the bed, which scatters as much."""

UNDER_FOOT_M = 0.20
"""Height of a head above the bed from which its bed is seen below the foot of the rail, too, and lower ground at the
place of a head does not show that there is none: the tallest rails have 190 mm, and 10 mm of pad."""

FACE_M, BELOW_M = (0.01, 0.025), (0.055, 0.10)
"""Depths below the top of the face of a head, and of what is below the head: its web, above the foot. The face of the
lightest rails ends at 25 mm."""

BED_M = 0.02
"""Least height of these depths above the bed, whose stones lie against the web."""

NEAR_M, BESIDE_M = 0.25, 0.03
"""Distance from a cell of a bar within which points are compared, and distance beyond the side of a head within which
they are on it: both errors of an axis of which one face alone is seen."""

IN_LINE, MOST = 1 / 6, 0.6
"""Distance from a face, in head widths, within which points below are in line with it, and share of them from which it
goes on: a web is 0.3 to 0.4 behind, and a kerb at most 0.05."""

AS_DENSE = 0.65
"""Points per depth below the face, by those on it, from which it goes on: 0.8 and more on kerbs. Where the head is seen
from above, it hides its web, and fastenings beside it give 0.45."""

MIN_POINTS = 20
"""Points on a face that show where it is."""


def may_hide_partner(
    lines: Lines, piece: np.ndarray, cells: np.ndarray, tops: Tops, settings: Settings, height_m: float
) -> np.ndarray:
    """Return which pieces have a place, at one of the distances of two heads, that may hold one, (pieces,) bool.

    Lines are those of `cells`, (n,), on `piece`, (n,). A head differs by at most `height_m` from theirs; ground that is
    lower shows that there is none, where it is seen as often as on the way there.
    """
    low_m, across = lines.height - height_m, to_one_side(lines, piece)
    hidden = (mean_of(low_m, piece) < LOWEST_M) | (mean_of(lines.height, piece) > UNDER_FOOT_M)

    def lower(places_m: np.ndarray) -> np.ndarray:
        """Return the share of places beside each piece that show lower ground and nothing else, (pieces,)."""
        found = [_is_lower(lines.axis + place_m * across, cells, low_m, tops) for place_m in places_m]
        return mean_of(np.sum(found, axis=0), piece) / len(places_m)

    for left_m in [side * spacing_m for spacing_m in settings.spacings_m for side in (1, -1)]:
        on_the_way = lower(left_m * WAY)
        for place_m in left_m + SPACING_M * PLACES:
            hidden |= lower(place_m + settings.head_width_m * ON_HEAD) <= SHOWN * on_the_way
    return hidden


def _is_lower(xy: np.ndarray, cells: np.ndarray, low_m: np.ndarray, tops: Tops) -> np.ndarray:
    """Return which places, (n, 2), show ground lower than `low_m`, (n,), above the bed and nothing else, (n,) bool.

    They are beside `cells`, (n,). The vault over hidden ground is not lower ground.
    """
    z, (cell, inside) = tops.z.ravel(), tops.grid.cells(xy)
    seen = inside & tops.seen.ravel()[cell] & ~tops.high.ravel()[cell]
    return seen & (tops.top.ravel()[cell] < low_m * MILLIMETRES) & (np.abs(z[cells] - z[cell]) < HIGH_M)


def are_solid(lines: Lines, piece: np.ndarray, xy: np.ndarray, height: np.ndarray, head_width_m: float) -> np.ndarray:
    """Return which pieces have a face that goes straight down, as that of a kerb, (pieces,) bool.

    Cells are on `piece`, (n,); points are at `xy`, (m, 2), and at a `height` above the bed, (m,).
    """
    mean_m = mean_of(lines.height, piece)
    solid = np.zeros(len(mean_m), dtype=bool)
    if not len(piece):
        return solid
    near = np.flatnonzero((height > lines.height.min() - BELOW_M[1]) & (height < lines.height.max() - FACE_M[0]))
    within, cell = nearest(xy[near], lines.axis, NEAR_M)
    near = near[within]
    across = np.einsum("ij,ij->i", xy[near] - lines.axis[cell], to_one_side(lines, piece)[cell])
    depth, number = lines.height[cell] - height[near], piece[cell]
    for one in np.flatnonzero(mean_m >= BELOW_M[1] + BED_M):
        mine = number == one
        solid[one] = _goes_down(across[mine], depth[mine], head_width_m)
    return solid


def _goes_down(across: np.ndarray, depth: np.ndarray, head_width_m: float) -> bool:
    """Return whether the face that is seen best goes on below a head, by points across and below the top."""
    half_m = head_width_m / 2
    on = np.abs(across) < half_m + BESIDE_M
    face, below = (on & (depth > low) & (depth < high) for low, high in (FACE_M, BELOW_M))
    outward = across * (1 if np.sum(across[face] > 0) > np.sum(across[face] < 0) else -1)
    face, below = outward[face & (outward > 0)], outward[below & (outward > -half_m)]
    if len(face) < MIN_POINTS or len(below) / np.ptp(BELOW_M) < AS_DENSE * len(face) / np.ptp(FACE_M):
        return False
    in_line = np.abs(below - np.median(face)) < IN_LINE * head_width_m
    return bool(np.mean(in_line) >= MOST)
