"""Smooth lines, height profiles and networks by PAEK: polynomial approximation with an exponential kernel.

At a station s of a piecewise linear P(t), the quadratic a + b u + e u² is fitted to P(s + u) under the weight
exp(-|u| / sigma); a is the smoothed position. The moments of each segment are integrated exactly, and the moments of
two adjacent sections combine into those of both. This operation is associative, so doubling scans yield the moments at
all vertices at once. Idea: Bodansky, Gribov and Pilouk, "Smoothing and compression of lines obtained by
raster-to-vector conversion", 2002. Formulas, and what it keeps and loses: docs/method.md section 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np
from scipy.special import factorial, gammainc

from ..polyline import Polyline, length_along
from ..progress import SILENT, Progress
from .network import LineNetwork

REACH_SIGMAS = 30.0
"""Reach of the kernel: beyond, it weighs less than 1e-11."""

VARIANCE_FACTOR = 0.33375
"""Variance of the result for independent points with a variance of 1, in units of spacing / sigma: the integral of the
squared equivalent kernel (docs/method.md section 5.2)."""

END_SHIFT = 0.26
"""Displacement of a line at a fixed end in an arc of radius R, in units of sigma² / R (docs/method.md section 5.3);
half as much where an arc follows a straight."""

_MOMENTS = 5
"""Moments of the kernel itself, orders 0 to 4; those of the line are needed up to order 2 only."""

_MIN_LENGTH_SIGMAS = 1e-2
"""On shorter pieces the quadratic is ill-conditioned; they are replaced by their mean."""


def local_fit(t: np.ndarray, values: np.ndarray, stations: np.ndarray, sigma: float) -> np.ndarray:
    """Fit a quadratic around each station, (m,) within t[0] and t[-1], and evaluate it there: (m, d).

    `values`, (n, d), are linear between the positions `t`, which increase; of equal ones only one counts, and nothing
    is assumed beyond the ends. `sigma` is the length of the kernel exp(-|u| / sigma), in the unit of t.
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
    ends. Given and returned are positions along the line, (n,) from 0, and vertices, (n, d).
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

    Given are the powers of the distances `by`, from 0, and `decay` = exp(-by), (n,) each.
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


STATIONS_PER_SIGMA = 4
"""A smoothed line has no detail shorter than sigma; stations a quarter of it apart show its shape."""

PROFILE_SIGMA_M = 1.0
"""Sigma for the heights of strips, and for gauge, cant and heights of a track: a twist over 3 m keeps nearly its full
size."""

GAP_SIGMAS = 3.0
"""A profile is not smoothed across a gap between its points that is longer than this many sigma."""

SAME_STATION_M = 1e-6
"""Points of a profile closer together along the line than this are averaged."""


def smooth_line(
    vertices: np.ndarray,
    sigma_m: float,
    stations: np.ndarray | None = None,
    ends: str = "fixed",
    closed: bool = False,
) -> np.ndarray:
    """Smooth a polyline along its own length.

    Parameters
    ----------
    vertices : (n, d) array
        Metres; the first vertex of a closed line is repeated as its last.
    sigma_m : float
        Length of the kernel. Waves of 4.9 sigma are halved; a circle of radius R shrinks by 1.8 sigma⁴ / R³.
    stations : (m,) array, optional
        Distances along the given polyline at which to evaluate. Default: its vertices, and stations between them so
        that no two are more than a quarter of sigma apart.
    ends : {"fixed", "free"}
        Fixed ends stay in place and have no curvature; free ends are fitted from the inside.
    closed : bool
        Whether the line is smoothed across its seam; `ends` is ignored then.

    Returns
    -------
    (m, d) array
    """
    vertices = np.asarray(vertices, dtype=float)
    t = length_along(vertices)
    if stations is None:
        stations = filled(t, sigma_m / STATIONS_PER_SIGMA)
    if closed:
        t, vertices = repeated(t, vertices, t[-1], sigma_m)
    elif ends == "fixed":
        t, vertices = repeated(*reflected(t, vertices), t[-1], sigma_m)
    return local_fit(t, vertices, stations, sigma_m)


def smooth_profile(t: np.ndarray, z: np.ndarray, sigma_m: float, stations: np.ndarray) -> np.ndarray:
    """Smooth heights over the distance along a line; points weigh by the distance between them, not by their number.

    Points are given by distance and height, (n,), in any order, and the heights at `stations`, (m,), are returned. The
    ends are free. Where points are more than `GAP_SIGMAS` sigma apart, each side is smoothed on its own and the profile
    is straight in between. Beyond its ends it keeps the last height.
    """
    t, z = _averaged(np.asarray(t, dtype=float), np.asarray(z, dtype=float))
    stations = np.asarray(stations, dtype=float)
    breaks = np.flatnonzero(np.diff(t) > GAP_SIGMAS * sigma_m) + 1
    known_t, known_z = [], []
    for piece_t, piece_z in zip(np.split(t, breaks), np.split(z, breaks)):
        inside = stations[(stations > piece_t[0]) & (stations < piece_t[-1])]
        known_t.append(np.unique(np.concatenate([piece_t[[0, -1]], inside])))
        known_z.append(local_fit(piece_t, piece_z[:, None], known_t[-1], sigma_m)[:, 0])
    return np.interp(stations, np.concatenate(known_t), np.concatenate(known_z))


