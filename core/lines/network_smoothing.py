"""Smooth lines that meet in nodes so that they still meet (docs/method.md section 5.6)."""

from __future__ import annotations

import numpy as np

from ..polyline import length_along
from ..progress import SILENT, Progress
from .network import LineNetwork
from .paek import REACH_SIGMAS, filled
from .smoothing import smooth_line

NETWORK_STATIONS_PER_SIGMA = 8
"""Lines of a network are evaluated at even stations only. At 0.1 m, for sigma 0.8 m, a bend of 25 m radius deviates by
0.05 mm."""


def smooth_network(network: LineNetwork, sigma_m: float, progress: Progress = SILENT) -> LineNetwork:
    """Smooth all lines of a network; lines that meet in a node still meet in it, and free ends stay in place.

    Each line is smoothed on its own, with fixed ends. A node moves to the mean of the places that the lines passing it
    give it, and each line is bent to its moved nodes by a correction that fades within a few sigma.

    Parameters
    ----------
    network : LineNetwork
    sigma_m : float
        Length of the kernel of PAEK.
    progress : Progress

    Returns
    -------
    LineNetwork
        Lines with a vertex at each pass, and vertices at most an eighth of sigma apart.
    """
    along = [length_along(line) for line in network.lines]
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
    """Bend a line, in place, so that some of its vertices are at their targets; the correction fades along the line.

    Vertices further apart than the reach of the correction form separate systems of equations, so that time and memory
    grow linearly with the length of a line.

    Parameters
    ----------
    line : (n, 2) array
        Changed in place.
    t : (n,) array
        Chainage of its vertices in sigma, not decreasing.
    places : (k,) int array
        Vertices to move.
    targets : (k, 2) array
        Where to.
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
