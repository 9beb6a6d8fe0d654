"""What was found in a square, in figures that add up over squares."""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
from scipy.spatial import cKDTree

from .lines import Lines

SPACING_M = 0.5
"""Cells of one line within this distance along it share its length: thin clouds show a rail every 0.2 to 0.4 m."""


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
    """

    points: int = 0
    paired_m: float = 0.0
    single_m: float = 0.0
    cells: int = 0
    squares: int = 0
    thin: int = 0
    paved: int = 0

    def __add__(self, other: Figures) -> Figures:
        return Figures(*(one + more for one, more in zip(astuple(self), astuple(other))))

    @property
    def cells_per_m(self) -> float:
        """Cells per metre of rail; FRPDF needs seven and more."""
        length_m = self.paired_m + self.single_m
        return self.cells / length_m if length_m else 0.0


def shares_of_length(lines: Lines, half_m: float) -> np.ndarray:
    """Length of rail that each cell stands for, (n,) metres: cells close to each other share it.

    Parameters
    ----------
    lines : Lines
    half_m : float
        Distance across within which two cells are on one line.
    """
    count = len(lines.axis)
    if not count:
        return np.zeros(0)
    one, other = cKDTree(lines.axis).query_pairs(np.hypot(SPACING_M, half_m), output_type="ndarray").T
    step = lines.axis[other] - lines.axis[one]
    beside = np.abs(np.einsum("ij,ij->i", step, lines.across[one])) < half_m
    beside &= np.abs(np.einsum("ij,ij->i", step, lines.along[one])) < SPACING_M
    sharing = 1 + np.bincount(one[beside], minlength=count) + np.bincount(other[beside], minlength=count)
    return 2 * SPACING_M / sharing
