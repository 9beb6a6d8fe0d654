"""Where a branch touches its stock rail: told from how it parts from it, once points have led both to their heads.

The raster shows two rails apart from where their heads are a cell apart; the points show both outer edges from where
the heads lie side by side. What lies before that is the end of the arc on which they part, or of a straight blade:
points between the two tell which.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lines.ends import turned
from ..lines.network import LineNetwork
from ..lines.parting import ARC, STRAIGHT, PartingLaw, left_of
from ..polyline import length_along, project
from .level import on_top

APART_HEADS = 1.3
"""Distance of two axes, in head widths, from which the raster has a cell between the heads."""

PARTED_HEADS = 3.0
"""Distance of the axes, in head widths, up to which the way they part tells where they touch."""

LEAST_STRETCH_M = 1.5
"""Shortest stretch from which that is told: an eighth of what the flattest switch takes for a head's width."""

FARTHEST_M = 25.0
"""No branch touches its stock rail this far before the heads lie apart."""

HEEL_SPREAD_M = 0.15
"""Distance of the axes up to which a blade is straight: the heels of American switches lie 6 1/4 inches apart."""

SWITCH_M = 2.5
"""Nodes so near belong to the two blades of one switch: the widest gauge, and where blades begin a metre apart."""

EMPTY_SHARE = 0.4
"""Density of points between the edges of a straight blade and of an arc, over that on the head beside, below which no
head lies there: noise of a centimetre fills a quarter, and leaves three of a head that is there."""

LEAST_ON_HEAD = 20
"""Points on the head beside, without which the blade is taken for an arc, as most are."""

STEP_M = 0.1
"""Spacing of the vertices that a branch is given before it."""


def slide_branches(network: LineNetwork, xyz: np.ndarray, head_width_m: float, sure_m: float) -> LineNetwork:
    """Let each branch begin where it touches the rail that it leaves.

    Axes that part on arcs lie apart by the square of the way from there, so that the square root of their distance is
    a straight line over it; beside a straight blade, as American switches have, their distance itself is one. Both fit
    where the heads lie apart, but the arc begins metres before the blade: where no head shows beside the stock rail
    there, it is a blade. Branches that part in any other way stay as they are.

    Parameters
    ----------
    network : LineNetwork
    xyz : (k, 3) array
        Rail points by rising x.
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
    apart_m = APART_HEADS * head_width_m, between_m[1]
    partings = [_parting(network, end, number, apart_m) for number, end in starts]
    shown = [np.zeros(2) if one is None else _points_of_arc(network, one, xyz, head_width_m) for one in partings]
    places = [network.nodes[network.passes[number, 0]] for number, _ in starts]
    for (number, end), place in zip(starts, places):
        of_switch = [points for points, other in zip(shown, places) if np.hypot(*(other - place)) < SWITCH_M]
        network = _slide(network, end, number, between_m, _power(sum(of_switch)))
    return network.tidy()


@dataclass(frozen=True)
class _Parting:
    """How a line parts from the one that runs through its node.

    Attributes
    ----------
    node_m : float
        Chainage of the node on the other line.
    stock, sense : int, float
        Number of the other line, and the sense along it in which this one leaves.
    way, apart : (n,) arrays
        Way along the other line from the node, and distance of the axes, where they tell of it.
    left : float
        Side on which this one leaves.
    kept : int
        Vertex of this line, from its end, at the first of these places.
    """

    node_m: float
    stock: int
    sense: float
    way: np.ndarray
    apart: np.ndarray
    left: float
    kept: int

    def law(self, power: int) -> PartingLaw:
        """Fit a straight blade up to its heel, or an arc."""
        told = self.apart <= HEEL_SPREAD_M
        if power == ARC or np.count_nonzero(told) < 3:  # the widest heads hide the heel
            told[:] = True
        return PartingLaw.fitted(self.way[told], self.apart[told], power)


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
    return _Parting(float(along[vertex]), stock, sense, way[first:last], apart[first:last], left, kept)


def _slide(network: LineNetwork, end: int, number: int, between_m: tuple[float, float], power: int) -> LineNetwork:
    """Move one line's end along the line that runs through its node."""
    parting = _parting(network, end, number, between_m)
    if parting is None:
        return network
    touch = parting.law(power).touch
    if not parting.way[0] - FARTHEST_M <= touch < parting.way[0]:
        return network
    line, vertex = network.lines[parting.stock], network.passes[number, 2]
    along = length_along(line)
    start = int(np.argmin(np.abs(along - along[vertex] - parting.sense * touch)))
    if not 0 < start < len(line) - 1:
        return network
    if network.meets(end // 2, *network.span(end, parting.kept)):
        return network
    across = parting.left * parting.apart[0]
    new = _blade(line, along[start], along[vertex] + parting.sense * parting.way[0], across, power)
    return network.with_end(end, new, parting.kept, at=(parting.stock, start))


def _telling(apart: np.ndarray, least_m: float, most_m: float) -> tuple[int, int]:
    """Find the stretch, first place and the one after the last, from `least_m` apart for good to `most_m` apart."""
    beyond = np.flatnonzero(apart > most_m)
    last = int(beyond[0]) if len(beyond) else len(apart)
    below = np.flatnonzero(apart[:last] < least_m)
    return int(below[-1]) + 1 if len(below) else 0, last


def _points_of_arc(network: LineNetwork, parting: _Parting, xyz: np.ndarray, head_width_m: float) -> np.ndarray:
    """Count points where only an arc has its head, and on the head in a strip of the same area beside: (2,)."""
    blade, arc = parting.law(STRAIGHT), parting.law(ARC)
    line, along = network.lines[parting.stock], length_along(network.lines[parting.stock])
    way = parting.sense * (along - parting.node_m)
    shared = (way >= max(arc.touch, parting.way[0] - FARTHEST_M)) & (way <= parting.way[0])
    if np.count_nonzero(shared) < 2 or not np.isfinite(arc.touch):
        return np.zeros(2)
    piece = line[shared]
    reach_m = head_width_m + parting.apart[0]
    low, high = piece.min(axis=0) - reach_m, piece.max(axis=0) + reach_m
    near = xyz[slice(*np.searchsorted(xyz[:, 0], [low[0], high[0]]))]
    near = near[(near[:, 1] > low[1]) & (near[:, 1] < high[1])]
    feet = project([piece], near[:, :2], reach_m)
    if not len(feet.t):
        return np.zeros(2)
    top, _ = on_top(feet.t, feet.across, near[feet.point, 2], head_width_m)
    feet = feet[top]
    way = parting.sense * (feet.t + along[shared][0] - parting.node_m)
    strip = arc(way) - blade(way)
    beyond = parting.left * feet.across - 0.5 * head_width_m - blade(way)
    return np.array([np.count_nonzero((outward > 0) & (outward < strip)) for outward in (beyond, -beyond)])


def _power(points: np.ndarray) -> int:
    """Tell from the points at a switch, see `_points_of_arc`, whether lines part by the way or by its square."""
    on_arc, on_head = points
    return STRAIGHT if on_head >= LEAST_ON_HEAD and on_arc < EMPTY_SHARE * on_head else ARC


def _blade(line: np.ndarray, touch: float, first: float, across: float, power: int) -> np.ndarray:
    """Places between chainages `touch` and `first` of a line, `across` to its left at the latter; neither included."""
    share = np.linspace(0, 1, max(int(abs(first - touch) / STEP_M), 1) + 1)[1:-1]
    return left_of(line, touch + share * (first - touch), across * share**power)
