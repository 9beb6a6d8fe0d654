"""The curves of parallel tracks, drawn together: each bends little, and the distance between two bends less.

A section that one track hides, or that few points show, lies on the curve of the others, at their distance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import block_diag, csr_matrix, diags, vstack

from ..polyline import Polyline, cross
from .guide_line import STATION_M
from .ridges import OUTLIER, Sections
from .search import parallel

LITTLE = 1e-12
"""Added to the diagonal, so that a matrix without any data can be solved."""

STILL_M = 0.004
"""Standard deviation, over 10 m, of the third differences of a track in plan where its curvature does not change, and
of the second differences of the distance between two tracks: it changes by as much in a curve of 300 m radius."""

STRAIGHT_SECTIONS = 2
"""Sections for which `STILL_M` counts for a track beside what is measured."""

TURN_SECTIONS = 5
"""Sections over which the differences are measured, for which `STILL_M` counts for a distance, and up to which
residuals do not judge the standard errors: a transition is rarely shorter than 50 m."""

FIRST_TURN_M, FIRST_APART_M = 0.03, 0.3
"""Standard deviations with which the search for both begins: a curve of 300 m radius whose transition is 60 m long has
third differences of 0.056 m, the toe of a switch 0.3 m; its tracks part with second differences of 0.3 to 0.5 m."""

CURVE_PASSES = 12
"""Weightings of the curve, after which it hardly moves."""

TRUSTED = 0.2
"""Least weight of the sections whose residuals judge the standard errors."""

HOLD_M = 0.3
"""Standard error of the place of a section that is not seen: it stays where the last curve passed."""

SPREAD = (0.5, 3.0)
"""Limits of the factor by which residuals correct the standard errors."""

TURNED = 0.02
"""Sine of the angle between two lines below which they keep their distance: branches of switches turn by more."""

FOOT_ROUNDS = 2
"""Rounds of the search for the place beside a station on a parallel line; the first one starts at a vertex."""


@dataclass(frozen=True)
class Smooth:
    """A smooth curve through n places: `values`, (n, d), and the differences that are penalised, `rows`, (k, n).

    `covariance`, (n, n), is that of the curve if each place has the variance 1 / weight.
    """

    values: np.ndarray
    covariance: np.ndarray
    rows: csr_matrix

    @property
    def variance(self) -> np.ndarray:
        """Variance of each place, (n,)."""
        return np.diag(self.covariance)

    @property
    def bend(self) -> np.ndarray:
        """Expected square of each penalised difference, (k,): that of the curve's, and its variance."""
        spread = self.rows.multiply(self.rows @ self.covariance).sum(axis=1)
        return ((self.rows @ self.values) ** 2).sum(axis=1) + np.asarray(spread).ravel()


def smooth(values: np.ndarray, weight: np.ndarray, rows: csr_matrix, sigma: float | np.ndarray) -> Smooth:
    """Return the curve that balances places, `values` (n, d), and smoothness.

    `weight`, (n,), is 1 / variance; places with a weight of 0 may hold any number. `rows`, (k, n), such as those of
    `differences`, give differences that are small: `sigma`, one or (k,), is their standard deviation.
    """
    stiffness = np.broadcast_to(1 / np.square(sigma), rows.shape[0])
    matrix = (rows.T @ diags(stiffness) @ rows).toarray()
    matrix[np.diag_indices(len(matrix))] += weight + LITTLE
    covariance = np.linalg.inv(matrix)
    return Smooth(covariance @ (weight[:, None] * values), covariance, rows)


def differences(count: int, order: int) -> csr_matrix:
    """Return the differences of some order between places at equal steps, (count - order, count)."""
    if count <= order:
        return csr_matrix((0, count))
    weights = np.diff(np.eye(order + 1), order, axis=0)[0]
    return diags(weights, range(order + 1), shape=(count - order, count), format="csr")


@dataclass(frozen=True)
class TrackCurve:
    """The curve of a track at the middles of its sections, `xy` (n, 2).

    `sigma`, (n,), is the standard error across, and `beside`, (n,), the distance of the section's own middle from the
    curve, metres.
    """

    xy: np.ndarray
    sigma: np.ndarray
    beside: np.ndarray


def draw_together(lines: Sequence[Polyline], found: Sequence[Sections]) -> list[TrackCurve]:
    """Draw the curves of tracks through their sections, which are seen on `lines`.

    How much curvature and distance change is measured along the tracks (expectation maximisation of the variance of the
    differences), so that a straight stays stiff beside a transition and a switch.
    """
    stations = [one.stations_on(line) for line, one in zip(lines, found)]
    place = np.concatenate([line.at(t) for line, t in zip(lines, stations)])
    normal = np.concatenate([line.left_at(t) for line, t in zip(lines, stations)])
    shows, offset, sigma = (
        np.concatenate([getattr(one, name) for one in found]) for name in ("shows", "offset", "sigma")
    )
    target = place + np.where(shows, offset, 0.0)[:, None] * normal
    weight, robust = np.where(shows, sigma**-2, HOLD_M**-2), np.ones(len(target))
    stiff = _Stiffness.of(lines, stations)
    turn_m = stiff.first
    for _ in range(CURVE_PASSES):
        curve = smooth(target, weight * robust, stiff.rows, turn_m)
        beside = ((target - curve.values) * normal).sum(axis=1)
        robust = np.where(shows, 1 / (1 + (beside / sigma / OUTLIER) ** 2) ** 2, 1.0)
        turn_m = stiff.measured(curve.bend)
    error, good = np.sqrt(curve.variance), shows & (robust > TRUSTED)
    parts = np.split(np.arange(len(target)), np.cumsum([len(t) for t in stations])[:-1])
    return [
        TrackCurve(curve.values[at], error[at] * _spread((beside / sigma)[at][good[at]]), beside[at]) for at in parts
    ]


