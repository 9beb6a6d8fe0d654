"""Smooth what is measured along a line: a cubic spline whose bending is as probable as the measurements show.

A rail bends little, up as often as down. So the second derivative of the spline is noise of an unknown strength, with
rare large values at welds and in switches: Student's distribution. The strength is that under which the measurements
are most probable (the evidence, by Laplace's approximation); standard errors follow from the inverse of the
information matrix. Everything is banded, so that time grows with the length of the line. See docs/method.md section
6.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

KNOT_M = 0.5
"""Distance between the knots: a spline of this step follows waves of 2 m."""

STRENGTHS = 10.0 ** np.arange(-5.0, -1.9, 0.25)
"""Strengths of the second derivative that are tried, metres to the power of -1/2: from a vertical curve of 20 km to
waves of 2 mm that are 3 m long."""

USUAL_STRENGTH, STRENGTH_DECADES = 2e-3, 0.3
"""Strength that rails in service have, with waves of 1 mm that are 6 m long, and its standard deviation in decades: few
points that show no waves do not tell that there are none."""

LEAST_SHARE = 1e-3
"""Probability, relative to that of the best, below which a strength does not count."""

FREEDOM = 3.0
"""Degrees of freedom of Student's distribution of the second derivative: one weld in twenty metres stands out."""

ROUNDS = 4
"""Rounds in which large values lose weight; a fifth changes the evidence by less than 0.1."""

RIDGE = 1e-6
"""Information, relative to the mean of the measurements, that is always there, so that few of them are enough."""

DIFFERENCE = np.array([1.0, -2.0, 1.0])
"""Second difference of neighbouring coefficients."""

BAND = 4
"""Diagonals of all matrices, on one side: a place is in the reach of four coefficients."""


