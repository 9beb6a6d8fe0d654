"""Rails of the points that the network labelled: what is too short for one is left out, and their figures.

Lines, partners and pieces are found as in `classify`. The network sees 4 m and does not know what continues beyond.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..classify.figures import shares_of_length
from ..classify.lines import Lines, Marks, find_lines
from ..classify.partner import stations_with_partner
from ..classify.pieces import links, long_enough
from ..classify.settings import THIN, Settings
from ..classify.tops import Grid
from ..rails import SearchFigures

REACH_M = 1.0
"""Distance within which the cells of labelled points are compared."""

LEVEL_M = 1.0
"""Labelled points this far apart in height may be on one line: on the decks of bridges and below them they are not."""

MIN_STATIONS = 2
"""Stations with a partner from which a cell belongs to a pair of rails; see `classify.square`."""


def rails_of(xyz: np.ndarray, settings: Settings) -> tuple[np.ndarray, SearchFigures]:
    """Choose among labelled points of a square, and sum up their rails.

    Parameters
    ----------
    xyz : (n, 3) array
        Metres from the square's corner.
    settings : Settings

    Returns
    -------
    (n,) bool array
        Points that are kept.
    SearchFigures
    """
    if not len(xyz):
        return np.zeros(0, dtype=bool), SearchFigures()
    grid, cell = Grid.around(xyz[:, 0], xyz[:, 1], settings.cell_m)
    cells = np.unique(cell)
    _, first = np.unique(grid.blocks(cells), return_index=True)
    marks = cells[np.sort(first)]
    highest = np.full(grid.shape[0] * grid.shape[1], -np.inf)
    np.maximum.at(highest, cell, xyz[:, 2])
    lines = find_lines(Marks(grid.middles(marks), highest[marks]), REACH_M, LEVEL_M, THIN.strip_m)
    paired = stations_with_partner(lines, settings.spacings_m, LEVEL_M) >= MIN_STATIONS
    pairs = links(lines)
    wanted = _wanted(lines, paired, pairs, settings)
    kept = wanted[cKDTree(grid.middles(marks)).query(xyz[:, :2])[1]]
    share_m = shares_of_length(lines, settings.head_width_m)
    near = settings.guide.crosses(lines) if settings.guide is not None else ()
    near_m = [float(share_m[chosen].sum()) for chosen in near] or [0.0, 0.0]
    figures = SearchFigures(
        points=int(kept.sum()),
        paired_m=float(share_m[wanted & paired].sum()),
        single_m=float(share_m[wanted & ~paired].sum()),
        cells=len(np.unique(cell[kept])),
        squares=int(kept.any()),
        along_m=near_m[0],
        across_m=near_m[1],
    )
    return kept, figures


def _wanted(lines: Lines, paired: np.ndarray, pairs: np.ndarray, settings: Settings) -> np.ndarray:
    """Return which cells belong to rails that are long enough and that the user wants, (n,) bool."""
    low, high = REACH_M / 2, settings.side_m - REACH_M / 2
    open_ended = np.any((lines.axis < low) | (lines.axis > high), axis=1)
    wanted = long_enough(lines, pairs, paired, open_ended, settings.keep_single)
    if settings.guide is not None:
        wanted &= settings.guide.keeps(lines, pairs, settings.spacings_m, LEVEL_M)
    return wanted
