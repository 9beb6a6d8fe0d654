"""Tops of cells, and which of them are narrow: what stands out of the bed by the height of a rail and is not wider."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..raster import BORDER_CELLS

LOW_M, TOP_M = 0.055, 0.40
"""Heights of railheads above the bed: from yards that are filled with ballast to heavy rails on plates."""

HIGH_M = 0.95
"""Points between `TOP_M` and this mark walls, fences, masts, wheels and plants; wires and bridges are higher."""

WINDOW_M = 0.26
"""Half the side of the window in which a top must be narrow: the window holds one rail and its surroundings."""

DEPTH_M = 0.045
"""Cells up to this far below a top count as part of it: the height of a head."""

AROUND_M = 0.08
"""Half the side of the window that shows the density with which a top is seen: a head, and a cell on either side."""

MAX_SHARE, SHADOWED_SHARE = 0.50, 0.60
"""Largest share of the other seen cells of the window that the top may fill, also where the top is `ABOVE_STONES_M`
above the bed and what is not seen may be in a shadow. A rail fills 0.14 to 0.25, with its foot or a guard rail 0.38,
ballast and kerbs half and more, the edges of a cable trough 0.60 to 0.65; two heads in a switch, in whose shadows
nothing of the ground is seen, 0.45 to 0.70."""

ABOVE_STONES_M = 2 * DEPTH_M
"""Height above the bed from which a top has no stones in it, because these scatter by less than `DEPTH_M`."""

EMPTY = np.int16(-32768)
"""Top of a cell without points."""

MILLIMETRES, TENTHS_OF_MM = 1000, 10_000
"""Per metre; heights of cells are whole millimetres, and sums of places whole tenths."""


@dataclass(frozen=True)
class Band:
    """Which tops may be those of rails: at least `low_m` above the bed.

    Cells that are lower by `depth_share` of the height, or by `DEPTH_M` if that is less, are not part of the top. Tops
    are compared with their surroundings at thresholds `slab_m` apart. With `shadows`, what is not seen may be in a
    shadow: not in a cloud that is matched from images.
    """

    low_m: float
    depth_share: float
    slab_m: float
    shadows: bool = True

    def depth_m(self, height_m: np.ndarray | float) -> np.ndarray | float:
        """Return the depth below a top down to which cells are part of it, metres, by its height above the bed."""
        return np.minimum(DEPTH_M, self.depth_share * height_m)


@dataclass(frozen=True)
class Grid:
    """A window of the raster of rail cells, see `raster.rasterize`, by the cell at its north-western corner."""

    cell_m: float
    row: int
    column: int
    shape: tuple[int, int]

    @classmethod
    def around(cls, x: np.ndarray, y: np.ndarray, cell_m: float) -> tuple[Grid, np.ndarray]:
        """Make the smallest window that holds the points; returns it and each point's cell in it, (n,) int32."""
        rows = np.floor(-y / cell_m + BORDER_CELLS).astype(np.int32)
        columns = np.floor(x / cell_m + BORDER_CELLS).astype(np.int32)
        row, column = int(rows.min()), int(columns.min())
        shape = int(rows.max()) - row + 1, int(columns.max()) - column + 1
        return cls(cell_m, row, column, shape), (rows - row) * np.int32(shape[1]) + (columns - column)

    def middles(self, cell: np.ndarray) -> np.ndarray:
        """Middles of cells, (k,) numbers, in local metres, (k, 2)."""
        row, column = np.divmod(cell, self.shape[1])
        return np.column_stack([column + (self.column + 0.5), -(row + (self.row + 0.5))]) * self.cell_m

    def cells(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Cells of places, (k, 2): their numbers, and whether they are in the window, (k,) each; 0 outside."""
        row = np.floor(-xy[:, 1] / self.cell_m + BORDER_CELLS).astype(np.int64) - self.row
        column = np.floor(xy[:, 0] / self.cell_m + BORDER_CELLS).astype(np.int64) - self.column
        inside = (row >= 0) & (row < self.shape[0]) & (column >= 0) & (column < self.shape[1])
        return np.where(inside, row * self.shape[1] + column, 0), inside

    def blocks(self, cell: np.ndarray) -> np.ndarray:
        """Find the blocks of 2 x 2 cells of the raster that the cells are in, (k,) int64 numbers."""
        row, column = np.divmod(cell, self.shape[1])
        return ((row + self.row) // 2 - self.row // 2) * (self.shape[1] + 2) + (column + self.column) // 2


@dataclass(frozen=True)
class Tops:
    """What stands on each cell, (rows, columns) arrays.

    `top` is the highest point up to `TOP_M`, int16 millimetres above the bed; `EMPTY` without any. `z` is the height of
    that point, metres, -inf without any: heights above the bed compare along a rail; across they do not where the bed
    bends. `seen` and `high` hold for cells with a point below `HIGH_M`, and between `TOP_M` and `HIGH_M`.
    """

    grid: Grid
    top: np.ndarray
    z: np.ndarray
    seen: np.ndarray
    high: np.ndarray


def tops_of(grid: Grid, cell: np.ndarray, height: np.ndarray, z: np.ndarray) -> Tops:
    """Find the tops of the cells, given cell, height above the bed, up to `HIGH_M`, and height of each point, (n,)."""
    cells = grid.shape[0] * grid.shape[1]
    seen, high = np.zeros(cells, dtype=bool), np.zeros(cells, dtype=bool)
    top, highest = np.full(cells, EMPTY, dtype=np.int16), np.full(cells, -np.inf, dtype=np.float32)
    seen[cell] = True
    high[cell[height > TOP_M]] = True
    low = np.flatnonzero(height <= TOP_M)
    millimetres = np.round(height[low] * MILLIMETRES).astype(np.int16)
    # Written in rising order, the last value of a cell is its highest.
    order = np.argsort((millimetres - np.int32(EMPTY)).astype(np.uint16), kind="stable")
    low_cell = cell[low[order]]
    top[low_cell] = millimetres[order]
    highest[low_cell] = z[low[order]]
    return Tops(grid, *(values.reshape(grid.shape) for values in (top, highest, seen, high)))


def narrow_tops(tops: Tops, band: Band) -> np.ndarray:
    """Cells whose top is in the band of railheads, narrow, and free of high points, (k,) cell numbers in order."""
    top = tops.top.ravel()
    candidates = np.flatnonzero((top >= band.low_m * MILLIMETRES) & ~_around(tops.high).ravel())
    if not len(candidates):
        return candidates
    window, around = (
        Window(tops.grid, candidates, round(half_m / tops.grid.cell_m)) for half_m in (WINDOW_M, AROUND_M)
    )
    seen = window.sums(tops.seen).astype(int) - 1
    larger = (window.size - 1) / (around.size - 1) if band.shadows else 0.0
    slab = (top[candidates] - round(band.low_m * MILLIMETRES)) // round(band.slab_m * MILLIMETRES)
    share = np.zeros(len(candidates))
    for number in np.unique(slab).tolist():
        middle_m = band.low_m + (number + 0.5) * band.slab_m
        threshold = (middle_m - band.depth_m(middle_m)) * MILLIMETRES
        chosen = np.flatnonzero(slab == number)
        high = (tops.top >= threshold) | tops.high
        others, near = (one.of(chosen).sums(high).astype(int) - 1 for one in (window, around))
        share[chosen] = others / np.maximum(np.maximum(seen[chosen], larger * near), 1)
    shadowed = band.shadows & (top[candidates] >= ABOVE_STONES_M * MILLIMETRES)
    return candidates[share <= np.where(shadowed, SHADOWED_SHARE, MAX_SHARE)]


@dataclass(frozen=True)
class Window:
    """Square windows around cells, (k,), as many cells to every side as `reach`, for sums by integral images."""

    grid: Grid
    cell: np.ndarray
    reach: int

    @property
    def size(self) -> int:
        """Number of cells in a window."""
        return (2 * self.reach + 1) ** 2

    def of(self, chosen: np.ndarray) -> Window:
        """Choose some of the windows."""
        return Window(self.grid, self.cell[chosen], self.reach)

    def sums(self, image: np.ndarray) -> np.ndarray:
        """Sum an image of whole numbers in each window, (k,)."""
        kind = np.min_scalar_type(self.size) if image.dtype == bool else np.int32
        across = _sums_along(image.astype(kind), self.reach, 1)
        return _sums_along(across, self.reach, 0).ravel()[self.cell]


def _sums_along(image: np.ndarray, reach: int, axis: int) -> np.ndarray:
    """Sum each value of an image with the `reach` values before and after it: sums of 1, 2, 4 … values add up."""

    def part(values: np.ndarray, start: int, length: int) -> np.ndarray:
        return values[start : start + length] if axis == 0 else values[:, start : start + length]

    size, count = image.shape[axis], 2 * reach + 1
    powers = np.zeros([length + 2 * reach * (number == axis) for number, length in enumerate(image.shape)], image.dtype)
    part(powers, reach, size)[:] = image
    total, start, length = part(powers, 0, size).copy(), 1, 1  # the count is odd
    while 2 * length <= count:
        remaining = powers.shape[axis] - length
        powers = part(powers, 0, remaining) + part(powers, length, remaining)
        length *= 2
        if count & length:
            total += part(powers, start, size)
            start += length
    return total


def middles_of_tops(
    tops: Tops, band: Band, cells: np.ndarray, xy: np.ndarray, cell: np.ndarray, height: np.ndarray
) -> np.ndarray:
    """Find the mean place of the points on top of some cells: truer than the middle of a cell that is half on a head.

    Cells rise in number; points are given by place, cell and height as in `tops_of`. Returns (rows * columns, 2), NaN
    for all other cells.
    """
    low = np.full(tops.top.size, np.inf, dtype=np.float32)
    top_m = tops.top.ravel()[cells] / MILLIMETRES
    low[cells] = top_m - band.depth_m(top_m)
    on = np.flatnonzero((height >= low[cell]) & (height <= TOP_M))
    return means(tops.top.size, cell[on], xy[on])


def means(count: int, cell: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Mean values of the points, (n, d) metres, of each of a `count` of cells, (count, d); NaN without points."""
    points = np.bincount(cell, minlength=count)
    # Whole numbers add up to the same sum in any order of the points.
    tenths = np.round(values * TENTHS_OF_MM)
    with np.errstate(invalid="ignore"):
        return np.column_stack([np.bincount(cell, column, count) / points for column in tenths.T]) / TENTHS_OF_MM


def centroids(cell: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Mean places of the points, (n, d), of each cell that has any, in the order of the cells, (k, d)."""
    cells, number = np.unique(cell, return_inverse=True)
    return means(len(cells), number, places)


def highest_of_blocks(tops: Tops, cells: np.ndarray) -> np.ndarray:
    """Thin cells, (k,) in order, to the highest of each block of 2 x 2 cells; the first among equals."""
    order = np.lexsort((cells, -tops.top.ravel()[cells].astype(np.int32), tops.grid.blocks(cells)))
    blocks = tops.grid.blocks(cells[order])
    first = np.ones(len(order), dtype=bool)
    first[1:] = np.diff(blocks) != 0
    return np.sort(cells[order[first]])


def _around(image: np.ndarray) -> np.ndarray:
    """Spread a bool image to the eight neighbours."""
    wide = image.copy()
    wide[:, 1:] |= image[:, :-1]
    wide[:, :-1] |= image[:, 1:]
    spread = wide.copy()
    spread[1:] |= wide[:-1]
    spread[:-1] |= wide[1:]
    return spread
