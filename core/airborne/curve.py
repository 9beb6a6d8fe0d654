"""Smooth curves through fitted places: penalised least squares with the standard error that remains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded

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
    bend : (n - order,) array
        Expected square of the differences that are penalised: that of the curve's, and their variance.
    """

    values: np.ndarray
    variance: np.ndarray
    bend: np.ndarray


def smooth(values: np.ndarray, weight: np.ndarray, sigma: float | np.ndarray, order: int) -> Smooth:
    """Return the curve that balances places and smoothness.

    Parameters
    ----------
    values : (n, d) array
        Places; those with a weight of 0 may hold any number.
    weight : (n,) array
        1 / variance of each.
    sigma : float or (n - order,) array
        Standard deviation of the differences of this order.
    order : int
    """
    band = _bands(weight, 1 / np.square(sigma), order)
    found = solveh_banded(band, weight[:, None] * values)
    inverse = _inverse_bands(band)
    squares = (np.diff(found, order, axis=0) ** 2).sum(axis=-1)
    return Smooth(found, inverse[0], squares + _variance_of_differences(inverse, order))


def _bands(weight: np.ndarray, stiffness: float | np.ndarray, order: int) -> np.ndarray:
    """Return the upper bands of the normal equations, (order + 1, n)."""
    count = len(weight)
    difference = _weights(order)
    band = np.zeros((order + 1, count))
    for one in range(order + 1):
        for other in range(one, order + 1):
            band[order - (other - one), other : max(count - order, 0) + other] += (
                stiffness * difference[one] * difference[other]
            )
    band[order] += weight + LITTLE
    return band


def _weights(order: int) -> np.ndarray:
    """Return the weights with which places make a difference, (order + 1,)."""
    return np.diff(np.eye(order + 1), order, axis=0)[0]


def _inverse_bands(band: np.ndarray) -> np.ndarray:
    """Return the diagonal of the inverse of a banded matrix and those beside it, (order + 1, n), block by block."""
    order, count = len(band) - 1, band.shape[1]
    found = np.empty(band.shape)
    for first in range(0, count, BLOCK):
        low, high = max(first - SPREAD, 0), min(first + BLOCK + SPREAD, count)
        part = band[:, low:high].copy()
        for row in range(order):
            part[row, : order - row] = 0.0
        wanted = np.arange(first, min(first + BLOCK, count))
        unit = np.zeros((high - low, len(wanted)))
        unit[wanted - low, np.arange(len(wanted))] = 1.0
        solved = solveh_banded(part, unit)
        for beside in range(order + 1):
            row = np.minimum(wanted - low + beside, high - low - 1)
            found[beside, wanted] = solved[row, np.arange(len(wanted))]
    return found


def _variance_of_differences(inverse: np.ndarray, order: int) -> np.ndarray:
    """Return the variance of differences, (n - order,), from the diagonals of the inverse, (order + 1, n)."""
    difference, count = _weights(order), inverse.shape[1]
    total = np.zeros(max(count - order, 0))
    for one in range(order + 1):
        for other in range(order + 1):
            first = min(one, other)
            total += difference[one] * difference[other] * inverse[abs(one - other), first : count - order + first]
    return total
