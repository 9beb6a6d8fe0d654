"""Scores of cleaned rasters: counts of cells as in Gribov and Chang, and bridged gaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

BRIDGED_SHARE = 0.9
"""A gap is bridged where at least this share of its cells is found, or has a neighbour that is found."""

_NEIGHBOURS = np.ones((3, 3), dtype=bool)


@dataclass(frozen=True)
class Scores:
    """Counts of cells, false negatives, false positives and true positives, which can be added up over rasters."""

    fn: int = 0
    fp: int = 0
    tp: int = 0

    def __add__(self, other: Scores) -> Scores:
        return Scores(self.fn + other.fn, self.fp + other.fp, self.tp + other.tp)

    @property
    def precision(self) -> float:
        """Share of rail among the cells found."""
        return self.tp / max(self.tp + self.fp, 1)

    @property
    def recall(self) -> float:
        """Share of the rail cells that were found."""
        return self.tp / max(self.tp + self.fn, 1)

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall."""
        return 2 * self.tp / max(2 * self.tp + self.fp + self.fn, 1)


def score(found: np.ndarray, label: np.ndarray, tolerance: int = 0) -> Scores:
    """Count cells; a cell found and a cell of the label match up to `tolerance` cells apart, where 0 is strict."""
    around_found, around_label = (_grown(cells, tolerance) for cells in (found, label))
    return Scores(
        fn=int(np.count_nonzero(~around_found & label)),
        fp=int(np.count_nonzero(found & ~around_label)),
        tp=int(np.count_nonzero(around_found & label)),
    )


def bridged(found: np.ndarray, gap: np.ndarray) -> dict[int, bool]:
    """Return whether each gap is bridged, by its number in an array of cells, where 0 is none.

    Gaps at the border are left out: a part of them is not shown.
    """
    cells = np.bincount(gap.ravel())
    met = np.bincount(gap[_grown(found, 1)], minlength=len(cells))
    cut = {0, *np.unique(np.concatenate([gap[0], gap[-1], gap[:, 0], gap[:, -1]])).tolist()}
    return {n: bool(met[n] >= BRIDGED_SHARE * cells[n]) for n in np.flatnonzero(cells).tolist() if n not in cut}


def _grown(cells: np.ndarray, reach: int) -> np.ndarray:
    return ndimage.binary_dilation(cells, _NEIGHBOURS, iterations=reach) if reach else cells
