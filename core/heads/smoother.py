"""Smooth what is measured along a line: a cubic spline that bends as the measurements show, and no more.

A rail follows its design, whose curvature changes little and seldom, and has waves of some metres about it. So the
course is the sum of two splines: the third derivative of the one and the second of the other are noise, with rare large
values where curves begin and at welds: Student's distribution. Where the waves are errors of the cloud, the course is
the design alone. How strong both are, the evidence tells (by Laplace's
approximation); standard errors follow from the inverse of the information matrix. Everything is banded, so that time
grows with the length of the line. See docs/method.md section 6.4.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import cho_solve_banded, cholesky_banded

from ..polyline import Polyline, interpolate

KNOT_M = 0.5
"""Distance between the knots: a spline of this step follows waves of 2 m."""

AMPLITUDE_DECADES = 1.0
"""Standard deviation of the logarithm of the amplitude of waves: few points that show no waves hardly tell that there
are none."""

LEAST_SHARE = 1e-2
"""Probability below which strengths do not count."""

FREEDOM = 3.0
"""Degrees of freedom of Student's distribution: one weld in twenty metres stands out."""

ROUNDS = 3
"""Rounds in which large values lose weight; a fourth changes no error by more than 0.01 mm."""

RIDGE = 1e-6
"""Information, relative to the mean of the measurements, that is always there, so that few of them are enough."""

ROUNDING = 1e-14
"""Information, relative to the largest of the prior, by which rounding cannot make the matrix indefinite."""

DESIGN, WAVES = np.array([-1.0, 3.0, -3.0, 1.0]), np.array([1.0, -2.0, 1.0])
"""Differences of neighbouring coefficients that are noise."""

BAND = 4
"""Diagonals of the matrices of one spline, on one side: a place is in the reach of four coefficients."""


@dataclass(frozen=True)
class Prior:
    """What is expected of a course before it is measured.

    Attributes
    ----------
    designs : (d,) array
        Strengths of the third derivative of the design that are tried, metres to the power of -3/2.
    amplitudes_m : (a,) array
        Standard deviations of the waves that are tried.
    usual_m : float
        The most probable of them.
    length_m : float
        Length from which waves return to zero: what bends over more is the design.
    followed : bool
        Whether they are waves of the rail, and not errors of the cloud.
    """

    designs: np.ndarray
    amplitudes_m: np.ndarray
    usual_m: float
    length_m: float
    followed: bool


SHARP = Prior(10.0 ** np.arange(-7.0, -3.5), 10.0 ** np.arange(-4.0, -2.4, 0.5), 4e-4, 4.0, followed=True)
"""Rails in service, in clouds that show the edges of heads. A transition from straight track to an arc of 300 m in 33 m
has a third derivative of 1e-4 per m². With waves of 8 m, those of 3 m were followed less than the standard error said.
"""

BLUNT = Prior(10.0 ** np.arange(-6.0, -1.5), 10.0 ** np.arange(-3.0, -1.4, 0.5), 5e-3, 6.0, followed=False)
"""The same in clouds that blunt them: errors of dense matching are alike over 1 to 10 m, and in a switch, where curves
begin abruptly, the design alone has to follow the rail: an arc of 25 m begins with a third derivative of 0.04 per m²
over a metre."""

BLUNT_HEIGHTS = replace(BLUNT, designs=BLUNT.designs[:-1], length_m=2.0)
"""The same in height, where the blur blends a head with sleepers and the gaps between them: errors of bins of 25 cm in
clouds from images are alike by 0.6 at 0.25 m, by 0.35 at 0.5 m, and not at 1 m. No rail bends as sharply in height: the
course would follow what is classified as rail metres above it."""


