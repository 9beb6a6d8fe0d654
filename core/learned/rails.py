"""Rails of the points that the network found: what is too short is left out, what continues a rail is added.

Lines, partners and pieces are found as in `classify`. The network sees 4 m and does not know what continues beyond.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..classify.labels import Near
from ..classify.lines import Lines, Marks, find_lines
from ..classify.partner import have_partners
from ..classify.pieces import links, long_enough, shares_of_length
from ..classify.settings import DENSE, THIN, Settings
from ..classify.square import beside_guide
from ..classify.tops import Grid
from ..rails import SearchFigures

LEVEL_M = 1.0
"""Labelled points this far apart in height may be on one line: on the decks of bridges and below them they are not."""

GRADIENT = 0.04
"""Steepest gradient of railways: by how much the top of a rail rises along it."""


def rails_of(xyz: np.ndarray, sure: np.ndarray, settings: Settings, reach_m: float) -> tuple[np.ndarray, SearchFigures]:
    """Choose among points of a square that may be on rails, and sum up their rails.

    Parameters
    ----------
    xyz : (n, 3) array
        Metres from the square's corner.
    sure : (n,) bool array
        Points that the network labels. The others are kept if they lie on the axis of a rail of these.
    reach_m : float
        Distance within which cells are compared.

    Returns
    -------
    (n,) bool array
        Points that are kept.
    SearchFigures
    """
    if not sure.any():
        return sure, SearchFigures()
    grid, cell = Grid.around(xyz[:, 0], xyz[:, 1], settings.cell_m)
    cells = np.unique(cell[sure])
    _, first = np.unique(grid.blocks(cells), return_index=True)
    marks = cells[np.sort(first)]
    highest = np.full(grid.shape[0] * grid.shape[1], -np.inf)
    np.maximum.at(highest, cell[sure], xyz[sure, 2])
    lines = find_lines(Marks(grid.middles(marks), highest[marks]), reach_m, LEVEL_M, THIN.beside_line_m)
    paired = have_partners(lines, settings.spacings_m, LEVEL_M)
    pairs = links(lines)
    wanted = _wanted(lines, paired, pairs, settings)
    kept = sure & wanted[cKDTree(grid.middles(marks)).query(xyz[:, :2])[1]]
    kept[~sure] = _continue(lines.of(wanted), xyz[~sure], settings.head_width_m)
    share_m = shares_of_length(lines, settings.head_width_m)
    along_m, across_m = beside_guide(lines, settings)
    figures = SearchFigures(
        points=int(kept.sum()),
        paired_m=float(share_m[wanted & paired].sum()),
        single_m=float(share_m[wanted & ~paired].sum()),
        cells=len(np.unique(cell[kept])),
        squares=int(kept.any()),
        along_m=float(along_m),
        across_m=float(across_m),
    )
    return kept, figures


def _continue(lines: Lines, xyz: np.ndarray, head_width_m: float) -> np.ndarray:
    """Return which points, (n, 3), lie on the heads of rails, (n,) bool."""
    near = Near.find(xyz[:, :2], lines)
    place = xyz[near.place]
    above = place[:, 2] - lines.height[near.cell]
    rise_m = GRADIENT * np.hypot(*(place[:, :2] - lines.axis[near.cell]).T)
    level = (above >= -DENSE.below_m - rise_m) & (above <= DENSE.above_m + rise_m)
    return near.on(head_width_m / 2 + DENSE.beside_m, level)


def _wanted(lines: Lines, paired: np.ndarray, pairs: np.ndarray, settings: Settings) -> np.ndarray:
    """Return which cells belong to rails that are long enough and that the user wants, (n,) bool."""
    low, high = lines.reach_m / 2, settings.side_m - lines.reach_m / 2
    open_ended = np.any((lines.axis < low) | (lines.axis > high), axis=1)
    wanted = long_enough(lines, pairs, paired, open_ended, settings.keep_single)
    if settings.guide is not None:
        wanted &= settings.guide.keeps(lines, pairs, settings.spacings_m, LEVEL_M)
    return wanted
