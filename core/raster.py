"""Sparse, tiled, georeferenced rasters of rail cells.

A railway is long and thin: the bounding box of a diagonal of 10 km has a thousand times the cells of its corridor.
A `RailRaster` therefore keeps only the tiles that contain a rail cell, and no array has the size of a bounding box.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from .progress import SILENT, Progress

TILE = 256
"""Cells along the side of a tile: few enough to follow a track, enough to make Python's overhead per tile small."""

CENTRE_SPACING_CELLS = 37.78
"""Cells between the two railhead centres: 1511.2 mm (132RE) in cells of 40 mm, the example of Gribov and Chang."""

BORDER_CELLS = 1e-6
"""A point this close to a cell border belongs to the next cell: files store millimetres, so points are on borders, and
the rounding of the last bit must not decide on the cell."""

POINTS_AT_ONCE = 1_000_000
"""Points that are rasterized at once, 34 bytes each: on dense clouds, the cells with points are far fewer."""

ROW = 1 << 31
"""Distance between the numbers of two rows of cells, when a cell has a single number."""


def cell_size(gauge_m: float, head_width_m: float) -> float:
    """Return the cell size in metres at which the rails are `CENTRE_SPACING_CELLS` apart (docs/method.md section 2.1).

    >>> round(cell_size(1.435, 0.0762), 4)
    0.04
    """
    return (gauge_m + head_width_m) / CENTRE_SPACING_CELLS


@dataclass(frozen=True)
class RailRaster:
    """Rail cells on a square grid, stored by tile, (TILE, TILE) bool arrays by tile row and column.

    Missing tiles contain no rail cell. Row numbers grow to the south, column numbers to the east; both may be negative.
    Cell (0, 0), of side `cell_m`, has its north-west corner at (`x0`, `y0`), local metres.
    """

    tiles: Mapping[tuple[int, int], np.ndarray]
    cell_m: float
    x0: float
    y0: float

    def read(self, row: int, column: int, height: int, width: int) -> np.ndarray:
        """Copy a window of cells, (height, width) bool, given its first row and column; False outside the tiles."""
        window = np.zeros((height, width), dtype=bool)
        for tile_row in range(row // TILE, (row + height - 1) // TILE + 1):
            for tile_column in range(column // TILE, (column + width - 1) // TILE + 1):
                tile = self.tiles.get((tile_row, tile_column))
                if tile is None:
                    continue
                top, left = tile_row * TILE - row, tile_column * TILE - column
                rows = slice(max(top, 0), min(top + TILE, height))
                columns = slice(max(left, 0), min(left + TILE, width))
                window[rows, columns] = tile[
                    rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
                ]
        return window

    def cells(self) -> np.ndarray:
        """Return rows and columns of all rail cells, (n, 2), sorted by tile."""
        found = [
            np.argwhere(tile) + np.array(index, dtype=np.int64) * TILE for index, tile in sorted(self.tiles.items())
        ]
        return np.concatenate(found) if found else np.empty((0, 2), dtype=np.int64)

    def count(self) -> int:
        """Count the rail cells."""
        return int(sum(np.count_nonzero(tile) for tile in self.tiles.values()))

    def to_local(self, rows_columns: np.ndarray) -> np.ndarray:
        """Convert cell positions, (n, 2) rows and columns, to local x, y in metres, (n, 2).

        They may be fractions; (0, 0) is the centre of cell (0, 0).
        """
        rows_columns = np.asarray(rows_columns, dtype=float)
        x = self.x0 + (rows_columns[:, 1] + 0.5) * self.cell_m
        y = self.y0 - (rows_columns[:, 0] + 0.5) * self.cell_m
        return np.column_stack([x, y])

    def with_cells(self, cells: np.ndarray) -> RailRaster:
        """Return a raster on the same grid with only these cells, (n, 2) rows and columns."""
        return replace(self, tiles=_tiles_of(cells))

    def map_tiles(
        self,
        function: Callable[[np.ndarray], np.ndarray],
        margin: int,
        progress: Progress = SILENT,
    ) -> RailRaster:
        """Apply a function to every stored tile and its eight neighbours, each with `margin` cells around it.

        The function maps a bool array to one of the same shape; cells farther than the margin must not affect a cell.
        """
        tiles, steps = {}, (-1, 0, 1)
        near = {(row + down, column + right) for row, column in self.tiles for down in steps for right in steps}
        for index in progress.follow(sorted(near)):
            row, column = index[0] * TILE - margin, index[1] * TILE - margin
            result = function(self.read(row, column, TILE + 2 * margin, TILE + 2 * margin))
            inner = result[margin : margin + TILE, margin : margin + TILE]
            if inner.any():
                tiles[index] = np.array(inner, dtype=bool)
        return replace(self, tiles=tiles)


def rasterize(xy: np.ndarray, cell_m: float) -> RailRaster:
    """Rasterize rail points, (n, 2) or (n, 3) local metres: a cell is set if it contains at least one.

    Cell borders are multiples of `cell_m` (see `cell_size`), so that clouds with the same local origin share one grid
    (docs/method.md section 2.2).
    """
    xy = np.asarray(xy)
    parts = [xy[start : start + POINTS_AT_ONCE] for start in range(0, max(len(xy), 1), POINTS_AT_ONCE)]
    cells = np.concatenate([_cells_of(part, cell_m) for part in parts])
    return RailRaster(_tiles_of(cells), cell_m, 0.0, 0.0)


def _cells_of(xy: np.ndarray, cell_m: float) -> np.ndarray:
    """Return the cells with points, each once, (m, 2); far fewer than points, on dense clouds."""
    rows = np.floor(-xy[:, 1] / cell_m + BORDER_CELLS).astype(np.int64)
    columns = np.floor(xy[:, 0] / cell_m + BORDER_CELLS).astype(np.int64)
    if len(rows) and max(np.abs(rows).max(), np.abs(columns).max()) < ROW // 2:
        numbers = np.unique(rows * ROW + columns)
        rows = (numbers + ROW // 2) // ROW
        columns = numbers - rows * ROW
    return np.column_stack([rows, columns])


def _tiles_of(cells: np.ndarray) -> dict[tuple[int, int], np.ndarray]:
    """Sort cells, (n, 2) rows and columns, into tiles."""
    if len(cells) == 0:
        return {}
    cells = np.asarray(cells, dtype=np.int64)
    rows, columns = (cells // TILE).T
    number = (rows - rows.min()) * (columns.max() - columns.min() + 1) + columns - columns.min()
    order = np.argsort(number, kind="stable")
    borders = np.flatnonzero(np.diff(number[order])) + 1
    tiles = {}
    for mine in np.split(order, borders):
        inside = cells[mine] % TILE
        tile = np.zeros((TILE, TILE), dtype=bool)
        tile[inside[:, 0], inside[:, 1]] = True
        tiles[int(rows[mine[0]]), int(columns[mine[0]])] = tile
    return tiles
