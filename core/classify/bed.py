"""The bed under the rails: levels of ground, decks and tunnels, a plane through each, and heights above them.

A level is found in the histogram of heights of each coarse cell, so that a bridge and the track below it both have
one. The planes follow cant, gradient and embankments. Everything is counted in histograms: the result does not depend
on the order of the points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..frame import ORIGIN_STEP

COARSE_M = 0.5
"""Side of the cells in which the bed is found: wider than a rail with its shadow, narrower than a platform's edge."""

BIN_M = 0.10
"""Height of a bin of the histogram in which levels begin: more than the scatter of ballast."""

LEAST_COUNT, LEAST_SHARE = 2, 0.002
"""Points that a bin of a cell must hold to count, and share of the cell's points: single low points don't."""

CLEAR_M = 0.6
"""Empty height below the beginning of a level: less than the thickness of a deck, more than the height of a rail. With
1.5 m the rails of a bridge that is seen from below as well were lost."""

MAX_LEVELS = 4
"""Levels in one cell, counted from below."""

FINE_M = 0.005
"""Height of a bin of the histogram in which the quantile is found."""

QUANTILE = 0.2
"""Quantile of the heights that is taken as the bed: below the scatter of ballast and grass, above low noise."""

BELOW_M, ABOVE_M = 0.05, 0.75
"""Heights around the beginning of a level among which the quantile is found."""

NEIGHBOUR_M = 0.35
"""Levels of neighbouring cells this close belong to one plane; platforms stand 0.55 m and more above the bed."""

RESIDUAL_M = 0.10
"""Levels further from the plane are left out in the second round: cells in which only a rail is seen."""

RIDGE_M2 = 0.02
"""Keeps the slope flat where few neighbours are known; nine cells have 1.5 m²."""

UNDER_M = 0.20
"""A point this far below a level still belongs to it: its bed may be rough, or the level an object on it."""

BORDER = 1e-6
"""A point this close below the border of a coarse cell, in cells, is beyond it: rounding must not choose the cell."""


