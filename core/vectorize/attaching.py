"""A rail that ends beside another one and bends towards it branches off it; one that only runs along it is a guard."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from ..rails import length_along
from .branches import FARTHEST_M, STEADY_M, parting, sharpest
from .bridges import FIT_M, STAIRS_M, bridge, curvature
from .ends import cut_back, stretch, turned, way_out
from .joining import unseen_m
from .junctions import DIRECTION_M
from .network import LineNetwork

BESIDE_M = 1.0
"""A branch that is no nearer to its stock rail is not led back to it: nothing of the switch was seen."""

SLOPE_M = 4.0
"""Stretch of the stock rail whose direction is compared with the branch's."""

GUARD_APART_M = 0.13
"""Farthest that a guard or wing rail's axis lies beside a running rail's: a head, and a flangeway of 50 mm."""

GUARD_M = 8.0
"""Longer lines so near another are no guards, but two rails of a very flat switch."""


def attach_branches(network: LineNetwork, seen: cKDTree, max_gap_m: float) -> LineNetwork:
    """Lead free ends back to the rails that they branch off, by curves that both lines explain.

    A branch that leaves on an arc and is y beside its stock rail, at an angle to it, touched it 2 y / angle before.

    Parameters
    ----------
    network : LineNetwork
    seen : cKDTree
        Places of rail cells.
    max_gap_m : float
        The curve may run no further than this where there are none.
    """
    lines, nodes, ends, passes = list(network.lines), list(network.nodes), network.ends.copy(), network.passes.tolist()
    for end in np.flatnonzero(network.degrees()[network.ends.ravel()] == 1).tolist():
        own = end // 2
        from_end = turned(lines[own], end)
        if length_along(from_end)[-1] < FIT_M:
            continue
        best = None
        for stock, vertex, onward in _touching(from_end, lines, own):
            found = bridge(from_end, onward)
            if found is None or unseen_m(found.points, seen) > max_gap_m:
                continue
            if best is None or found.cost < best[0].cost:
                sense = 1 if (onward[1] == lines[stock][vertex + 1]).all() else -1
                best = found, stock, vertex + sense * int(np.searchsorted(length_along(onward), found.cuts_m[1]))
        if best is None:
            continue
        found, stock, vertex = best
        first = len(lines[own])
        free = cut_back(from_end, found.cuts_m[0])
        lines[own] = turned(np.concatenate([lines[stock][[vertex]], found.points[::-1], free]), end)
        if end % 2 == 0:
            passes = [[n, i, v + (len(lines[own]) - first) * (i == own)] for n, i, v in passes]
        ends.flat[end] = len(nodes)
        nodes.append(lines[stock][vertex])
        passes.append([ends.flat[end], stock, vertex])
    return LineNetwork(
        tuple(lines), np.array(nodes).reshape(-1, 2), ends, np.array(passes, dtype=np.int64).reshape(-1, 3)
    ).select(np.ones(len(lines), dtype=bool))


def _touching(from_end: np.ndarray, lines: list[np.ndarray], own: int) -> Iterator[tuple[int, int, np.ndarray]]:
    """List the lines that a line may branch off: number, vertex where they would touch, and the way on from there."""
    tip, outward = way_out(stretch(from_end, DIRECTION_M))
    axes = np.array([outward, [-outward[1], outward[0]]])
    own_stretch = stretch(from_end, STEADY_M)
    allowed = sharpest(curvature(own_stretch))
    for number, line in enumerate(lines):
        x, y = axes @ (line - tip).T
        near = (x > -STEADY_M) & (x < FARTHEST_M + SLOPE_M) & (np.abs(y) < BESIDE_M)
        if number == own or np.count_nonzero(near) < 2:
            continue
        first, last = np.flatnonzero(near)[[0, -1]]
        way = line[first : last + 1] if x[last] > x[first] else line[first : last + 1][::-1]
        x, y = axes @ (way - tip).T
        if x[0] > 0 or x[-1] < SLOPE_M or (np.diff(x) <= 0).any():
            continue
        own_x, own_y = axes @ (own_stretch - tip).T
        beside = own_x >= x[0]
        apart = np.interp(own_x, x, y) - own_y
        if np.count_nonzero(beside) < 2 or len(set(np.sign(apart[beside]))) > 1:
            continue
        touch_m, bend = parting(-own_x[beside], np.abs(apart[beside]))
        if bend > allowed or not 0 < touch_m < FARTHEST_M:
            continue
        vertex = int(np.argmin(np.abs(axes[0] @ (line - tip).T - touch_m) + 1e9 * ~near))
        if not 0 < vertex < len(line) - 1:
            continue
        along = axes[0] @ (line[vertex + 1] - line[vertex])
        onward = line[vertex:] if along > 0 else line[vertex::-1]
        if length_along(onward)[-1] >= DIRECTION_M:
            yield number, vertex, onward


def drop_guards(network: LineNetwork, head_width_m: float) -> LineNetwork:
    """Remove short lines that lie beside a longer one over their whole length: guard and wing rails, and doubles."""
    lengths = network.lengths()
    keep = np.ones(len(lengths), dtype=bool)
    reach_m = GUARD_APART_M + STAIRS_M
    dense = [stretch(line, np.inf) for line in network.lines]
    for number in np.flatnonzero(lengths < GUARD_M).tolist():
        low, high = dense[number].min(axis=0) - reach_m, dense[number].max(axis=0) + reach_m
        for other, line in enumerate(dense):
            inside = line[((line > low) & (line < high)).all(axis=1)]
            if lengths[other] > lengths[number] and keep[other] and len(inside):
                keep[number] &= cKDTree(inside).query(dense[number])[0].max() > reach_m
    return network if keep.all() else network.select(keep)