@dataclass(frozen=True)
class Spline:
    """A smoothed course of values, and its errors.

    Attributes
    ----------
    start_m, step_m : float
        First knot, and distance between knots.
    coefficients : (n,) array
    covariance : (4, n) array
        Covariances of each coefficient with itself and the next three.
    """

    start_m: float
    step_m: float
    coefficients: np.ndarray
    covariance: np.ndarray

    def at(self, t: np.ndarray) -> np.ndarray:
        """Return the values at chainages `t`, (m,); beyond the ends, those at the ends."""
        first, basis = self._basis(t)
        return np.sum(basis * self.coefficients[first + np.arange(BAND)[:, None]], axis=0)

    def sigma(self, t: np.ndarray) -> np.ndarray:
        """Return the standard errors at chainages `t`, (m,)."""
        first, basis = self._basis(t)
        variance = np.zeros(len(first))
        for one in range(BAND):
            for other in range(BAND):
                shared = self.covariance[abs(one - other), first + min(one, other)]
                variance += basis[one] * basis[other] * shared
        return np.sqrt(np.maximum(variance, 0.0))

    def _basis(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _basis(t, self.start_m, self.step_m, len(self.coefficients))


def smooth(t: np.ndarray, values: np.ndarray, information: np.ndarray, start_m: float, end_m: float) -> Spline:
    """Fit a spline to measurements.

    Parameters
    ----------
    t, values : (n,) arrays
        Chainage, metres, and measured value, at least one.
    information : (n,) array
        Inverse of the variance of each value.
    start_m, end_m : float
        Section of the line that the spline covers.
    """
    pieces = max(int(np.ceil((end_m - start_m) / KNOT_M)), 1)
    step_m, count = max(end_m - start_m, 1e-3) / pieces, pieces + BAND - 1
    trend = _trend(t, values, information, start_m + step_m * (np.arange(count) - 1))
    first, basis = _basis(t, start_m, step_m, count)
    off = values - np.sum(basis * trend[first + np.arange(BAND)[:, None]], axis=0)
    score = np.zeros(count)
    data = np.zeros((BAND, count))
    for one in range(BAND):
        score += np.bincount(first + one, information * basis[one] * off, count)
        for apart in range(BAND - one):
            data[apart] += np.bincount(first + one, information * basis[one] * basis[one + apart], count)
    data[0] += RIDGE * data[0].mean()
    fits = [_fit(data, score, strength * step_m**1.5) for strength in STRENGTHS]
    evidence = [one.evidence for one in fits] - 0.5 * (np.log10(STRENGTHS / USUAL_STRENGTH) / STRENGTH_DECADES) ** 2
    share = np.exp(evidence - np.max(evidence))
    likely = [(one, part) for one, part in zip(fits, share / share.sum()) if part > LEAST_SHARE * share.max()]
    mean = sum(part * one.coefficients for one, part in likely)
    covariance = sum(part * (_covariance(one.factor) + _products(one.coefficients - mean)) for one, part in likely)
    return Spline(start_m, step_m, trend + mean, covariance)


def _trend(t: np.ndarray, values: np.ndarray, information: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the straight line through measurements at `places`, (n,), so that `RIDGE` pulls towards it."""
    middle, level = (np.average(one, weights=information) for one in (t, values))
    spread = np.sum(information * (t - middle) ** 2)
    rise = np.sum(information * (t - middle) * (values - level)) / spread if spread > 0 else 0.0
    return level + rise * (places - middle)


@dataclass(frozen=True)
class _Fit:
    """Coefficients under one strength of the prior, the Cholesky factor of their information, and the evidence."""

    coefficients: np.ndarray
    factor: np.ndarray
    evidence: float


def _fit(data: np.ndarray, score: np.ndarray, scale: float) -> _Fit:
    """Find the most probable coefficients if second differences have the scale `scale`, by reweighting."""
    count = len(score)
    weight = np.ones(count - len(DIFFERENCE) + 1)
    for _ in range(ROUNDS):
        factor = cholesky_banded(data + _bending(weight / scale**2, count), lower=True)
        coefficients = cho_solve_banded((factor, True), score)
        off = np.convolve(coefficients, DIFFERENCE[::-1], mode="valid") / scale
        weight = (FREEDOM + 1) / (FREEDOM + off**2)
    explained = score @ coefficients - 0.5 * coefficients @ _times(data, coefficients)
    prior = -0.5 * (FREEDOM + 1) * np.log1p(off**2 / FREEDOM).sum() - len(off) * np.log(scale)
    return _Fit(coefficients, factor, explained + prior - np.log(factor[0]).sum())


def _bending(weight: np.ndarray, count: int) -> np.ndarray:
    """Return the information of the prior, (4, count), given that of each second difference."""
    band = np.zeros((BAND, count))
    for one in range(len(DIFFERENCE)):
        for apart in range(len(DIFFERENCE) - one):
            band[apart, one : one + len(weight)] += weight * DIFFERENCE[one] * DIFFERENCE[one + apart]
    return band


def _times(band: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Multiply a symmetric banded matrix by a vector."""
    result = band[0] * vector
    for apart in range(1, BAND):
        result[apart:] += band[apart, :-apart] * vector[:-apart]
        result[:-apart] += band[apart, :-apart] * vector[apart:]
    return result


def _products(vector: np.ndarray) -> np.ndarray:
    """Return the products of each element with itself and the next three, (4, n)."""
    return np.array([vector * np.append(vector[apart:], np.zeros(apart)) for apart in range(BAND)])


def _covariance(factor: np.ndarray) -> np.ndarray:
    """Return the band of the inverse of a matrix from its Cholesky factor, from the end to the start (Takahashi)."""
    count = factor.shape[1]
    inverse = np.zeros((count + BAND - 1, BAND))
    below = factor[1:] / factor[0]
    for number in range(count - 1, -1, -1):
        column, after = below[:, number], inverse[number + 1 : number + BAND]
        # Covariances of the next three coefficients with each other.
        block = np.array(
            [
                [after[0, 0], after[0, 1], after[0, 2]],
                [after[0, 1], after[1, 0], after[1, 1]],
                [after[0, 2], after[1, 1], after[2, 0]],
            ]
        )
        inverse[number, 1:] = -block @ column
        inverse[number, 0] = 1 / factor[0, number] ** 2 - column @ inverse[number, 1:]
    return inverse[:count].T


def _basis(t: np.ndarray, start_m: float, step_m: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the first coefficient that reaches each place, and the weights, (4, m), of this one and the next three."""
    place = np.clip((np.asarray(t, dtype=float) - start_m) / step_m, 0.0, count - BAND + 1)
    first = np.minimum(place.astype(int), count - BAND)
    x = place - first
    return first, np.array([(1 - x) ** 3, 3 * x**3 - 6 * x**2 + 4, -3 * x**3 + 3 * x**2 + 3 * x + 1, x**3]) / 6