def _spread(residual: np.ndarray) -> float:
    """Return how much larger than their standard errors residuals are."""
    return float(np.clip(np.sqrt(np.mean(residual**2)), *SPREAD)) if len(residual) > TURN_SECTIONS else 1.0


@dataclass(frozen=True)
class _Stiffness:
    """The differences that are small, those of each track and of their distances: `rows`, (k, n) over all stations.

    The search for their standard deviations begins with `first`, (k,). A block is the number of rows that follow each
    other along the line, their standard deviation where nothing turns, and for how many sections this counts.
    """

    rows: csr_matrix
    first: np.ndarray
    blocks: list[tuple[int, float, int]]

    @classmethod
    def of(cls, lines: Sequence[Polyline], stations: Sequence[np.ndarray]) -> _Stiffness:
        """Set up the differences at the stations of lines."""
        own = [differences(len(t), 3) for t in stations]
        apart = list(_distances(lines, stations))
        blocks = [(one.shape[0], STILL_M, STRAIGHT_SECTIONS) for one in own]
        blocks += [(one.shape[0], STILL_M, TURN_SECTIONS) for one in apart]
        starts = [FIRST_TURN_M] * len(own) + [FIRST_APART_M] * len(apart)
        first = np.concatenate([np.full(count, start) for (count, _, _), start in zip(blocks, starts)])
        return cls(vstack([block_diag(own), *apart], format="csr"), first, blocks)

    def measured(self, bend: np.ndarray) -> np.ndarray:
        """Return the standard deviations, (k,), by the expected squares of the differences, (k,)."""
        found, kernel = [], np.ones(TURN_SECTIONS)
        for squares, (rows, still_m, sections) in zip(np.split(bend, self._ends), self.blocks):
            total, count = (
                np.convolve(one, kernel)[TURN_SECTIONS // 2 :][:rows] if rows else one
                for one in (squares, np.ones(rows))
            )
            found.append(np.sqrt((sections * still_m**2 + total) / (sections + count)))
        return np.concatenate(found)

    @property
    def _ends(self) -> np.ndarray:
        return np.cumsum([rows for rows, _, _ in self.blocks])[:-1]


def _distances(lines: Sequence[Polyline], stations: Sequence[np.ndarray]) -> Iterator[csr_matrix]:
    """Yield the second differences of the distance between each two parallel lines, over the stations of all."""
    first = np.cumsum([0, *map(len, stations)])
    for one in range(len(lines)):
        for other in range(one + 1, len(lines)):
            near, t = _feet(lines[one], stations[one], lines[other])
            weights, columns = _interpolation(t, stations[other])
            near &= (t >= stations[other][0]) & (t <= stations[other][-1])
            count = len(near)
            across = csr_matrix(
                (
                    np.column_stack([np.ones(count), -weights]).ravel(),
                    np.column_stack([first[one] + np.arange(count), first[other] + columns]).ravel(),
                    np.arange(count + 1) * (1 + weights.shape[1]),
                ),
                shape=(count, first[-1]),
            )
            whole = near[2:] & near[1:-1] & near[:-2]
            if whole.any():
                yield (differences(count, 2) @ across)[whole]


def _feet(line: Polyline, t: np.ndarray, other: Polyline) -> tuple[np.ndarray, np.ndarray]:
    """Return at which stations of a line another one is parallel, (n,) bool, and its chainages there, (n,)."""
    place, normal = line.at(t), line.left_at(t)
    near, feet, _ = parallel(place, normal, other)
    for _ in range(FOOT_ROUNDS):
        left = other.left_at(feet)
        feet = feet + cross(place - other.at(feet), left)
    return near & (np.abs(cross(normal, left)) < TURNED), feet


def _interpolation(t: np.ndarray, stations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return weights and numbers, (n, 4) each, of the stations between which a cubic is drawn at chainages, (n,)."""
    count = min(4, len(stations))
    at = (t - stations[0]) / STATION_M
    low = np.clip(np.floor(at).astype(np.int64) - 1, 0, len(stations) - count)
    nodes = np.arange(count)
    step = (at - low)[:, None] - nodes
    weights = [np.prod([step[:, k] / (j - k) for k in nodes if k != j] or [np.ones(len(t))], axis=0) for j in nodes]
    return np.column_stack(weights), low[:, None] + nodes
