"""Cells for rails that are too thin for FRPDF: drawn along the lines on which the cells of a rail are.

They show the network where the rail runs and carry no measurement: as points they would cost accuracy. They depend on
the cells within `SURROUNDINGS_M` only, and there are none where rails are dense (docs/method.md section 2.3).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from .lines import SINGLE_COVER, Lines, Marks, find_lines, joined
from .partner import have_partners
from .pieces import links
from .tops import Grid

ENOUGH_PER_M = 14.0
"""Cells per metre of rail from which nothing is drawn: FRPDF finds all of a rail from here on, and 91 to 99 % of one
with 7 to 10 cells per metre."""

WITHIN_M = 2.0
"""Length to one side in which cells are counted."""

REACH_M = 2.0
"""Reach of a line: 10 cells to either side at 5 cells per metre."""

ALONG_M = 0.15
"""Difference in height between two cells of one rail: a grade of 4 % over the reach, and a beam that blends head and
ballast."""

BESIDE_LINE_M = 0.065
"""Distance from a line within which a cell is on it: half a head, half a cell, noise, and the sagitta of a curve of
100 m."""

PARTNER_M = 0.30
"""Difference in height between the rails of a track: cant of 180 mm and the scatter of both."""

PARTNER_WITHIN_M = 3.0
"""Distance within which cells may be a partner's: the stations reach 1.2 m ahead, the widest gauge is 1.7 m."""

SURROUNDINGS_M = 6.0
"""Distance within which other cells count: that of a partner, and its reach."""


def drawn(xyz: np.ndarray, spacings_m: Sequence[float], cell_m: float) -> np.ndarray:
    """Places along thin rails, half a cell apart, (k, 2) local metres, given rail points, (n, 3).

    `spacings_m` are the distances of the two heads of a track.
    """
    cells = _cells(xyz, cell_m)
    if len(cells.xy) < 2:
        return np.empty((0, 2))
    tree = cKDTree(cells.xy)
    few = tree.query_ball_point(cells.xy, WITHIN_M, return_length=True) < 2 * WITHIN_M * ENOUGH_PER_M
    own, lines = _good_lines(cells, np.flatnonzero(few))
    thin = _per_m(lines, cells.xy) < ENOUGH_PER_M
    if not thin.any():
        return np.empty((0, 2))
    own, lines = own[thin], lines.of(thin)
    beside = np.isfinite(cKDTree(lines.axis).query(cells.xy, distance_upper_bound=PARTNER_WITHIN_M)[0])
    beside[own] = False
    _, partners = _good_lines(cells, np.flatnonzero(beside))
    both = joined(lines, partners)
    paired = have_partners(both, spacings_m, PARTNER_M)[: len(own)]
    lines = lines.of(paired | (lines.cover >= SINGLE_COVER))  # FRPDF itself drops lone lines that are short
    return _along(lines, _nearest_on_each_side(lines, links(lines)), cell_m / 2)


def _good_lines(cells: Marks, wanted: np.ndarray) -> tuple[np.ndarray, Lines]:
    """Find the lines of some cells, (k,) int, that are on one: those cells, (m,), and their lines."""
    lines = find_lines(cells, REACH_M, ALONG_M, BESIDE_LINE_M, wanted)
    good = lines.good()
    return good, lines.of(good)


def _cells(xyz: np.ndarray, cell_m: float) -> Marks:
    """Cells with points, and the height of the highest point of each."""
    if not len(xyz):
        return Marks(np.empty((0, 2)), np.empty(0))
    grid, cell = Grid.around(xyz[:, 0], xyz[:, 1], cell_m)
    order = np.lexsort((xyz[:, 2], cell))
    highest = np.flatnonzero(np.diff(cell[order], append=-1))
    return Marks(grid.middles(cell[order[highest]]), xyz[order[highest], 2])


def _along(lines: Lines, pairs: np.ndarray, step_m: float) -> np.ndarray:
    """Places `step_m` apart from one axis of each pair to the other, (k, 2)."""
    start, end = lines.axis[pairs[:, 0]], lines.axis[pairs[:, 1]]
    count = np.ceil(np.linalg.norm(end - start, axis=1) / step_m).astype(np.int64) + 1
    pair = np.repeat(np.arange(len(count)), count)
    share = (np.arange(count.sum()) - (np.cumsum(count) - count)[pair]) / (count[pair] - 1)
    return start[pair] + share[:, None] * (end - start)[pair]


def _nearest_on_each_side(lines: Lines, pairs: np.ndarray) -> np.ndarray:
    """Keep the shortest pair of each cell ahead of it and behind it, (k, 2)."""
    both = np.concatenate([pairs, pairs[:, ::-1]])
    step = lines.axis[both[:, 1]] - lines.axis[both[:, 0]]
    ahead = np.einsum("ij,ij->i", step, lines.along[both[:, 0]])
    order = np.lexsort((both[:, 1], np.abs(ahead)))
    side = 2 * both[order, 0] + (ahead[order] > 0)
    return both[order[np.unique(side, return_index=True)[1]]]


def _per_m(lines: Lines, cells: np.ndarray) -> np.ndarray:
    """Cells per metre around each line's cell, (n,); at the end of a rail, on the side where it is."""
    near = cKDTree(lines.axis).sparse_distance_matrix(cKDTree(cells), WITHIN_M, output_type="ndarray")
    own = near["i"]
    step = cells[near["j"]] - lines.axis[own]
    on = np.abs(np.einsum("ij,ij->i", step, lines.across[own])) < BESIDE_LINE_M
    own, ahead = own[on], np.einsum("ij,ij->i", step, lines.along[own])[on] > 0
    counts = [np.bincount(own[ahead == side], minlength=len(lines.axis)) for side in (True, False)]
    return np.maximum(*counts) / WITHIN_M
