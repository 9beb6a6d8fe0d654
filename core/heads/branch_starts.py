"""Where a branch touches its stock rail: told from how it parts from it, once points have led both to their heads.

The raster shows two rails apart from where their heads are a cell apart; the points show both outer edges from where
the heads lie side by side. What lies before that is the end of the arc on which they part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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

SWITCH_M = 2.5
"""Nodes so near belong to the two blades of one switch: the widest gauge, and where blades begin a metre apart."""

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
    starts = [
        (number, end)
        for number, (node, stock, _) in enumerate(network.passes.tolist())
        for end in np.flatnonzero(network.ends.ravel() == node).tolist()
        if end // 2 != stock
    ]
    partings = [_parting(network, end, number, between_m) for number, end in starts]
    for (number, end), parting in zip(starts, partings):
        if parting is not None:
            of_switch = [other for other in partings if other is not None and other.near(parting)]
            network = _slide(network, end, number, between_m, _power(of_switch))
    return network.tidy()


@dataclass(frozen=True)
class _Parting:
    """How a line parts from the one that runs through its node.

    Attributes
    ----------
    place : (2,) array
        The node.
    stock, sense : int, float
        Number of the other line, and the sense along it in which this one leaves.
    way, apart : (n,) arrays
        Way along the other line from the node, and distance of the axes, where they tell of it.
    left : float
        Side on which this one leaves.
    kept : int
        Vertex of this line, from its end, at the first of these places.
    """

    place: np.ndarray
    stock: int
    sense: float
    way: np.ndarray
    apart: np.ndarray
    left: float
    kept: int

    def near(self, other: _Parting) -> bool:
        """Tell whether both belong to one switch, whose two blades lie a gauge apart."""
        return bool(np.hypot(*(self.place - other.place)) < SWITCH_M)


def _parting(network: LineNetwork, end: int, number: int, between_m: tuple[float, float]) -> _Parting | None:
    """See how a line's end parts from the line of a pass; None where too little shows."""
    _, stock, vertex = network.passes[number].tolist()
    branch, line = turned(network.lines[end // 2], end), network.lines[stock]
    along = length_along(line)
    feet = project([line], branch, FARTHEST_M / 10)
    feet = feet[np.argsort(feet.point)]
    if len(feet.t) < 2:
        return None
    sense = 1.0 if feet.t[-1] > along[vertex] else -1.0
    way, apart = sense * (feet.t - along[vertex]), np.abs(feet.across)
    first, last = _telling(apart, *between_m)
    if first + 2 > last or way[last - 1] - way[first] < LEAST_STRETCH_M:
        return None
    left, kept = float(np.sign(feet.across[first])), int(feet.point[first])
    return _Parting(line[vertex], stock, sense, way[first:last], apart[first:last], left, kept)


def _slide(network: LineNetwork, end: int, number: int, between_m: tuple[float, float], power: int) -> LineNetwork:
    """Move one line's end along the line that runs through its node."""
    parting = _parting(network, end, number, between_m)
    if parting is None:
        return network
    blade = parting.apart <= HEEL_SPREAD_M if power == STRAIGHT else np.ones(len(parting.apart), dtype=bool)
    touch, _ = _root(parting.way[blade], parting.apart[blade], power)
    if not parting.way[0] - FARTHEST_M <= touch < parting.way[0]:
        return network
    line, vertex = network.lines[parting.stock], network.passes[number, 2]
    along = length_along(line)
    start = int(np.argmin(np.abs(along - along[vertex] - parting.sense * touch)))
    if not 0 < start < len(line) - 1:
        return network
    across = parting.left * parting.apart[0]
    new = _blade(line, along[start], along[vertex] + parting.sense * parting.way[0], across, power)
    return _with_start(network, end, (parting.stock, start), np.concatenate([line[[start]], new]), parting.kept)


def _telling(apart: np.ndarray, least_m: float, most_m: float) -> tuple[int, int]:
    """Find the stretch, first place and the one after the last, from `least_m` apart for good to `most_m` apart."""
    beyond = np.flatnonzero(apart > most_m)
    last = int(beyond[0]) if len(beyond) else len(apart)
    below = np.flatnonzero(apart[:last] < least_m)
    return int(below[-1]) + 1 if len(below) else 0, last


def _power(partings: Sequence[_Parting]) -> int:
    """Tell from the blades of one switch whether lines part by the way or by its square."""
    left_over = {STRAIGHT: 0.0, TANGENTIAL: 0.0}
    for parting in partings:
        blade = parting.apart <= HEEL_SPREAD_M
        if np.count_nonzero(blade) > 2:
            for power in left_over:
                left_over[power] += _root(parting.way[blade], parting.apart[blade], power)[1] ** 2
    return STRAIGHT if left_over[STRAIGHT] < CLEARLY**2 * left_over[TANGENTIAL] else TANGENTIAL


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
