"""From the cells of kept pieces to the points of railheads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .lines import Lines
from .pieces import HIDDEN_M, to_one_side
from .settings import Tolerances
from .tops import EMPTY, MILLIMETRES, Grid, Tops, Window

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

SECTION_M, BEYOND_SHARE = 1.0, 0.05
"""Length of a rail over which a width is measured, and share of the points of a top, on either side, that may be off
the bar. A scanner far away shows both faces of a head and hardly its crown, so that the scatter of the points would be
up to 1.7 times as large as that of points everywhere on a head; these shares are 1.1 times as far apart. Along a rail,
now one face is seen and now the other, and the axis follows. Measured by tripods: 17 mm wider than a head at most, and
28 mm by scatter over whole pieces; kerbs of 150 mm 62 mm, and 52 mm by scatter."""


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

    def widths(self, lines: Lines, piece: np.ndarray) -> np.ndarray:
        """Width of the top of each piece, (pieces,) metres; 0 without points.

        `lines` are those of the cells, on `piece`, (cells,). The width of a section is that of a bar on which points
        are everywhere alike, and that of a piece the median over its points.
        """
        inside = np.abs(self.across) < WIDEST_M
        cell, number = self.cell[inside], sections(lines, piece)
        left = np.einsum("ij,ij->i", to_one_side(lines, number), lines.across)
        section, across = number[cell], left[cell] * self.across[inside]
        low, high = (quantiles(across, section, share) for share in (BEYOND_SHARE, 1 - BEYOND_SHARE))
        width_m = (high - low) / (1 - 2 * BEYOND_SHARE)
        median = quantiles(width_m[section], piece[cell], 0.5)
        return np.append(median, np.zeros(int(piece.max(initial=-1)) + 1 - len(median)))


def sections(lines: Lines, piece: np.ndarray) -> np.ndarray:
    """Return the section of each cell, (n,) numbers: the part of its piece that is in one square metre."""
    place = np.column_stack([piece, np.floor(lines.axis / SECTION_M)])
    return np.unique(place, axis=0, return_inverse=True)[1].ravel()


def quantiles(values: np.ndarray, group: np.ndarray, share: float) -> np.ndarray:
    """Quantile of the values, (n,), of each group, up to the last that has any, (groups,); 0 without any.

    Of n values, the k-th has k / (n + 1) of all below it: so few of them do not seem to be closer than many.
    """
    count = np.bincount(group)
    place = np.clip(share * (count + 1) - 1, 0, np.maximum(count - 1, 0))
    first = np.cumsum(count) - count + place.astype(np.int64)
    ordered = np.append(values[np.lexsort((values, group))], (0.0, 0.0))
    part = place % 1
    return np.where(count > 0, (1 - part) * ordered[first] + part * ordered[first + 1], 0.0)


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
