"""From the cells of kept pieces to the points of railheads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .lines import Lines
from .pieces import HIDDEN_M
from .settings import Tolerances
from .tops import EMPTY, MILLIMETRES, TENTHS_OF_MM, Grid, Tops, Window

HEAD_M = 0.11
"""Distance within which a higher kept cell shows that a lower one is the foot of the rail or a fastening."""

MEAN_M = 0.30
"""Half the side of the window of the mean top."""

UNDER_MEAN_M = 0.02
"""Tops this far below the mean are left out of it: a wide beam at the side of a head blends it with the ballast."""

NEAREST, MIN_AXES = 6, 2
"""Axes that are looked at for a place, and how many of them it must be on: where two heads part there are some of
each, and single axes are led astray by a guard rail."""

BEYOND_M = HIDDEN_M + 0.3
"""Distance to an axis up to which a place may be on it. Behind a wheel at the end of a cloud, the rail is too short to
show its direction: the axis before the wheel continues to it, and over some of its cells."""

WIDEST_M = 0.075
"""Distance from the axis within which points count towards the width of a top: short of a guard rail."""


def whole_heads(tops: Tops, kept: np.ndarray, tolerances: Tolerances) -> np.ndarray:
    """Spread kept cells, one of each block of 2 x 2, over the others of their blocks, and drop feet and fastenings.

    Returns the cells in rising order, (m,).
    """
    rows, columns = tops.grid.shape
    row, column = np.divmod(kept, columns)
    image = np.zeros(tops.grid.shape, dtype=bool)
    top = tops.top.astype(np.int32)
    own = top[row, column]
    spread = round(tolerances.spread_m * MILLIMETRES)
    first_row, first_column = (row + tops.grid.row) // 2 * 2 - tops.grid.row, (column + tops.grid.column) // 2 * 2
    first_column = first_column - tops.grid.column
    for down in (0, 1):
        for right in (0, 1):
            r, c = np.clip(first_row + down, 0, rows - 1), np.clip(first_column + right, 0, columns - 1)
            near = np.abs(top[r, c] - own) <= spread
            image[r[near], c[near]] = True
    cells = np.flatnonzero(image)
    highest = _highest_around(np.where(image, top, int(EMPTY)), cells, HEAD_M / tops.grid.cell_m)
    return cells[tops.top.ravel()[cells] >= highest - spread]


def _highest_around(image: np.ndarray, cells: np.ndarray, reach: float) -> np.ndarray:
    """Highest value of an image within `reach` cells of each cell, (k,)."""
    rows, columns = image.shape
    row, column = np.divmod(cells, columns)
    highest = image.ravel()[cells]
    whole = int(reach)
    for down in range(-whole, whole + 1):
        for right in range(-whole, whole + 1):
            if down * down + right * right <= reach * reach:
                r, c = np.clip(row + down, 0, rows - 1), np.clip(column + right, 0, columns - 1)
                highest = np.maximum(highest, image[r, c])
    return highest


def label(tops: Tops, heads: np.ndarray, cell: np.ndarray, height: np.ndarray, tolerances: Tolerances) -> np.ndarray:
    """Find the points in the height of railheads on cells, (m,), and the neighbouring ones, (k,) int numbers.

    Given are the cell of each point and its height above the bed, (n,).
    """
    if not len(heads):
        return np.empty(0, dtype=np.int64)
    image = np.zeros(tops.grid.shape, dtype=bool)
    image.ravel()[heads] = True
    around = _with_neighbours(tops.grid, heads)
    window = Window(tops.grid, around, round(MEAN_M / tops.grid.cell_m))
    top = np.full(image.size, np.inf, dtype=np.float32)
    top[around] = _mean_tops(window, tops, image)
    image.ravel()[heads] = tops.top.ravel()[heads] >= (top[heads] - UNDER_MEAN_M) * MILLIMETRES
    top[around] = _mean_tops(window, tops, image)
    top = top[cell]
    below_m = np.minimum(tolerances.below_m, tolerances.below_share * top)
    return np.flatnonzero((height >= top - below_m) & (height <= top + tolerances.above_m))


def _mean_tops(window: Window, tops: Tops, image: np.ndarray) -> np.ndarray:
    """Mean top of the cells of an image in each window, (k,) metres."""
    return window.sums(np.where(image, tops.top, 0)) / np.maximum(window.sums(image), 1) / MILLIMETRES


@dataclass(frozen=True)
class Near:
    """A `count` of places, and the cells nearest to them.

    `place` and `cell`, (m,), are pairs, of which the nearest cell of each place comes first; `across`, (m,) metres, is
    how far the place is across from the axis of the cell.
    """

    count: int
    place: np.ndarray
    cell: np.ndarray
    across: np.ndarray

    @classmethod
    def find(cls, xy: np.ndarray, lines: Lines) -> Near:
        """Find the `NEAREST` cells around places, (k, 2)."""
        if not len(xy) or not len(lines.axis):
            return cls(len(xy), np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0))
        count = np.arange(1, min(NEAREST, len(lines.axis)) + 1)
        near = cKDTree(lines.axis).query(xy, k=count, distance_upper_bound=max(lines.reach_m, BEYOND_M))[1]
        place, rank = np.nonzero(near < len(lines.axis))
        cell = near[place, rank]
        across = np.einsum("ij,ij->i", xy[place] - lines.axis[cell], lines.across[cell])
        return cls(len(xy), place, cell, across)

    def on(self, half_m: float, fits: np.ndarray) -> np.ndarray:
        """Return which places are within `half_m` of `MIN_AXES` axes that fit, (m,) bool; (count,) bool."""
        on = (np.abs(self.across) <= half_m) & fits
        return np.bincount(self.place[on], minlength=self.count) >= MIN_AXES

    def widths(self, piece: np.ndarray) -> np.ndarray:
        """Width of the top of each piece: that of a bar whose points scatter across as much, (pieces,) metres.

        `piece` has the piece of each cell, (cells,).
        """
        inside = np.abs(self.across) < WIDEST_M
        # Whole numbers add up to the same sum in any order of the points.
        across, number = np.round(self.across[inside] * TENTHS_OF_MM), piece[self.cell[inside]]
        count = int(piece.max()) + 1 if len(piece) else 0
        points = np.maximum(np.bincount(number, minlength=count), 1)
        mean = np.bincount(number, across, count) / points
        spread = np.sqrt(np.maximum(np.bincount(number, across**2, count) / points - mean**2, 0))
        return np.sqrt(12) * spread / TENTHS_OF_MM


def _with_neighbours(grid: Grid, cells: np.ndarray) -> np.ndarray:
    """Cells and their eight neighbours, in rising order."""
    rows, columns = grid.shape
    row, column = np.divmod(cells, columns)
    around = [
        np.clip(row + down, 0, rows - 1) * columns + np.clip(column + right, 0, columns - 1)
        for down in (-1, 0, 1)
        for right in (-1, 0, 1)
    ]
    return np.unique(np.concatenate(around))