@dataclass(frozen=True)
class Spline:
    """A smoothed course of values, with knots every `step_m` from `start_m`, and its errors.

    `likely` has, for each likely strength of the prior, its probability, the Cholesky factor of the information about
    both splines, and by how much its coefficients differ from the mean.
    """

    start_m: float
    step_m: float
    coefficients: np.ndarray
    likely: list[tuple[float, np.ndarray, np.ndarray]]
    prior: Prior

    @cached_property
    def covariance(self) -> np.ndarray:
        """Covariances of each coefficient with itself and the next three, (4, n)."""
        covariances = (part * (_covariance(factor, self.prior) + _products(off)) for part, factor, off in self.likely)
        return np.sum(list(covariances), axis=0)

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

    def followed(self, t: np.ndarray, values: np.ndarray, information: np.ndarray) -> np.ndarray:
        """Return how far the course moves at `t`, (n,), if what is measured there moves by `values`, (n,)."""
        first, basis = self._basis(t)
        score = np.zeros(len(self.coefficients))
        for one in range(BAND):
            score += np.bincount(first + one, information * basis[one] * values, len(score))
        moved = sum(part * cho_solve_banded((factor, True), np.repeat(score, 2)) for part, factor, _ in self.likely)
        return replace(self, coefficients=_course(moved, self.prior)).at(t)

    def _basis(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _basis(t, self.start_m, self.step_m, len(self.coefficients))


def smooth(
    t: np.ndarray,
    values: np.ndarray,
    information: np.ndarray,
    start_m: float,
    end_m: float,
    line: np.ndarray | None = None,
    prior: Prior = SHARP,
) -> Spline:
    """Fit a spline from `start_m` to `end_m` to measurements at chainages `t`, with the inverse of their variances.

    `line`, (k, 2), is a line in plan to whose left the values are measured: the design is that of the line and the
    values together. `prior` is what is expected about the design.
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
    bends = np.zeros(pieces) if line is None else _third_differences(line, start_m, step_m, pieces)
    tried = np.repeat(prior.designs, len(prior.amplitudes_m)), np.tile(prior.amplitudes_m, len(prior.designs))
    coefficients, factors, evidence = _fits(data, score, _Priors(*tried, step_m, bends, prior))
    share = np.exp(evidence - evidence.max())
    share /= share.sum()
    likely = share > LEAST_SHARE
    mean = share[likely] @ coefficients[likely]
    fits = [(share[one], factors[:, one], coefficients[one] - mean) for one in np.flatnonzero(likely)]
    return Spline(start_m, step_m, trend + mean, fits, prior)


def bridge_error(t: np.ndarray, stations: np.ndarray, turn: float) -> np.ndarray:
    """Return how far a course may be off where nothing is measured, (s,) metres: there, a curve may begin unseen.

    A third derivative that is wrong by k, up to `turn` (1/m²), moves a course by k a b (a + b) / 12 at distances a and
    b from what is measured, at increasing chainages `t`, and by k a³ / 6 beyond the last of it.
    """
    after = np.searchsorted(t, stations)
    sides = np.array([stations - np.append(-np.inf, t)[after], np.append(t, np.inf)[after] - stations])
    is_near, is_inside = np.isfinite(sides).any(axis=0), np.isfinite(sides).all(axis=0)
    near_m = np.where(is_near, sides.min(axis=0), 0.0)
    far_m = np.where(is_inside, sides.max(axis=0), 0.0)
    off = np.where(is_inside, near_m * far_m * (near_m + far_m) / 12, near_m**3 / 6)
    return np.where(is_near, turn * off, np.inf)


def _trend(t: np.ndarray, values: np.ndarray, information: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the straight line through measurements at `places`, (n,), so that `RIDGE` pulls towards it."""
    middle, level = (np.average(one, weights=information) for one in (t, values))
    spread = np.sum(information * (t - middle) ** 2)
    rise = np.sum(information * (t - middle) * (values - level)) / spread if spread > 0 else 0.0
    return level + rise * (places - middle)


def _third_differences(line: np.ndarray, start_m: float, step_m: float, pieces: int) -> np.ndarray:
    """Return the third differences, to its left, of the coefficients of a line in plan, (k, 2), for each piece."""
    own, knots = Polyline(line), start_m + step_m * np.arange(pieces + 1)
    curve = CubicSpline(knots, own.at(knots), bc_type="natural")
    normals = interpolate(own.normals, own.t, 0.5 * (knots[1:] + knots[:-1]))
    return 6 * step_m**3 * np.einsum("ij,ij->i", curve.c[0], normals)


@dataclass(frozen=True)
class _Priors:
    """What is expected of the coefficients of design and waves, which take turns in one array, for `s` strengths.

    `step_m` is the distance between the knots, and `bends`, (p,), are third differences that the line has without the
    spline.
    """

    design: np.ndarray
    amplitude_m: np.ndarray
    step_m: float
    bends: np.ndarray
    prior: Prior

    @cached_property
    def scales(self) -> tuple[np.ndarray, np.ndarray]:
        """Scales of the differences of design and waves, (s, 1) each."""
        return self.design[:, None] * self.step_m**2.5, np.sqrt(self.step_m**3 / self._stiffness[:, None])

    @cached_property
    def hold(self) -> np.ndarray:
        """Information by which waves return to zero over their length, (s, 1)."""
        return self._stiffness[:, None] * (2 * np.pi / self.prior.length_m) ** 4 * self.step_m

    @property
    def _stiffness(self) -> np.ndarray:
        """Inverse of the spectral density of the second derivative of waves that have the amplitude."""
        return 1 / (2 * np.sqrt(2) * self.amplitude_m**2 * (2 * np.pi / self.prior.length_m) ** 3)

    def off(self, found: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the differences of design, (s, p), and waves in their scales, given coefficients, (s, 2 n)."""
        design, waves = self.scales
        bends = np.diff(found[:, ::2], 3) + self.bends
        return bends / design, np.diff(found[:, 1::2], 2) / waves

    def information(self, weights: tuple[np.ndarray, np.ndarray], count: int) -> np.ndarray:
        """Return the information, (8, s, 2 count), given the weights of the differences."""
        band = np.zeros((2 * BAND, len(self.design), 2 * count))
        for number, (scale, weight, difference) in enumerate(zip(self.scales, weights, (DESIGN, WAVES))):
            own = weight / scale**2
            for one in range(len(difference)):
                for apart in range(len(difference) - one):
                    part = difference[one] * difference[one + apart] * own
                    band[2 * apart, :, number::2][:, one : one + own.shape[1]] += part
        band[0, :, 1::2] += self.hold
        return band

    def log_probability(self, found: np.ndarray) -> np.ndarray:
        """Return the logarithms, (s,), of the probability densities of coefficients, (s, 2 n), and of the amplitude."""
        off = np.concatenate(self.off(found), axis=1)
        usual = np.log10(self.amplitude_m / self.prior.usual_m) / AMPLITUDE_DECADES
        design, count = self.scales[0][:, 0], found.shape[1] // 2
        scales = len(self.bends) * np.log(design) + count * np.log(self.amplitude_m)
        student = 0.5 * (FREEDOM + 1) * np.log1p(off**2 / FREEDOM).sum(axis=1)
        held = 0.5 * (self.hold * found[:, 1::2] ** 2).sum(axis=1)
        return -student - held - scales - 0.5 * usual**2


def _fits(data: np.ndarray, score: np.ndarray, priors: _Priors) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the most probable coefficients by reweighting, for all strengths at once, (s, n), and their evidence, (s,).

    Between both, returns the Cholesky factors of the information about both splines, (8, s, 2 n).
    """
    count, strengths = len(score), len(priors.design)
    data_of_both = _of_both(data)[:, None]
    weights = np.ones((strengths, len(priors.bends))), np.ones((strengths, count - len(WAVES) + 1))
    for _ in range(ROUNDS):
        right = np.tile(np.repeat(score, 2), (strengths, 1))
        bends = weights[0] / priors.scales[0] ** 2 * priors.bends
        for one, factor in enumerate(DESIGN):
            right[:, ::2][:, one : one + len(priors.bends)] -= factor * bends
        band = data_of_both + priors.information(weights, count)
        band[0] += ROUNDING * band[0].max(axis=1, keepdims=True)
        factors = cholesky_banded(band.reshape(len(band), -1), lower=True, check_finite=False)  # they are one matrix
        found = cho_solve_banded((factors, True), right.ravel(), check_finite=False).reshape(right.shape)
        design, waves = priors.off(found)
        weights = (FREEDOM + 1) / (FREEDOM + design**2), (FREEDOM + 1) / (FREEDOM + waves**2)
    both = found[:, ::2] + found[:, 1::2]
    explained = both @ score - 0.5 * (both * _times(data, both)).sum(axis=1)
    factors = factors.reshape(band.shape)
    evidence = explained + priors.log_probability(found) - np.log(factors[0]).sum(axis=1)
    return _course(found, priors.prior), factors, evidence


def _course(found: np.ndarray, prior: Prior) -> np.ndarray:
    """Return the coefficients of the course, (..., n), given those of design and waves, (..., 2 n)."""
    return found[..., ::2] + found[..., 1::2] if prior.followed else found[..., ::2]


def _of_both(data: np.ndarray) -> np.ndarray:
    """Return the information about the coefficients of both splines, (8, 2 n), given that about their sum, (4, n)."""
    both = np.zeros((2 * BAND, 2 * data.shape[1]))
    for apart in range(BAND):
        both[2 * apart, ::2] = both[2 * apart, 1::2] = both[2 * apart + 1, ::2] = data[apart]
        if apart:
            both[2 * apart - 1, 1::2] = data[apart]
    return both


def _times(band: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Multiply a symmetric banded matrix by vectors, (s, n)."""
    result = band[0] * vectors
    for apart in range(1, BAND):
        result[:, apart:] += band[apart, :-apart] * vectors[:, :-apart]
        result[:, :-apart] += band[apart, :-apart] * vectors[:, apart:]
    return result


def _products(vector: np.ndarray) -> np.ndarray:
    """Return the products of each element with itself and the next three, (4, n)."""
    return np.array([vector * np.append(vector[apart:], np.zeros(apart)) for apart in range(BAND)])


def _covariance(factor: np.ndarray, prior: Prior) -> np.ndarray:
    """Return the band, (4, n), of the covariance of the course.

    The band of the inverse follows from the Cholesky factor, from the end to the start (Takahashi).
    """
    size, count = factor.shape
    below, own = (factor[1:] / factor[0]).T, 1 / factor[0] ** 2
    inverse = np.zeros((count, size))
    after = np.zeros((size - 1, size - 1))  # covariances of the next coefficients with each other
    for number in range(count - 1, -1, -1):
        row = inverse[number]
        row[1:] = -after @ below[number]
        row[0] = own[number] - below[number] @ row[1:]
        after[1:, 1:] = after[:-1, :-1].copy()
        after[0] = after[:, 0] = row[:-1]
    if not prior.followed:
        return inverse[::2, ::2].T
    covariance = inverse[::2, ::2].T + inverse[1::2, ::2].T + inverse[::2, 1::2].T
    covariance[1:] += inverse[1::2, 1:-1:2].T
    covariance[0] += inverse[::2, 1]
    return covariance


def _basis(t: np.ndarray, start_m: float, step_m: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the first coefficient that reaches each place, and the weights, (4, m), of this one and the next three."""
    place = np.clip((np.asarray(t, dtype=float) - start_m) / step_m, 0.0, count - BAND + 1)
    first = np.minimum(place.astype(int), count - BAND)
    x = place - first
    return first, np.array([(1 - x) ** 3, 3 * x**3 - 6 * x**2 + 4, -3 * x**3 + 3 * x**2 + 3 * x + 1, x**3]) / 6
