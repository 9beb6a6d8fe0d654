"""Where a branch touches its stock rail: told from how it parts from it, once points have led both to their heads.

The raster shows two rails apart from where their heads are a cell apart; the points show both outer edges from where
the heads lie side by side. What lies before that is the end of the arc on which they part.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..lines.polyline import interpolate, left_normals, project
from ..rails import length_along
from ..vectorize.ends import turned
from ..vectorize.network import LineNetwork

PARTED_HEADS = 3.0
"""Distance of the axes, in head widths, up to which the way they part tells where they touch."""

LEAST_STRETCH_M = 1.5
"""Shortest stretch from which that is told: an eighth of what the flattest switch takes for a head's width."""

FARTHEST_M = 25.0
"""No branch touches its stock rail this far before the heads lie apart."""

STEP_M = 0.1
"""Spacing of the vertices that a branch is given before it."""


def slide_branches(network: LineNetwork, head_width_m: float, sure_m: float) -> LineNetwork:
    """Let each branch begin where it touches the rail that it leaves, tangentially.

    Axes that part on arcs lie apart by the square of the way from there, so that the square root of their distance is
    a straight line over it. Branches that part in any other way stay as they are.

    Parameters
    ----------
    network : LineNetwork
    head_width_m : float
    sure_m : float
        Distance of the axes from which both lines can be trusted.
    """
    between_m = sure_m, PARTED_HEADS * head_width_m
    for number, node in enumerate(network.passes[:, 0].tolist()):
        for end in np.flatnonzero(network.ends.ravel() == node).tolist():
            _, stock, vertex = network.passes[number].tolist()
            if end // 2 != stock:
                network = _slide(network, end, stock, vertex, between_m)
    return network.select(np.ones(len(network.lines), dtype=bool))


def _slide(network: LineNetwork, end: int, stock: int, vertex: int, between_m: tuple[float, float]) -> LineNetwork:
    """Move one line's end along the line that runs through its node."""
    own = end // 2
    branch, line = turned(network.lines[own], end), network.lines[stock]
    along = length_along(line)
    feet = project([line], branch, FARTHEST_M / 10)
    feet = feet[np.argsort(feet.point)]
    if len(feet.t) < 2:
        return network
    sense = 1.0 if feet.t[-1] > along[vertex] else -1.0
    way, apart = sense * (feet.t - along[vertex]), np.abs(feet.across)
    touch, first = _touch(way, apart, *between_m)
    if touch is None:
        return network
    start = int(np.argmin(np.abs(along - along[vertex] - sense * touch)))
    if not 0 < start < len(line) - 1:
        return network
    touch = sense * (along[start] - along[vertex])
    left = np.sign(feet.across[first])
    new = _arc(line, along[vertex] + sense * touch, along[vertex] + sense * way[first], left * apart[first])
    kept = feet.point[first]
    return _with_start(network, end, (stock, start), np.concatenate([line[[start]], new]), kept)


def _touch(way: np.ndarray, apart: np.ndarray, least_m: float, most_m: float) -> tuple[float | None, int]:
    """Find where two lines touched, and the first place at which they are `least_m` apart for good."""
    beyond = np.flatnonzero(apart > most_m)
    last = beyond[0] if len(beyond) else len(apart)
    below = np.flatnonzero(apart[:last] < least_m)
    first = below[-1] + 1 if len(below) else 0
    if first + 2 > last or way[last - 1] - way[first] < LEAST_STRETCH_M:
        return None, first
    slope, root = np.polyfit(way[first:last], np.sqrt(apart[first:last]), 1)
    if slope <= 0 or -root / slope < way[first] - FARTHEST_M or -root / slope >= way[first]:
        return None, first
    return float(-root / slope), first


def _arc(line: np.ndarray, touch: float, first: float, across: float) -> np.ndarray:
    """Places between chainages `touch` and `first` of a line, `across` to its left at the latter; neither included."""
    share = np.linspace(0, 1, max(int(abs(first - touch) / STEP_M), 1) + 1)[1:-1]
    along, at = length_along(line), touch + share * (first - touch)
    return interpolate(line, along, at) + (across * share**2)[:, None] * interpolate(left_normals(line), along, at)


def _with_start(network: LineNetwork, end: int, at: tuple[int, int], start: np.ndarray, kept: int) -> LineNetwork:
    """Let a line end in a vertex of another one, its first `kept` vertices from this end replaced by `start`."""
    own, passes = end // 2, network.passes.copy()
    old = turned(network.lines[own], end)
    mine = passes[:, 1] == own
    from_end = np.where(mine, len(old) - 1 - passes[:, 2] if end % 2 else passes[:, 2], kept)
    if (from_end < kept).any():
        return network
    if end % 2 == 0:
        passes[mine, 2] += len(start) - kept
    lines, ends = list(network.lines), network.ends.copy()
    lines[own] = turned(np.concatenate([start, old[kept:]]), end)
    ends.flat[end] = len(network.nodes)
    nodes = np.concatenate([network.nodes, network.lines[at[0]][[at[1]]]])
    passes = np.concatenate([passes, [[len(nodes) - 1, *at]]])
    return replace(network, lines=tuple(lines), nodes=nodes, ends=ends, passes=passes)
