"""First partition of a signal into pieces of polynomials, by dynamic programming over the ends of the pieces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..progress import SILENT, Progress

BLOCK_M = 4.0
"""Distance between the places where a piece may begin, metres: the search moves the ends afterwards."""

SCALE_M = 300.0
"""Unit of length inside, metres, so that powers of the distance are neither tiny nor huge."""

PIECE_PENALTY, DEGREE_PENALTY = 1.0, 0.5
"""Cost of a piece, and of each degree, in units of the logarithm of the number of points: half of the information
criterion on purpose, because it is easier for the search to unite pieces than to find a missing one."""

KEPT_M = 60.0
"""A start nearer than this is never dropped, metres: too few points say anything about its piece."""

LONGEST_M = 1500.0
"""Starts farther behind are dropped, metres; the search unites the pieces of a longer element."""


@dataclass(frozen=True)
class Piece:
    """A piece of the signal.

    Attributes
    ----------
    start, end : float
        Distances, metres.
    degree : int
        Of its polynomial.
    """

    start: float
    end: float
    degree: int


def partition(
    s: np.ndarray,
    y: np.ndarray,
    sigma: float,
    degrees: Sequence[int],
    ends: tuple[float, float],
    progress: Progress = SILENT,
) -> list[Piece]:
    """Divide a signal into polynomials.

    Parameters
    ----------
    s, y : (n,) array
        Distance and signal, metres.
    sigma : float
        Standard deviation of the signal's errors, metres.
    degrees : sequence of int
        Degrees that a piece may have, each one more than the one before.
    ends : (float, float)
        Start of the first and end of the last piece.
    progress : Progress
    """
    count = max(int(round((ends[1] - ends[0]) / BLOCK_M)), 1)
    bounds = np.linspace(*ends, count + 1)
    firsts = np.searchsorted(s, bounds)
    firsts[-1] = len(s)
    log_n = math.log(max(len(s), 2))
    costs = [(PIECE_PENALTY + DEGREE_PENALTY * degree) * log_n for degree in degrees]
    best, came = np.full(count + 1, np.inf), np.zeros((count + 1, 2), dtype=int)
    best[0] = 0.0
    starts, factors = np.zeros(0, dtype=int), np.zeros((0, degrees[-1] + 1, degrees[-1] + 2))
    rest = np.zeros(0)
    for block in progress.follow(range(count)):
        starts = np.append(starts, block)
        factors = np.concatenate([factors, np.zeros((1, *factors.shape[1:]))])
        rest = np.append(rest, 0.0)
        origin = s[np.minimum(firsts[starts], len(s) - 2)], y[np.minimum(firsts[starts], len(s) - 2)]
        for k in range(firsts[block], firsts[block + 1]):
            _take(factors, rest, (s[k] - origin[0]) / SCALE_M, (y[k] - origin[1]) / sigma)
        rss = _nested(factors, rest, degrees)
        total = best[starts, None] + rss + costs
        at, which = np.unravel_index(np.argmin(total), total.shape)
        best[block + 1], came[block + 1] = total[at, which], (starts[at], which)
        behind = bounds[block + 1] - bounds[starts]
        hopeless = best[starts] + rss[:, -1] + costs[0] > best[block + 1] + costs[-1]
        kept = ((behind < KEPT_M) | ~hopeless) & (behind < LONGEST_M)
        starts, factors, rest = starts[kept], factors[kept], rest[kept]
    return _traced(came, bounds, degrees)


def _take(factors: np.ndarray, rest: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    """Add a point to the triangular factors of all starts, by Givens rotations.

    Sums of powers would cancel: y reaches 10 km, and its errors are millimetres.
    """
    size = factors.shape[1]
    row = np.empty((len(x), size + 1))
    row[:, :size] = np.vander(x, size, increasing=True)
    row[:, size] = y
    for i in range(size):
        radius = np.hypot(factors[:, i, i], row[:, i])
        safe = np.where(radius > 0, radius, 1.0)
        cos, sin = np.where(radius > 0, factors[:, i, i], 1.0) / safe, row[:, i] / safe
        upper, lower = factors[:, i, i:].copy(), row[:, i:]
        factors[:, i, i:] = cos[:, None] * upper + sin[:, None] * lower
        row[:, i:] = cos[:, None] * lower - sin[:, None] * upper
    rest += row[:, size] ** 2


def _nested(factors: np.ndarray, rest: np.ndarray, degrees: Sequence[int]) -> np.ndarray:
    """Return the sums of squared residuals of each start, one column per degree."""
    last = factors[:, :, -1] ** 2
    return np.column_stack([rest + last[:, degree + 1 :].sum(axis=1) for degree in degrees])


def _traced(came: np.ndarray, ends: np.ndarray, degrees: Sequence[int]) -> list[Piece]:
    """Return the pieces of the cheapest partition, from the start."""
    pieces, block = [], len(ends) - 1
    while block > 0:
        start, which = came[block]
        pieces.append(Piece(float(ends[start]), float(ends[block]), degrees[which]))
        block = start
    return pieces[::-1]
