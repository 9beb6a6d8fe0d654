"""Areas bounded by polygons, and the points in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

CELLS = 256
"""Cells along the longer side of a mask; only points in cells on its border are compared with edges."""

MAX_COMPARED = 1 << 24
"""Most pairs of a point and an edge that are compared at once: 16 MiB per array of truth values."""


@dataclass(frozen=True)
class Mask:
    """An area bounded by rings: a place is inside if a ray from it crosses their edges an odd number of times.

    An edge, a row of (m, 4), is x and y of both ends, in units of the coordinate system.
    """

    edges: np.ndarray

    @classmethod
    def of(cls, rings: Sequence[np.ndarray]) -> Mask:
        """Make a mask from the closed rings, (k, 2) each, of polygons that do not overlap, and of their holes."""
        return cls(np.concatenate([np.column_stack([ring[:-1, :2], ring[1:, :2]]) for ring in rings]))

    @cached_property
    def extent(self) -> tuple[float, float, float, float]:
        """Smallest x, smallest y, largest x, largest y."""
        corners = self.edges.reshape(-1, 2)
        return (*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist())

    def holds(self, xy: np.ndarray) -> np.ndarray:
        """Return which places, (n, 2), are inside, (n,) bool."""
        rows, columns = self._cells_of(xy)
        height, width = self._inside.shape
        covered = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        rows, columns = np.where(covered, rows, 0), np.where(covered, columns, 0)
        inside = self._inside[rows, columns] & covered
        close = np.flatnonzero(self._border[rows, columns] & covered)
        close = close[np.argsort(rows[close], kind="stable")]
        for some in np.split(close, np.flatnonzero(np.diff(rows[close])) + 1) if len(close) else ():
            inside[some] = _odd_crossings(xy[some], self._edges_in(int(rows[some[0]])))
        return inside

    @cached_property
    def _side(self) -> float:
        west, south, east, north = self.extent
        return max(east - west, north - south) / CELLS

    def _cells_of(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return row and column of places, (n,) each, counted from the north-western corner with a margin of a cell."""
        west, south, _, _ = self.extent
        columns, rows = np.floor((xy[:, :2] - [west, south]) / self._side).astype(np.int64).T + 1
        return rows, columns

    @cached_property
    def _border(self) -> np.ndarray:
        """Cells that an edge may touch, (h, w) bool."""
        lengths = np.hypot(*(self.edges[:, 2:] - self.edges[:, :2]).T)
        counts = np.ceil(2 * lengths / self._side).astype(np.int64) + 1
        number = np.repeat(np.arange(len(counts)), counts)
        step = np.arange(len(number)) - np.repeat(np.cumsum(counts) - counts, counts)
        share = (step / np.maximum(counts - 1, 1)[number])[:, None]
        ends = self.edges[number]
        rows, columns = self._cells_of((1 - share) * ends[:, :2] + share * ends[:, 2:])
        border = np.zeros((rows.max() + 2, columns.max() + 2), dtype=bool)
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                border[rows + down, columns + right] = True
        return border

    @cached_property
    def _inside(self) -> np.ndarray:
        """Whether the middle of each cell is inside, (h, w) bool."""
        west, south, _, _ = self.extent
        height, width = self._border.shape
        x = west + (np.arange(width) - 0.5) * self._side
        y = south + (np.arange(height) - 0.5) * self._side
        lines = (np.column_stack([x, np.full(width, one)]) for one in y)
        return np.stack([_odd_crossings(line, self._edges_in(row)) for row, line in enumerate(lines)])

    def _edges_in(self, row: int) -> np.ndarray:
        """Return the edges that reach into a row of cells."""
        low = self.extent[1] + (row - 1) * self._side
        y = self.edges[:, 1::2]
        return self.edges[(y.min(axis=1) <= low + self._side) & (y.max(axis=1) >= low)]


def _odd_crossings(xy: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return whether a ray from each place to the east crosses an odd number of edges, (n,) bool."""
    odd = np.zeros(len(xy), dtype=bool)
    x1, y1, x2, y2 = edges.T
    step = max(MAX_COMPARED // max(len(edges), 1), 1)
    for start in range(0, len(xy), step):
        x, y = xy[start : start + step, :2].T[:, :, None]
        spans = (y1 > y) != (y2 > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = x1 + (y - y1) / (y2 - y1) * (x2 - x1)
        odd[start : start + step] = (spans & (crossing > x)).sum(axis=1) % 2 == 1
    return odd
