"""Errors of a measured track: those of single points, and the misalignment that neighbours share."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Optional

import numpy as np
from scipy import sparse
from scipy.linalg import cholesky_banded, toeplitz
from scipy.optimize import nnls

from ..spread import sigma_by_median

LENGTHS_M = (3.0, 4.0, 5.0, 6.5, 8.0, 10.0, 12.0, 15.0, 18.0, 22.0, 27.0)
"""Correlation lengths of the misalignment that are tried, metres: track is out of line over 5 to 30 m."""

LAGS = 30
"""Number of lags at which the covariance of the residuals is compared."""

FAR = 4.0
"""Distance in correlation lengths beyond which the misalignment is independent: the correlation is below 1e-6, so that
the covariance stays positive when it is cut off there."""

STRAY = 6.0
"""A point does not count if it lies farther off its neighbours than this many times the usual distance: chance does not
explain it."""

TOGETHER = 5
"""Strays this many points apart or fewer belong to one bad place, whose other points do not count, either."""

OUTLIER = 2.0
"""A piece with a mean square this many times the median is left out: an element begins within it."""

SIZES = (8, 12, 18, 27, 40, 60, 90, 135, 200)
"""Numbers of points of a piece for which the loss by its polynomial is computed; others take the next lower one."""


@dataclass(frozen=True)
class Noise:
    """The errors of a signal, metres.

    `white_m` is the standard deviation of the errors of single points that are independent of each other, `shared_m`
    that of the misalignment, and `length_m` the distance at which its correlation has fallen to 1/e.
    """

    white_m: float
    shared_m: float = 0.0
    length_m: float = LENGTHS_M[0]

    def covariance(self, lag_m: np.ndarray) -> np.ndarray:
        """Return the covariance of the misalignment at places with this distance, square metres."""
        return self.shared_m**2 * np.exp(-((lag_m / self.length_m) ** 2))

    def effective_m(self, step_m: float) -> float:
        """Return the standard deviation of independent errors, one each step, that bend long elements as much."""
        return math.sqrt(self.white_m**2 + self.shared_m**2 * math.sqrt(math.pi) * self.length_m / step_m)

    def factor(self, s: np.ndarray, spread: np.ndarray, variance: np.ndarray) -> Optional[np.ndarray]:
        """Return the Cholesky factor of the covariance of means over blocks, (b, n) metres, in lower banded form.

        The distances of the points in each block have a mean and a variance, `s` and `spread`; `variance` is that of
        what is independent in the mean. None without misalignment.
        """
        if not self.shared_m:
            return None
        rows = []
        for lag in range(len(s)):
            apart = s[lag:] - s[: len(s) - lag]
            squared = self.length_m**2 + 2.0 * (spread[lag:] + spread[: len(s) - lag])
            if lag and (apart**2 > FAR**2 * squared).all():
                break
            value = self.shared_m**2 * self.length_m * np.exp(-(apart**2) / squared) / np.sqrt(squared)
            rows.append(np.concatenate([value, np.zeros(lag)]))
        rows[0] = rows[0] + variance
        return cholesky_banded(rows, lower=True)


def off_neighbours(s: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return how far points lie off the cubic through the four around each, (n - 4,), over its standard deviation.

    The unit is the standard deviation of errors that neighbours do not share. No curve of a track is seen: a jump of
    the curvature to a radius of 25 m counts 3 mm.
    """
    near = [slice(0, -4), slice(1, -3), slice(3, -1), slice(4, None)]
    middle = s[2:-2]
    off, square = y[2:-2].copy(), np.ones(len(middle))
    for one in near:
        share = np.ones(len(middle))
        for other in near:
            if other is not one:
                share *= (middle - s[other]) / (s[one] - s[other])
        off -= share * y[one]
        square += share**2
    return off / np.sqrt(square)


def independent_m(s: np.ndarray, y: np.ndarray) -> float:
    """Return the standard deviation of errors that neighbours do not share, from each point and the four around it."""
    if len(s) < 2 * SIZES[0]:
        return 0.0
    return sigma_by_median(off_neighbours(s, y))


def strays(s: np.ndarray, y: np.ndarray, limit_m: float) -> np.ndarray:
    """Return which points lie farther off their neighbours than a limit and chance explain, (n,) bool."""
    found = np.zeros(len(s), dtype=bool)
    if len(s) < 2 * SIZES[0]:
        return found
    found[2:-2] = np.abs(off_neighbours(s, y)) > max(limit_m, STRAY * independent_m(s, y))
    which = np.flatnonzero(found)
    for first, last in zip(which, which[1:]):
        found[first:last] = found[first:last] | (last - first <= TOGETHER)
    found[:2], found[-2:] = found[2], found[-3]  # which have too few neighbours of their own
    return found


