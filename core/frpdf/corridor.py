"""The cells that the network computes: rectangles along the rails and the gaps between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..raster import ROW, RailRaster

BLOCK = 16
"""Side in cells of the blocks that form the corridor."""
GAP = 8
"""Largest distance in blocks between which the network may close a gap: gaps of 4 m at cells of 4 cm. Longer gaps are
left to the vectorizer."""
BESIDE = 1
"""Blocks computed around rail cells and gaps: 0.6 m, further than the network moves a rail."""
MAX_PIECE_CELLS = 1 << 18
"""Largest number of cells in a rectangle: a layer takes 0.1 s on it, so that a cancel takes effect in time."""
CONTEXT = 256
"""Width in cells of the frame of context around a batch."""


@dataclass(frozen=True)
class Rectangle:
    """A rectangle of cells, by its north-west corner."""

    row: int
    column: int
    height: int
    width: int

    @property
    def window(self) -> tuple[int, int, int, int]:
        """Row, column, height and width, as `RailRaster.read` takes them."""
        return self.row, self.column, self.height, self.width

    def holds(self, cells: np.ndarray) -> np.ndarray:
        """Return which of (n, 2) rows and columns are inside, (n,) bool."""
        corner = np.array([self.row, self.column])
        return np.all((cells >= corner) & (cells < corner + [self.height, self.width]), axis=1)


@dataclass(frozen=True)
class Batch:
    """Pieces that are computed together.

    The rectangles `inside`, whose results count, do not overlap in a raster. The pieces, without overlap, cover the
    corridor inside and, for context, up to `CONTEXT` cells outside.
    """

    inside: Rectangle
    pieces: list[Rectangle]


def lay_batches(raster: RailRaster, max_cells: int) -> list[Batch]:
    """Cover the corridor with batches of at most `max_cells` cells, not counting their context."""
    blocks = corridor(raster)
    batches = []
    for inside in _batches(blocks, max_cells // BLOCK**2):
        frame = CONTEXT // BLOCK
        wide = Rectangle(inside.row - frame, inside.column - frame, inside.height + 2 * frame, inside.width + 2 * frame)
        near = blocks[wide.holds(blocks)]
        pieces = [_in_cells(piece) for piece in _partition(near, MAX_PIECE_CELLS // BLOCK**2)]
        batches.append(Batch(_in_cells(inside), pieces))
    return batches


def corridor(raster: RailRaster) -> np.ndarray:
    """Return the blocks in which the network may set a cell, (n, 2) rows and columns, sorted.

    These are the blocks with rail cells, the blocks between two of them that are at most `GAP` apart, and the blocks
    around both.
    """
    occupied = np.unique(_numbers(raster.cells() // BLOCK))
    filled = [occupied]
    for down, right in _directions():
        starts = occupied[np.isin(occupied + down * ROW + right, occupied, assume_unique=True)]
        steps = np.arange(1, max(down, abs(right)))[:, None] / max(down, abs(right))
        between = np.rint(steps * [down, right]).astype(np.int64)
        filled.append((starts[:, None] + between @ [ROW, 1]).ravel())
    around = np.arange(-BESIDE, BESIDE + 1)
    shifts = (around[:, None] * ROW + around).ravel()
    numbers = np.unique((np.unique(np.concatenate(filled))[:, None] + shifts).ravel())
    rows = (numbers + ROW // 2) // ROW
    return np.column_stack([rows, numbers - rows * ROW])


def _directions() -> list[tuple[int, int]]:
    """Return the steps from a block to another one across a gap, one of each pair of opposite steps."""
    span = range(-GAP, GAP + 1)
    steps = [(down, right) for down in range(GAP + 1) for right in span if (down, right) > (0, 0)]
    return [(down, right) for down, right in steps if max(down, abs(right)) > 1 and down**2 + right**2 <= GAP**2]


def _numbers(blocks: np.ndarray) -> np.ndarray:
    return blocks[:, 0] * ROW + blocks[:, 1]


def _in_cells(blocks: Rectangle) -> Rectangle:
    return Rectangle(*(BLOCK * number for number in blocks.window))


def _batches(blocks: np.ndarray, most: int) -> list[Rectangle]:
    """Halve the bounding rectangle of blocks until no part has more than `most` of them."""
    return _divided(blocks, lambda group: _halves(group) if len(group) > most else [])


def _partition(blocks: np.ndarray, most: int) -> list[Rectangle]:
    """Divide blocks along rows and columns while that reduces the cost, or their bounding rectangle is too large."""

    def divide(group: np.ndarray) -> list[np.ndarray]:
        bounds = _bounds(group)
        cost, parts = _best_cut(group)
        if cost < _cost(bounds.height, bounds.width):
            return parts
        return _halves(group) if bounds.height * bounds.width > most else []

    return _divided(blocks, divide)


def _divided(blocks: np.ndarray, divide: Callable[[np.ndarray], list[np.ndarray]]) -> list[Rectangle]:
    """Return the bounding rectangles of blocks, (n, 2), divided until nothing more is divided."""
    rectangles, waiting = [], [blocks] if len(blocks) else []
    while waiting:
        group = waiting.pop()
        parts = divide(group)
        waiting += parts
        if not parts:
            rectangles.append(_bounds(group))
    return rectangles


def _bounds(blocks: np.ndarray) -> Rectangle:
    corner = blocks.min(axis=0)
    return Rectangle(*corner.tolist(), *(blocks.max(axis=0) + 1 - corner).tolist())


def _halves(blocks: np.ndarray) -> list[np.ndarray]:
    """Divide blocks across the longer side of their bounding rectangle."""
    bounds = _bounds(blocks)
    axis = int(bounds.width > bounds.height)
    first = blocks[:, axis] < bounds.window[axis] + bounds.window[2 + axis] // 2
    return [blocks[first], blocks[~first]]


def _best_cut(blocks: np.ndarray) -> tuple[float, list[np.ndarray]]:
    """Divide blocks in two where the two bounding rectangles cost least; return the cost and the parts."""
    best, parts = np.inf, []
    for axis in (0, 1):
        along = blocks[np.argsort(blocks[:, axis], kind="stable")]
        place, across = along[:, axis], along[:, 1 - axis]
        last = np.flatnonzero(np.diff(place))
        if len(last) == 0:
            continue
        before = np.maximum.accumulate(across) - np.minimum.accumulate(across) + 1
        after = (np.maximum.accumulate(across[::-1]) - np.minimum.accumulate(across[::-1]) + 1)[::-1]
        cost = _cost(place[last] - place[0] + 1, before[last])
        cost = cost + _cost(place[-1] - place[last + 1] + 1, after[last + 1])
        cheapest = int(np.argmin(cost))
        if cost[cheapest] < best:
            best = cost[cheapest]
            parts = [along[: last[cheapest] + 1], along[last[cheapest] + 1 :]]
    return best, parts


def _cost(height, width):
    """Return the cost of a rectangle of blocks: its surroundings, as wide as a block, are copied."""
    return (height + 2) * (width + 2)
