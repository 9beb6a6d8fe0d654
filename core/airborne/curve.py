"""Smooth curves through fitted places: penalised least squares, robust, with the standard error that remains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

ROBUST_PASSES, OUTLIER = 5, 3.0
"""Weightings of a robust fit, and the residual, in standard errors, at which a place has lost 3/4 of its weight."""

SPREAD = 60
"""Places beyond which a place has no effect on a smooth curve, in steps of the standard error's computation."""

BLOCK = 400
"""Places whose standard errors are computed at once."""

LITTLE = 1e-12
"""Added to the diagonal, so that a matrix without any data can be solved."""


@dataclass(frozen=True)
class Smooth:
    """A smooth curve at equal steps.

    Attributes
    ----------
    values : (n, d) array
    variance : (n,) array
        That of the curve, if each place has the variance 1 / weight.
    """

    values: np.ndarray
    variance: np.ndarray


def smooth(values: np.ndarray, weight: np.ndarray, sigma: float, order: int) -> Smooth:
    """Return the curve that balances places and smoothness.

    Parameters
    ----------
    values : (n, d) array
        Places; those with a weight of 0 may hold any number.
    weight : (n,) array
        1 / variance of each.
    sigma : float
        Standard deviation of the differences of this order.
    order : int
    """
    band = _bands(weight, 1 / sigma**2, order)
    return Smooth(solveh_banded(band, weight[:, None] * values), _inverse_diagonal(band))


def _bands(weight: np.ndarray, stiffness: float, order: int) -> np.ndarray:
    """Return the upper bands of the normal equations, (order + 1, n)."""
    count = len(weight)
    difference = np.diff(np.eye(order + 1), order, axis=0)[0]
    band = np.zeros((order + 1, count))
    for one in range(order + 1):
        for other in range(one, order + 1):
            band[order - (other - one), other : count - order + other] += (
                stiffness * difference[one] * difference[other]
            )
    band[order] += weight + LITTLE
    return band


def _inverse_diagonal(band: np.ndarray) -> np.ndarray:
    """Return the diagonal of the inverse of a banded matrix, block by block."""
    order, count = len(band) - 1, band.shape[1]
    found = np.empty(count)
    for first in range(0, count, BLOCK):
        low, high = max(first - SPREAD, 0), min(first + BLOCK + SPREAD, count)
        part = band[:, low:high].copy()
        for row in range(order):
            part[row, : order - row] = 0.0
        wanted = np.arange(first, min(first + BLOCK, count))
        unit = np.zeros((high - low, len(wanted)))
        unit[wanted - low, np.arange(len(wanted))] = 1.0
        found[wanted] = solveh_banded(part, unit)[wanted - low, np.arange(len(wanted))]
    return found