def _averaged(t: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sort points by t and average those at the same place."""
    order = np.argsort(t, kind="stable")
    t, z = t[order], z[order]
    group = np.cumsum(np.concatenate([[0], np.diff(t) > SAME_STATION_M]))
    count = np.bincount(group)
    return np.bincount(group, t) / count, np.bincount(group, z) / count


NETWORK_STATIONS_PER_SIGMA = 8
"""Lines of a network are evaluated at even stations only. At 0.1 m, for sigma 0.8 m, a bend of 25 m radius deviates by
0.05 mm."""


def smooth_network(network: LineNetwork, sigma_m: float, progress: Progress = SILENT) -> LineNetwork:
    """Smooth all lines of a network; lines that meet in a node still meet in it, and free ends stay in place.

    Each line is smoothed on its own, with fixed ends. A node moves to the mean of the places that the lines passing it
    give it, and each line is bent to its moved nodes by a correction that fades within a few sigma, the length of the
    kernel of PAEK. The lines have a vertex at each pass, and vertices at most an eighth of sigma apart.
    """
    along = [Polyline(line).t for line in network.lines]
    anchor_line = np.concatenate([np.arange(2 * len(along)) // 2, network.passes[:, 1]])
    anchor_node = np.concatenate([network.ends.ravel(), network.passes[:, 0]])
    anchor_station = np.array(
        [t for line in along for t in line[[0, -1]]] + [along[i][v] for _, i, v in network.passes]
    )
    anchors_of = [np.flatnonzero(anchor_line == number) for number in range(len(along))]
    closed = (network.ends[:, 0] == network.ends[:, 1]) & (network.degrees()[network.ends[:, 0]] == 2)

    stations: list[np.ndarray] = []
    lines: list[np.ndarray] = []
    places = np.empty(len(anchor_line), dtype=np.int64)
    for number, own in enumerate(progress.follow(anchors_of)):
        even = filled(along[number][[0, -1]], sigma_m / NETWORK_STATIONS_PER_SIGMA)
        stations.append(np.union1d(even, anchor_station[own]))
        places[own] = np.searchsorted(stations[-1], anchor_station[own])
        lines.append(smooth_line(network.lines[number], sigma_m, stations[-1], closed=bool(closed[number])))
    proposed = np.array([lines[i][place] for i, place in zip(anchor_line, places)]).reshape(-1, 2)
    deciding = np.concatenate([np.repeat(closed, 2), np.ones(len(network.passes), dtype=bool)])
    moved, mover = np.unique(anchor_node[deciding], return_inverse=True)
    sums = [np.bincount(mover, axis, len(moved)) for axis in proposed[deciding].T]
    nodes = network.nodes.copy()
    nodes[moved] = np.column_stack(sums) / np.bincount(mover, minlength=len(moved))[:, None]
    for line, t, own in zip(lines, stations, anchors_of):
        bend_through(line, t / sigma_m, places[own], nodes[anchor_node[own]])
    passes = network.passes.copy()
    passes[:, 2] = places[2 * len(along) :]
    return LineNetwork(tuple(lines), nodes, network.ends, passes)


def bend_through(line: np.ndarray, t: np.ndarray, places: np.ndarray, targets: np.ndarray) -> None:
    """Bend a line, (n, 2), in place, so that its vertices `places` are at their targets, (k, 2).

    The correction fades along the line; `t` is the chainage of its vertices in sigma. Vertices further apart than the
    reach of the correction form separate systems of equations, so that time and memory grow linearly with the length.
    """
    order = np.argsort(places, kind="stable")
    places, targets = places[order], targets[order]
    apart = np.flatnonzero(np.diff(t[places]) > REACH_SIGMAS) + 1
    for own, own_targets in zip(np.split(places, apart), np.split(targets, apart)):
        first, last = np.searchsorted(t, t[own[[0, -1]]] + [-REACH_SIGMAS, REACH_SIGMAS])
        weights = np.linalg.lstsq(_fading(t[own][:, None] - t[own]), own_targets - line[own], rcond=1e-9)[0]
        line[first:last] += _fading(t[first:last, None] - t[own]) @ weights
    line[places] = targets


def _fading(distance: np.ndarray) -> np.ndarray:
    """Weigh a correction at a distance in sigma: 1 and level at 0."""
    distance = np.abs(distance)
    return (1 + distance) * np.exp(-distance)
