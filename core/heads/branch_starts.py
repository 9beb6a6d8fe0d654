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

TANGENTIAL, STRAIGHT = 2, 1
"""Powers of the way by which lines part."""

HEEL_SPREAD_M = 0.15
"""Distance of the axes up to which a blade is straight: the heels of American switches lie 6 1/4 inches apart."""

CLEARLY = 0.5
"""A blade counts as straight where so much of what an arc leaves over is left over: most switches part on arcs."""

STEP_M = 0.1
"""Spacing of the vertices that a branch is given before it."""


def slide_branches(network: LineNetwork, head_width_m: float, sure_m: float) -> LineNetwork:
    """Let each branch begin where it touches the rail that it leaves.

    Axes that part on arcs lie apart by the square of the way from there, so that the square root of their distance is
    a straight line over it; beside a straight blade, as American switches have, their distance itself is one. The blade
    counts where it fits clearly better. Branches that part in any other way stay as they are.

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
    first, last = _parting(apart, *between_m)
    if first + 2 > last or way[last - 1] - way[first] < LEAST_STRETCH_M:
        return network
    touch, power = _touch(way[first:last], apart[first:last])
    if not way[first] - FARTHEST_M <= touch < way[first]:
        return network
    start = int(np.argmin(np.abs(along - along[vertex] - sense * touch)))
    if not 0 < start < len(line) - 1:
        return network
    touch = sense * (along[start] - along[vertex])
    left = np.sign(feet.across[first])
    new = _blade(line, along[vertex] + sense * touch, along[vertex] + sense * way[first], left * apart[first], power)
    kept = feet.point[first]
    return _with_start(network, end, (stock, start), np.concatenate([line[[start]], new]), kept)


def _parting(apart: np.ndarray, least_m: float, most_m: float) -> tuple[int, int]:
    """Find the stretch, first place and the one after the last, from `least_m` apart for good to `most_m` apart."""
    beyond = np.flatnonzero(apart > most_m)
    last = int(beyond[0]) if len(beyond) else len(apart)
    below = np.flatnonzero(apart[:last] < least_m)
    return int(below[-1]) + 1 if len(below) else 0, last


def _touch(way: np.ndarray, apart: np.ndarray) -> tuple[float, int]:
    """Find where two lines touched, and the power of the way from there by which they part: 2 on arcs, 1 on blades.

    Lines that do not part have no such place: NaN.
    """
    blade = apart <= HEEL_SPREAD_M
    if np.count_nonzero(blade) > 2:
        straight, off = _root(way[blade], apart[blade], STRAIGHT)
        if off < CLEARLY * _root(way[blade], apart[blade], TANGENTIAL)[1]:
            return straight, STRAIGHT
    return _root(way, apart, TANGENTIAL)[0], TANGENTIAL


def _root(way: np.ndarray, apart: np.ndarray, power: int) -> tuple[float, float]:
    """Fit a power of the way to the distance: where it begins, and the rms of what is left, metres."""
    slope, root = np.polyfit(way, apart ** (1 / power), 1)
    off = np.sqrt(np.mean((np.maximum(slope * way + root, 0.0) ** power - apart) ** 2))
    return (float(-root / slope), float(off)) if slope > 0 else (np.nan, np.inf)


def _blade(line: np.ndarray, touch: float, first: float, across: float, power: int) -> np.ndarray:
    """Places between chainages `touch` and `first` of a line, `across` to its left at the latter; neither included."""
    share = np.linspace(0, 1, max(int(abs(first - touch) / STEP_M), 1) + 1)[1:-1]
    along, at = length_along(line), touch + share * (first - touch)
    return interpolate(line, along, at) + (across * share**power)[:, None] * interpolate(left_normals(line), along, at)


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
