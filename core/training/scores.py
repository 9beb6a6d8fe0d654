"""Confusion counts of cleaned rasters, as in the paper's table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Scores:
    """Counts of rail cells missed, invented and found; they add up over rasters.

    Attributes
    ----------
    fn, fp, tp : int
        False negatives, false positives, true positives.
    """

    fn: int = 0
    fp: int = 0
    tp: int = 0

    def __add__(self, other: Scores) -> Scores:
        return Scores(self.fn + other.fn, self.fp + other.fp, self.tp + other.tp)

    @property
    def precision(self) -> float:
        """Share of the cells found that are rail."""
        return self.tp / max(self.tp + self.fp, 1)

    @property
    def recall(self) -> float:
        """Share of the rail cells that are found."""
        return self.tp / max(self.tp + self.fn, 1)

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall."""
        return 2 * self.tp / max(2 * self.tp + self.fp + self.fn, 1)


def score(found: np.ndarray, label: np.ndarray) -> Scores:
    """Count strictly, cell by cell; both are bool arrays of one shape."""
    return Scores(
        fn=int(np.count_nonzero(~found & label)),
        fp=int(np.count_nonzero(found & ~label)),
        tp=int(np.count_nonzero(found & label)),
    )
