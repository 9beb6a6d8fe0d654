"""The division of guides into squares, so that memory does not grow with the length of a railway.

The squares are those of a grid anchored at the zero of the coordinate system. In each, the pieces of all guides are
fitted together, with as much of them around it as their curves depend on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..polyline import Polyline
from .sections import STATION_M

SIDE_M = 1000.0
"""Side of the squares: with 40 points per square metre and four tracks, one needs 0.3 GB."""

MARGIN_M = 120.0
"""Length of a guide beyond the square on which a curve within it depends: twelve stations."""

CELL_M = 16.0
"""Side of the cells that make up the surroundings of guides."""

AREA_M = 200.0
"""Length of guide in a rectangle in which points are read."""

ROW = 2**31
"""Cells in a row, so that one number stands for a cell."""

Key = tuple[int, int]


@dataclass(frozen=True)
class Piece:
    """A part of a guide.

    Attributes
    ----------
    number : int
        Of the guide.
    axis : Polyline
        With its margins; its first chainage is a multiple of `STATION_M`.
    first_m, last_m : float
        Chainages of the guide between which stations belong to the square.
    """

    number: int
    axis: Polyline
    first_m: float
    last_m: float


def pieces_by_square(axes: Sequence[Polyline]) -> dict[Key, tuple[Piece, ...]]:
    """Divide guides into squares."""
    found: dict[Key, list[Piece]] = {}
    for number, axis in enumerate(axes):
        for key, first_m, last_m in _stays(axis):
            low_m = max(np.floor((first_m - MARGIN_M) / STATION_M) * STATION_M, 0.0)
            inside = slice(*np.searchsorted(axis.t, [low_m, np.nextafter(last_m + MARGIN_M, np.inf)]))
            around = Polyline(axis.xy[inside], axis.t[inside])
            found.setdefault(key, []).append(Piece(number, around, first_m, last_m))
    return {key: tuple(pieces) for key, pieces in sorted(found.items())}


def _stays(axis: Polyline) -> Iterator[tuple[Key, float, float]]:
    """Yield each stay of a guide in a square, by the middles of its sections, with the chainages of its ends."""
    count = max(int(np.ceil(axis.t[-1] / STATION_M)), 1)
    middles = (np.arange(count) + 0.5) * STATION_M
    keys = np.floor(axis.at(middles) / SIDE_M).astype(np.int64)
    turns = np.flatnonzero((np.diff(keys, axis=0) != 0).any(axis=1)) + 1
    for run in np.split(np.arange(count), turns):
        key = (int(keys[run[0], 0]), int(keys[run[0], 1]))
        yield key, float(run[0] * STATION_M), float((run[-1] + 1) * STATION_M)


def cells_around(axes: Sequence[Polyline], reach_m: float) -> np.ndarray:
    """Return the numbers of the cells within reach of lines, rising."""
    steps = np.arange(-int(np.ceil(reach_m / CELL_M)), int(np.ceil(reach_m / CELL_M)) + 1)
    around = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    cells = np.unique(np.concatenate([np.floor(axis.xy / CELL_M).astype(np.int64) for axis in axes]), axis=0)
    return np.unique(numbers_of((cells[:, None] + around).reshape(-1, 2)))


def in_cells(xy: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return which places, (n, 2), lie in cells, given by their numbers, (n,) bool."""
    number = numbers_of(np.floor(xy / CELL_M).astype(np.int64))
    at = np.minimum(np.searchsorted(cells, number), len(cells) - 1)
    return cells[at] == number


def numbers_of(cells: np.ndarray) -> np.ndarray:
    """Return a number for each cell, given by its column and row, (n, 2)."""
    return cells[:, 0] * ROW + cells[:, 1]


def areas_along(pieces: Sequence[Piece], reach_m: float) -> np.ndarray:
    """Return rectangles that hold all places within reach of the pieces, (k, 4) metres."""
    parts = [
        part for piece in pieces for part in np.array_split(piece.axis.xy, max(int(len(piece.axis.xy) / AREA_M), 1))
    ]
    low, high = (np.array([reduce(part, axis=0) for part in parts]) for reduce in (np.min, np.max))
    return np.column_stack([low - reach_m, high + reach_m])
