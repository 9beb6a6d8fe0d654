"""Smooth lines that meet in nodes so that they still meet (docs/method.md section 5.6)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..polyline import length_along
from ..progress import SILENT, Progress
from .ends import even_points, tip_and_direction
from .network import LineNetwork
from .paek import REACH_SIGMAS, filled, local_fit, reflected, repeated

NETWORK_STATIONS_PER_SIGMA = 8
"""Lines of a network are evaluated at even stations only. At 0.1 m, for sigma 0.8 m, a bend of 25 m radius deviates by
0.05 mm."""

CONTINUATION_DEG = 20.0
"""At a node, a line is smoothed as if it continued into the line that turns least, if that turns by less than this."""

DIRECTION_SIGMAS = 2.5
"""Length over which the direction of a line end is measured: about that of its stairs."""

Way = tuple[int, int, int]
"""A way along a line: line number, vertex at which it begins, and 1 or -1 for its direction."""


def smooth_network(network: LineNetwork, sigma_m: float, progress: Progress = SILENT) -> LineNetwork:
    """Smooth all lines of a network; lines that meet in a node still meet in it, and free ends stay in place.

    A line that ends in a node is smoothed as if it continued into its straightest continuation. The node moves to the
    mean of the positions that the lines passing it give it; without those, of the positions that the ending lines with
    a continuation give it. Each line is bent to its moved nodes by a correction that fades within a few sigma.

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
    onward = _continuations(network, DIRECTION_SIGMAS * sigma_m)
    along = [length_along(line) for line in network.lines]
    anchor_line = np.concatenate([np.arange(2 * len(along)) // 2, network.passes[:, 1]])
    anchor_node = np.concatenate([network.ends.ravel(), network.passes[:, 0]])
    anchor_station = np.array(
        [t for line in along for t in line[[0, -1]]] + [along[i][v] for _, i, v in network.passes]
    )
    anchor_rank = np.array([end in onward for end in range(2 * len(along))] + [2] * len(network.passes), dtype=int)
    anchors_of = [np.flatnonzero(anchor_line == number) for number in range(len(along))]

    stations: list[np.ndarray] = []
    lines: list[np.ndarray] = []
    places = np.empty(len(anchor_line), dtype=np.int64)
    for number, own in enumerate(progress.follow(anchors_of)):
        even = filled(along[number][[0, -1]], sigma_m / NETWORK_STATIONS_PER_SIGMA)
        stations.append(np.union1d(even, anchor_station[own]))
        places[own] = np.searchsorted(stations[-1], anchor_station[own])
        lines.append(local_fit(*_extended(network, number, onward, sigma_m), stations[-1], sigma_m))
    proposed = np.array([lines[i][place] for i, place in zip(anchor_line, places)]).reshape(-1, 2)
    nodes = _moved_nodes(network.nodes, anchor_node, anchor_rank, proposed)
    for line, t, own in zip(lines, stations, anchors_of):
        bend_through(line, t / sigma_m, places[own], nodes[anchor_node[own]])
    passes = network.passes.copy()
    passes[:, 2] = places[2 * len(along) :]
    return LineNetwork(tuple(lines), nodes, network.ends, passes)


def _continuations(network: LineNetwork, length_m: float) -> dict[int, Way]:
    """Find the way on which each line end continues; ends without a continuation are left out."""
    leaving: dict[int, list[Way]] = {}
    for end, node in enumerate(network.ends.ravel().tolist()):
        last = len(network.lines[end // 2]) - 1
        leaving.setdefault(node, []).append((end // 2, last, -1) if end % 2 else (end // 2, 0, 1))
    for node, line, vertex in network.passes.tolist():
        leaving.setdefault(node, []).extend([(line, vertex, 1), (line, vertex, -1)])
    onward = {}
    for ways in leaving.values():
        if len(ways) == 1:
            continue
        inward = -np.array([tip_and_direction(even_points(_vertices(network, way), length_m))[1] for way in ways])
        turn = np.degrees(np.arccos(np.clip(-inward @ inward.T, -1, 1)))
        for number, (line, vertex, sense) in enumerate(ways):
            best = int(turn[number].argmin())
            if turn[number, best] < CONTINUATION_DEG and vertex in (0, len(network.lines[line]) - 1):
                onward[2 * line + (sense < 0)] = ways[best]
    return onward


def _vertices(network: LineNetwork, way: Way) -> np.ndarray:
    line, vertex, sense = way
    return network.lines[line][vertex::sense]


def _extended(
    network: LineNetwork, number: int, onward: Mapping[int, Way], sigma_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Extend a line at both ends by its continuation there or by its reflection; t is 0 at its own start."""
    line = network.lines[number]
    before, after = (_beyond(network, end, onward, REACH_SIGMAS * sigma_m) for end in (2 * number, 2 * number + 1))
    if len(before) == len(after) == 0:
        t = length_along(line)
        return repeated(*reflected(t, line), t[-1], sigma_m)
    whole = np.concatenate([before[::-1], line, after])
    t = length_along(whole)
    own_start = t[len(before)]
    if len(before) == 0:
        turned_t, turned = reflected(-t[::-1], whole[::-1])
        t, whole = -turned_t[::-1], turned[::-1]
    elif len(after) == 0:
        t, whole = reflected(t, whole)
    return t - own_start, whole


def _beyond(network: LineNetwork, end: int, onward: Mapping[int, Way], reach_m: float) -> np.ndarray:
    """Return the vertices beyond a line end on its continuations, from the end outward, up to `reach_m`; (n, 2)."""
    points, length = [np.empty((0, 2))], 0.0
    while end in onward and length < reach_m:
        way = onward[end]
        vertices = _vertices(network, way)
        t = length_along(vertices)
        points.append(vertices[1:][t[:-1] < reach_m - length])
        length += t[-1]
        end = 2 * way[0] + (way[2] > 0)
    return np.concatenate(points)


def _moved_nodes(nodes: np.ndarray, anchor_node: np.ndarray, rank: np.ndarray, proposed: np.ndarray) -> np.ndarray:
    """Average the proposals of the anchors of highest rank at each node; nodes with anchors of rank 0 only stay."""
    top = np.zeros(len(nodes), dtype=int)
    np.maximum.at(top, anchor_node, rank)
    counts = (rank > 0) & (rank == top[anchor_node])
    votes = np.bincount(anchor_node[counts], minlength=len(nodes))
    moved = nodes.copy()
    for axis in range(2):
        total = np.bincount(anchor_node[counts], proposed[counts, axis], minlength=len(nodes))
        moved[votes > 0, axis] = total[votes > 0] / votes[votes > 0]
    return moved


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
