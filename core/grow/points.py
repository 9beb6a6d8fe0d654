"""Points sorted into small cells, to be read around a place."""

from __future__ import annotations

from typing import Protocol

import numpy as np

CELL_M = 0.5
"""Side of the cells: the length of a window."""


class Points(Protocol):
    """Where the growth reads points."""

    def around(self, xy: np.ndarray, reach_m: float) -> np.ndarray:
        """Return the points, (k, 3), of a square with a place, (2,), in its middle; it reaches `reach_m` or more."""


class Buckets:
    """Points in memory.

    Parameters
    ----------
    xyz : (n, 3) array
        Metres.
    """

    def __init__(self, xyz: np.ndarray) -> None:
        cell = np.floor(xyz[:, :2] / CELL_M).astype(np.int64)
        self._first = cell.min(axis=0) if len(cell) else np.zeros(2, dtype=np.int64)
        cell -= self._first
        self._shape = cell.max(axis=0) + 1 if len(cell) else np.zeros(2, dtype=np.int64)
        number = cell[:, 0] * self._shape[1] + cell[:, 1]
        order = np.argsort(number, kind="stable")
        self._xyz = xyz[order]
        self._starts = np.searchsorted(number[order], np.arange(int(np.prod(self._shape)) + 1))

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self._xyz)

    def around(self, xy: np.ndarray, reach_m: float) -> np.ndarray:
        """See `Points`."""
        low = np.maximum(np.floor((xy - reach_m) / CELL_M).astype(np.int64) - self._first, 0)
        high = np.minimum(np.floor((xy + reach_m) / CELL_M).astype(np.int64) - self._first, self._shape - 1)
        if (low > high).any():
            return np.empty((0, 3))
        columns = np.arange(low[0], high[0] + 1) * self._shape[1]
        starts, ends = self._starts[columns + low[1]], self._starts[columns + high[1] + 1]
        return np.concatenate([self._xyz[start:end] for start, end in zip(starts, ends)])
