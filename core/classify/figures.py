"""What was found in a square, in figures that add up over squares."""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
from scipy.spatial import cKDTree

from .lines import Lines

GAP_M = 1.0
"""Longest gap between two cells of a rail that counts towards its length."""


@dataclass(frozen=True)
class Figures:
    """What was found.

    Attributes
    ----------
    points : int
        Points on rails.
    paired_m, single_m : float
        Length of rails with and without a partner.
    cells : int
        Cells of railheads.
    squares, thin, paved : int
        Squares with rails; those among them that are thin, and those with rails in pavement.
    along_m, across_m : float
        Length of rails near the guide that run along it, and across it, whether they are kept or not.
    """

    points: int = 0
    paired_m: float = 0.0
    single_m: float = 0.0
    cells: int = 0
    squares: int = 0
    thin: int = 0
    paved: int = 0
    along_m: float = 0.0
    across_m: float = 0.0

    def __add__(self, other: Figures) -> Figures:
        return Figures(*(one + more for one, more in zip(astuple(self), astuple(other))))

    @property
    def cells_per_m(self) -> float:
        """Cells per metre of rail; FRPDF needs seven and more."""
        length_m = self.paired_m + self.single_m
        return self.cells / length_m if length_m else 0.0


def shares_of_length(lines: Lines, half_m: float) -> np.ndarray:
    """Length of rail that each cell stands for, (n,) metres: half the way to the next cell ahead and behind.

    Parameters
    ----------
    lines : Lines
    half_m : float
        Distance across within which two cells are on one line.
    """
    count = len(lines.axis)
    if count < 2:
        return np.zeros(count)
    pairs = cKDTree(lines.axis).query_pairs(np.hypot(GAP_M, half_m), output_type="ndarray")
    own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    step = lines.axis[other] - lines.axis[own]
    along = np.einsum("ij,ij->i", step, lines.along[own])
    beside = np.abs(np.einsum("ij,ij->i", step, lines.across[own])) < half_m
    share_m = np.zeros(count)
    for ahead in (True, False):
        mine = beside & ((along > 0) == ahead)
        gap_m = np.full(count, GAP_M)
        np.minimum.at(gap_m, own[mine], np.abs(along[mine]))
        share_m += np.where(gap_m < GAP_M, gap_m / 2, 0.0)
    return share_m