def estimated(pieces: Sequence[tuple[np.ndarray, float]], step_m: float, floor_m: float, sure: float = 0.0) -> Noise:
    """Return the noise that explains residuals of polynomials.

    A piece is its residuals in order, metres, and the degree of the polynomial that was fitted to it. Residuals hang
    together less than the errors, because the polynomial follows them; the loss is computed. Between two degrees, as
    much is lost as a share of the errors loses by either.

    Points are `step_m` apart on average and err by at least `floor_m`. Misalignment must exceed what chance explains by
    `sure` standard errors; with 0, it need not.
    """
    pieces = _usual([(rest, degree) for rest, degree in pieces if len(rest) >= SIZES[0]])
    if not pieces:
        return Noise(floor_m)
    seen = np.sum([_products(rest) for rest, _ in pieces], axis=0)
    kinds: defaultdict[tuple[int, int], float] = defaultdict(float)
    for rest, degree in pieces:
        size, lower = max(size for size in SIZES if size <= len(rest)), math.floor(degree)
        kinds[size, lower] += len(rest) * (1.0 + lower - degree)
        kinds[size, lower + 1] += len(rest) * (degree - lower)
    lags = step_m * np.arange(SIZES[-1])
    white = _expected_of(kinds, np.where(lags == 0, 1.0, 0.0))
    alone = float(white @ seen / (white @ white))
    if sure and not _hang_together(seen - alone * white, alone, sum(kinds.values()), sure):
        return Noise(max(math.sqrt(alone), floor_m))
    found = []
    for length in LENGTHS_M:
        shared = _expected_of(kinds, np.exp(-((lags / length) ** 2)))
        (own, common), misfit = nnls(np.column_stack([white, shared]), seen)
        found.append((misfit, Noise(max(math.sqrt(own), floor_m), math.sqrt(common), length)))
    return min(found, key=lambda one: one[0])[1]


def _hang_together(products: np.ndarray, variance: float, count: float, sure: float) -> bool:
    """Return whether products of residuals at lags, (LAGS,), are more than those of independent errors would be."""
    sums = np.cumsum(products[1:])
    error = variance * np.sqrt(count * np.arange(1, LAGS))
    return bool((sums / sure > error).any())


def _usual(pieces: list[tuple[np.ndarray, float]]) -> list[tuple[np.ndarray, float]]:
    """Return the pieces without those that fit badly, because an element begins within them."""
    if not pieces:
        return []
    squares = np.array([rest @ rest / len(rest) for rest, _ in pieces])
    sizes = np.array([len(rest) for rest, _ in pieces])
    order = np.argsort(squares)
    median = squares[order][np.searchsorted(np.cumsum(sizes[order]), 0.5 * sizes.sum())]
    return [piece for piece, square in zip(pieces, squares) if square <= OUTLIER * median]


def _products(rest: np.ndarray) -> np.ndarray:
    """Return sums of products of residuals at each lag, (LAGS,)."""
    padded = np.concatenate([rest, np.zeros(LAGS)])
    return np.array([padded[: len(rest)] @ padded[lag : lag + len(rest)] for lag in range(LAGS)])


def _expected_of(kinds: Mapping[tuple[int, int], float], correlation: np.ndarray) -> np.ndarray:
    """Return the sums of products to expect at each lag, (LAGS,), for errors with a correlation by lag.

    The numbers of points are given by the size of the piece and the degree of its polynomial.
    """
    total = np.zeros(LAGS)
    for (size, degree), count in kinds.items():
        base = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, size), degree + 1))[0]
        rest = toeplitz(correlation[:size])
        rest = rest - base @ (base.T @ rest)
        rest -= (rest @ base) @ base.T
        traces = [np.trace(rest, offset=lag) for lag in range(min(size, LAGS))]
        total[: len(traces)] += np.multiply(traces, count / size)
    return total


def shared_covariance(s: np.ndarray, noise: Noise) -> sparse.csr_matrix:
    """Return the covariance of the misalignment at points with increasing distances, (n, n), square metres."""
    count = len(s)
    rows, columns, values = [np.arange(count)], [np.arange(count)], [np.full(count, noise.shared_m**2)]
    lag = 1
    while lag < count:
        apart = np.abs(s[lag:] - s[:-lag])
        near = np.flatnonzero(apart < FAR * noise.length_m)
        if not len(near):
            break
        value = noise.covariance(apart[near])
        rows += [near, near + lag]
        columns += [near + lag, near]
        values += [value, value]
        lag += 1
    flat = (np.concatenate(rows), np.concatenate(columns))
    return sparse.coo_matrix((np.concatenate(values), flat), shape=(count, count)).tocsr()
