"""PAEK, polynomial approximation with an exponential kernel, in closed form along a polyline.

At a station s of a piecewise linear P(t), the quadratic a + b u + e u² is fitted to P(s + u) under the weight
exp(-|u| / sigma); a is the smoothed position. The moments of each segment are integrated exactly, and the moments of
two adjacent sections combine into those of both. This operation is associative, so doubling scans yield the moments at
all vertices at once. Idea: Bodansky, Gribov and Pilouk, "Smoothing and compression of lines obtained by
raster-to-vector conversion", 2002. Formulas: docs/method.md section 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np
from scipy.special import factorial, gammainc

REACH_SIGMAS = 30.0
"""Reach of the kernel: beyond, it weighs less than 1e-11."""

VARIANCE_FACTOR = 0.33375
"""Variance of the result for independent points with a variance of 1, in units of spacing / sigma: the integral of the
squared equivalent kernel (docs/method.md section 5.3)."""

END_SHIFT = 0.26
"""Displacement of a line at a fixed end in an arc of radius R, in units of sigma² / R (docs/method.md section 5.4);
half as much where an arc follows a straight."""

_MOMENTS = 5
"""Moments of the kernel itself, orders 0 to 4; those of the line are needed up to order 2 only."""

_MIN_LENGTH_SIGMAS = 1e-2
"""On shorter pieces the quadratic is ill-conditioned; they are replaced by their mean."""


def local_fit(t: np.ndarray, values: np.ndarray, stations: np.ndarray, sigma: float) -> np.ndarray:
    """Fit a quadratic around each station and evaluate it there.

    Parameters
    ----------
    t : (n,) array
        Position along the line, increasing; of equal positions only one counts.
    values : (n, d) array
        Linear between the positions; nothing is assumed beyond the ends.
    stations : (m,) array
        Within t[0] and t[-1], in any order.
    sigma : float
        Length of the kernel exp(-|u| / sigma), in the unit of t.

    Returns
    -------
    (m, d) array
    """
    centre = values.mean(axis=0)
    if len(t) < 2 or t[-1] - t[0] < _MIN_LENGTH_SIGMAS * sigma:
        return np.tile(centre, (len(stations), 1))
    t, stations = np.asarray(t) / sigma, np.asarray(stations) / sigma
    inserted = np.union1d(t, stations)
    line = np.column_stack([np.interp(inserted, t, column) for column in (values - centre).T])
    at_station = np.searchsorted(inserted, stations)
    left = [moments[at_station] for moments in _left_moments(inserted, line)]
    right = [moments[::-1][at_station] for moments in _left_moments(-inserted[::-1], line[::-1])]
    sign = (-1.0) ** np.arange(_MOMENTS)
    kernel = right[0][:, :, 0] + sign * left[0][:, :, 0]
    weighted = right[1] + sign[:3, None] * left[1]
    matrix = kernel[:, np.arange(3)[:, None] + np.arange(3)]
    return centre + np.linalg.solve(matrix, weighted)[:, 0, :]


def filled(t: np.ndarray, spacing: float) -> np.ndarray:
    """Insert even stations between those in `t`, (n,), so that no two are more than `spacing` apart."""
    parts = np.maximum(np.ceil(np.diff(t) / spacing - 1e-9), 1).astype(int)
    return np.interp(np.arange(parts.sum() + 1), np.concatenate([[0], np.cumsum(parts)]), t)


def reflected(t: np.ndarray, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Extend a line beyond its end by its point reflection about that end."""
    mirrored = 2 * vertices[-1] - vertices[-2::-1]
    return np.concatenate([t, 2 * t[-1] - t[-2::-1]]), np.concatenate([vertices, mirrored])


def repeated(t: np.ndarray, vertices: np.ndarray, end: float, sigma_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Chain copies of a line until they cover the reach of the kernel around the positions 0 to `end`.

    A closed line repeats in place. A line followed by its reflection repeats with a shift, which reflects it at both
    ends.

    Parameters
    ----------
    t : (n,) array
        Position along the line, from 0.
    vertices : (n, d) array
    end : float
        Position up to which stations are wanted.
    sigma_m : float

    Returns
    -------
    t : (m,) array
    vertices : (m, d) array
    """
    reach = REACH_SIGMAS * sigma_m
    period, shift = t[-1], vertices[-1] - vertices[0]
    if period == 0:
        return t, vertices
    copies = np.arange(-np.ceil(reach / period), np.ceil((end + reach) / period))
    long_t = np.append((copies[:, None] * period + t[:-1]).ravel(), (copies[-1] + 1) * period)
    moved = copies[:, None, None] * shift + vertices[:-1]
    long_line = np.concatenate([moved.reshape(-1, vertices.shape[1]), [(copies[-1] + 1) * shift + vertices[0]]])
    near = (long_t >= -reach) & (long_t <= end + reach)
    return long_t[near], long_line[near]


def _left_moments(t: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrate u^k exp(-u) over the distance u back from each vertex: alone, (n, 5, 1), and times P, (n, 3, d)."""
    steps = np.diff(t)
    ends, slopes = line[1:], np.diff(line, axis=0) / steps[:, None]
    orders = np.arange(_MOMENTS)
    integral = factorial(orders) * gammainc(orders + 1.0, steps[:, None])
    times_line = integral[:, :3, None] * ends[:, None, :] - integral[:, 1:4, None] * slopes[:, None, :]
    # With the vertices innermost, each operation reads memory in order.
    alone, times_line = _scan(steps, integral.T[:, None], times_line.transpose(1, 2, 0))
    return alone.transpose(2, 0, 1), times_line.transpose(2, 0, 1)


def _scan(steps: np.ndarray, *moments: np.ndarray) -> list[np.ndarray]:
    """Accumulate the moments of all segments before each vertex, each (k, d, n segments) to (k, d, n + 1).

    Each round doubles the section behind every vertex, until all sections exceed the reach of the kernel.
    """
    span = steps.copy()
    totals = [np.concatenate([np.zeros((*one.shape[:2], 1)), one], axis=2) for one in moments]
    offset = 1
    while offset < len(span) and span[offset:].min() < REACH_SIGMAS:
        powers = [np.ones(len(span) - offset)]
        for _ in range(_MOMENTS - 1):
            powers.append(powers[-1] * span[offset:])
        decay = np.exp(-span[offset:])
        for total in totals:
            total[..., 1 + offset :] += _shifted(total[..., 1:-offset], powers, decay)
        span[offset:] = span[offset:] + span[:-offset]
        offset *= 2
    return totals


def _shifted(moments: np.ndarray, powers: Sequence[np.ndarray], decay: np.ndarray) -> np.ndarray:
    """Convert moments, (k, d, n), to vertices further along: (u + by)^k exp(-by) by the binomial theorem.

    Parameters
    ----------
    moments : (k, d, n) array
    powers : sequence of (n,) arrays
        Powers of the distances `by`, from 0.
    decay : (n,) array
        exp(-by).
    """
    shifted = np.empty_like(moments)
    for order in range(len(moments)):
        total = shifted[order]
        np.multiply(powers[order], moments[0], out=total)
        for lower in range(1, order):
            total += comb(order, lower) * powers[order - lower] * moments[lower]
        if order:
            total += moments[order]
    shifted *= decay
    return shifted