@dataclass(frozen=True)
class Coarse:
    """The grid of coarse cells that holds the points of a square.

    Cell (0, 0) has its south-western corner at the square's; `column` and `row` are those of the grid's south-western
    cell, and the shape is rows and columns. `cell`, (n,), is that of each point, and `count` the number of points of
    each cell.
    """

    column: int
    row: int
    shape: tuple[int, int]
    cell: np.ndarray
    count: np.ndarray

    @classmethod
    def around(cls, x: np.ndarray, y: np.ndarray) -> Coarse:
        """Sort points into coarse cells."""
        column, row = (np.floor(values / COARSE_M + BORDER).astype(np.int32) for values in (x, y))
        first_column, first_row = int(column.min()), int(row.min())
        shape = int(row.max()) - first_row + 1, int(column.max()) - first_column + 1
        cell = (row - first_row) * np.int32(shape[1]) + (column - first_column)
        return cls(first_column, first_row, shape, cell, np.bincount(cell, minlength=shape[0] * shape[1]))

    def cells(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coarse cells of places, (k, 2): their numbers, and whether they are in the grid, (k,) each; 0 outside."""
        column, row = (np.floor(values / COARSE_M).astype(np.int64) for values in xy.T)
        row, column = row - self.row, column - self.column
        inside = (row >= 0) & (row < self.shape[0]) & (column >= 0) & (column < self.shape[1])
        return np.where(inside, row * self.shape[1] + column, 0), inside

    def offsets(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance of each point from the middle of its cell, to the east and to the north."""
        width = np.int32(self.shape[1])
        row = self.cell // width  # faster than divmod, which is not vectorized
        column = self.cell - row * width
        dx = x - COARSE_M * (column + (self.column + 0.5))
        dy = y - COARSE_M * (row + (self.row + 0.5))
        return dx.astype(np.float32), dy.astype(np.float32)


@dataclass(frozen=True)
class Bed:
    """Planes of the levels, (MAX_LEVELS, 3, cells) float32: height in the middle of the cell, slopes to east and north.

    NaN where there is no such level.
    """

    coarse: Coarse
    planes: np.ndarray

    @classmethod
    def under(cls, xyz: np.ndarray) -> tuple[Bed, np.ndarray, np.ndarray, np.ndarray]:
        """Find the bed under points, (n, 3) metres.

        Also returns their heights above it, the numbers of their levels, and their heights from a multiple of
        `ORIGIN_STEP` on, (n,) each.
        """
        x, y = (np.ascontiguousarray(values) for values in xyz.T[:2])
        z = (xyz[:, 2] - ORIGIN_STEP * np.floor(xyz[:, 2].min() / ORIGIN_STEP)).astype(np.float32)
        coarse = Coarse.around(x, y)
        dx, dy = coarse.offsets(x, y)
        bed = find_bed(coarse, dx, dy, z)
        return (bed, *bed.heights(dx, dy, z), z)

    def heights(self, dx: np.ndarray, dy: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Height of each point above the highest level that is not above it, (n,), and the number of this level.

        The height is infinite for points below all levels, and where there is none; offsets are those of
        `Coarse.offsets`.
        """
        cell = self.coarse.cell
        height, level = _above(self.planes[0], cell, dx, dy, z), np.zeros(len(z), dtype=np.int8)
        for number in range(1, MAX_LEVELS):
            has = np.isfinite(self.planes[number, 0])
            if not has.any():
                break
            chosen = np.flatnonzero(has[cell])
            other = _above(self.planes[number], cell[chosen], dx[chosen], dy[chosen], z[chosen])
            nearer = other < height[chosen]
            height[chosen[nearer]], level[chosen[nearer]] = other[nearer], number
        return height, level

    def gradients(self, xy: np.ndarray) -> np.ndarray:
        """Return the slopes to east and north of the flattest level at (k, 2) places, (k, 2); 0 where there is none."""
        cell, inside = self.coarse.cells(xy)
        slopes = np.where(inside, self.planes[:, 1:, cell], np.nan)
        steep = np.hypot(*slopes.transpose(1, 0, 2))
        flattest = np.where(np.isfinite(steep), steep, np.inf).argmin(axis=0)
        return np.nan_to_num(slopes[flattest, :, np.arange(len(xy))])


def find_bed(coarse: Coarse, dx: np.ndarray, dy: np.ndarray, z: np.ndarray) -> Bed:
    """Find the levels of each coarse cell and lay planes through neighbouring ones; arguments as in `Bed.heights`.

    The quantile is taken twice: of the heights, and of the heights above the planes through the first ones. The second
    is free of the slope within a cell.
    """
    first = Bed(coarse, _planes(_quantiles(coarse, _begins(coarse, z), z), coarse.shape))
    return Bed(coarse, _planes(first.planes[:, 0] + _residual_quantiles(first, dx, dy, z), coarse.shape))


def _begins(coarse: Coarse, z: np.ndarray) -> np.ndarray:
    """Height at which each level of each cell begins, (MAX_LEVELS, cells); NaN where there is none."""
    cells = len(coarse.count)
    begin = np.full((MAX_LEVELS, cells), np.nan, dtype=np.float32)
    bins = np.floor(z * np.float32(1 / BIN_M)).astype(np.int32)
    lowest = int(bins.min())
    count = int(bins.max()) - lowest + 1
    key, number = _counted(coarse.cell, bins - lowest, count, cells)
    cell, bin_number = np.divmod(key, count)
    counting = number >= np.maximum(LEAST_COUNT, LEAST_SHARE * coarse.count[cell])
    cell, bin_number = cell[counting], bin_number[counting]
    if not len(cell):
        return begin
    first = np.ones(len(cell), dtype=bool)
    first[1:] = (np.diff(cell) != 0) | (np.diff(bin_number) > round(CLEAR_M / BIN_M))
    cell, bin_number = cell[first], bin_number[first]
    rank = np.arange(len(cell)) - np.searchsorted(cell, cell)
    kept = rank < MAX_LEVELS
    begin[rank[kept], cell[kept]] = (bin_number[kept] + lowest) * BIN_M
    return begin


def _counted(cell: np.ndarray, bins: np.ndarray, count: int, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Count points by cell and bin: keys ``cell * count + bin`` in rising order, and the number of points of each."""
    if cells * count <= MAX_DENSE:
        counts = np.bincount(cell * np.int32(count) + bins, minlength=0)
        key = np.flatnonzero(counts)
        return key, counts[key]
    return np.unique(cell.astype(np.int64) * count + bins, return_counts=True)


MAX_DENSE = 16_000_000
"""Bins that are counted in an array, 128 MB; where stray points are kilometres above the ground they are sorted."""


def _quantiles(coarse: Coarse, begin: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Quantile of the heights around the beginning of each level, (MAX_LEVELS, cells)."""
    found = np.full(begin.shape, np.nan, dtype=np.float32)
    for number in range(MAX_LEVELS):
        has = np.isfinite(begin[number])
        if not has.any():
            break
        chosen = slice(None) if number == 0 else np.flatnonzero(has[coarse.cell])
        cell = coarse.cell[chosen]
        found[number] = begin[number] + _quantile(cell, z[chosen] - begin[number][cell], len(has), -BELOW_M)
    return found


def _residual_quantiles(bed: Bed, dx: np.ndarray, dy: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Quantile of the heights above each plane, (MAX_LEVELS, cells)."""
    height, level = bed.heights(dx, dy, z)
    found = np.full(bed.planes[:, 0].shape, np.nan, dtype=np.float32)
    for number in range(MAX_LEVELS):
        has = np.isfinite(bed.planes[number, 0])
        if not has.any():
            break
        chosen = slice(None) if number == 0 and not level.any() else np.flatnonzero(level == number)
        quantile = _quantile(bed.coarse.cell[chosen], height[chosen], len(has), -UNDER_M)
        found[number] = np.where(has & np.isnan(quantile), 0, quantile)
    return found


def _quantile(cell: np.ndarray, height: np.ndarray, cells: int, low: float) -> np.ndarray:
    """Quantile of heights from `low` to `ABOVE_M` by cell, (cells,), to half a bin; NaN without any."""
    count = round((ABOVE_M - low) / FINE_M)
    with np.errstate(invalid="ignore"):
        inside = np.flatnonzero((height >= low) & (height < low + count * FINE_M))
    bins = np.minimum(((height[inside] - np.float32(low)) * np.float32(1 / FINE_M)).astype(np.int32), count - 1)
    cell = cell[inside]
    found = np.full(cells, np.nan, dtype=np.float32)
    held = np.zeros(cells, dtype=bool)
    held[cell] = True
    row = np.cumsum(held, dtype=np.int32) - np.int32(1)  # the upper levels have few cells
    counts = np.bincount(row[cell] * np.int32(count) + bins, minlength=int(held.sum()) * count).reshape(-1, count)
    below = np.cumsum(counts, axis=1, dtype=np.int32)
    number = np.argmax(below >= np.maximum(QUANTILE * below[:, -1], 1)[:, None], axis=1)
    found[held] = low + (number + 0.5) * FINE_M
    return found


def _planes(level_heights: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Fit a plane to each level and the levels of the neighbouring cells near it, (MAX_LEVELS, 3, cells)."""
    levels = [number for number in range(MAX_LEVELS) if np.isfinite(level_heights[number]).any()]
    padded = np.full((len(levels), shape[0] + 2, shape[1] + 2), np.nan)
    padded[:, 1:-1, 1:-1] = level_heights[levels].reshape(len(levels), *shape)
    flat = padded.reshape(len(levels), padded.shape[1] * padded.shape[2])
    planes = np.full((MAX_LEVELS, 3, shape[0] * shape[1]), np.nan, dtype=np.float32)
    for number in levels:
        cell = np.flatnonzero(np.isfinite(level_heights[number]))
        row, column = np.divmod(cell, shape[1])
        place = (row + 1) * (shape[1] + 2) + column + 1
        planes[number][:, cell] = _plane(flat[number][place], place, flat, shape[1] + 2)
    return planes


def _plane(own: np.ndarray, place: np.ndarray, padded: np.ndarray, width: int) -> np.ndarray:
    """Fit planes by least squares in two rounds, (3, k), to levels at places of the padded grid, (k,)."""
    fitted = np.stack([own, np.zeros_like(own), np.zeros_like(own)])
    for limit in (NEIGHBOUR_M, RESIDUAL_M):
        sums = np.zeros((9, len(own)))
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                dx, dy = COARSE_M * right, COARSE_M * down
                expected = fitted[0] + fitted[1] * dx + fitted[2] * dy
                for level in padded:
                    value = level[place + down * width + right]
                    with np.errstate(invalid="ignore"):
                        used = (np.abs(value - expected) < limit) & (np.abs(value - own) < NEIGHBOUR_M)
                    difference = np.where(used, value - own, 0.0)
                    moments = np.array([1.0, dx, dy, dx * dx, dx * dy, dy * dy])
                    sums[:6] += moments[:, None] * used
                    sums[6:] += moments[:3, None] * difference
        fitted = _solved(sums, own)
    return fitted


def _solved(sums: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Solve the normal equations of the planes, with a ridge on the slopes."""
    count, x, y, xx, xy, yy, v, vx, vy = sums
    some = np.maximum(count, 1)
    mean_x, mean_y, mean_v = x / some, y / some, v / some
    xx, xy, yy = xx - x * mean_x + RIDGE_M2, xy - x * mean_y, yy - y * mean_y + RIDGE_M2
    vx, vy = vx - v * mean_x, vy - v * mean_y
    determinant = xx * yy - xy * xy
    slope_x, slope_y = (vx * yy - vy * xy) / determinant, (vy * xx - vx * xy) / determinant
    height = own + mean_v - slope_x * mean_x - slope_y * mean_y
    return np.where(count > 0, np.stack([height, slope_x, slope_y]), np.stack([own, 0 * own, 0 * own]))


def _above(plane: np.ndarray, cell: np.ndarray, dx: np.ndarray, dy: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Height above a plane; infinite below `-UNDER_M` and where there is no plane."""
    height = z - plane[0][cell] - plane[1][cell] * dx - plane[2][cell] * dy
    with np.errstate(invalid="ignore"):
        return np.where(height > -UNDER_M, height, np.float32(np.inf))
