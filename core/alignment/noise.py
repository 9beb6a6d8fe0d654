"""Errors of a measured track: those of single points, and the misalignment that neighbours share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LENGTHS_M = (3.0, 5.0, 8.0, 12.0, 18.0, 27.0)
"""Correlation lengths of the misalignment that are tried, metres: track is out of line over 5 to 30 m."""

LAGS = 30
"""Number of lags at which the covariance of the residuals is compared."""

OUTLIER = 2.0
"""A piece with a mean square this many times the median is left out: an element begins within it."""

SIZES = (8, 12, 18, 27, 40, 60, 90, 135, 200)
"""Numbers of points of a piece for which the loss by its polynomial is computed; others take the next lower one."""


@dataclass(frozen=True)
class Noise:
    """The errors of a signal.

    Attributes
    ----------
    white_m : float
        Standard deviation of the errors of single points that are independent of each other, metres.
    shared_m : float
        Standard deviation of the misalignment, metres.
    length_m : float
        Distance at which the correlation of the misalignment has fallen to 1/e, metres.
    """

    white_m: float
    shared_m: float = 0.0
    length_m: float = LENGTHS_M[0]

    def covariance(self, lag_m: np.ndarray) -> np.ndarray:
        """Return the covariance of the misalignment at places so far apart, square metres."""
        return self.shared_m**2 * np.exp(-((lag_m / self.length_m) ** 2))

    def effective_m(self, step_m: float) -> float:
        """Return the standard deviation of independent errors that bend long elements as much, metres.

        Parameters
        ----------
        step_m : float
            Distance between the points.
        """
        return math.sqrt(self.white_m**2 + self.shared_m**2 * math.sqrt(math.pi) * self.length_m / step_m)


def estimated(pieces: Sequence[tuple[np.ndarray, int]], step_m: float, floor_m: float) -> Noise:
    """Return the noise that explains residuals.

    The residuals of a polynomial hang together less than the errors, because it follows them; the loss is computed.

    Parameters
    ----------
    pieces : sequence of ((n,) array, int)
        Residuals of a piece in order, metres, and degree of the polynomial that was fitted to it.
    step_m : float
        Mean distance between the points.
    floor_m : float
        Least standard deviation of single points, metres.
    """
    pieces = [(rest, degree) for rest, degree in pieces if len(rest) >= SIZES[0]]
    if not pieces:
        return Noise(floor_m)
    spread = np.array([rest @ rest / len(rest) for rest, _ in pieces])
    order = np.argsort(spread)
    middle = np.searchsorted(np.cumsum([len(pieces[i][0]) for i in order]), 0.5 * sum(len(one) for one, _ in pieces))
    limit = OUTLIER * spread[order[min(middle, len(order) - 1)]]
    pieces = [one for one, square in zip(pieces, spread) if square <= limit]
    seen = sum(_products(rest) for rest, _ in pieces)
    kinds: dict[tuple[int, int], int] = {}
    for rest, degree in pieces:
        size = max(one for one in SIZES if one <= len(rest))
        kinds[size, degree] = kinds.get((size, degree), 0) + len(rest)
    lags = step_m * np.arange(SIZES[-1])
    white = sum(count / size * _expected(np.eye(size), degree) for (size, degree), count in kinds.items())
    found = []
    for length in LENGTHS_M:
        gamma = np.exp(-((lags / length) ** 2))
        shared = sum(
            count / size * _expected(gamma[np.abs(np.subtract.outer(np.arange(size), np.arange(size)))], degree)
            for (size, degree), count in kinds.items()
        )
        both = np.column_stack([white, shared])
        values, misfit = _nonnegative(both, seen)
        found.append((misfit, Noise(max(math.sqrt(values[0]), floor_m), math.sqrt(values[1]), length)))
    return min(found, key=lambda one: one[0])[1]


def _products(rest: np.ndarray) -> np.ndarray:
    """Return sums of products of residuals at each lag, (LAGS,)."""
    padded = np.concatenate([rest, np.zeros(LAGS)])
    return np.array([padded[: len(rest)] @ padded[lag : lag + len(rest)] for lag in range(LAGS)])


def _expected(covariance: np.ndarray, degree: int) -> np.ndarray:
    """Return the sums of products to expect at each lag after a polynomial was fitted, (LAGS,)."""
    size = len(covariance)
    base = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, size), degree + 1))[0]
    rest = covariance - base @ (base.T @ covariance)
    rest -= (rest @ base) @ base.T
    return np.array([np.trace(rest, offset=lag) if lag < size else 0.0 for lag in range(LAGS)])


def _nonnegative(columns: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, float]:
    from scipy.optimize import nnls

    return nnls(columns, seen)
