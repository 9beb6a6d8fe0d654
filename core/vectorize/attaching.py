"""A rail that ends beside another one and bends towards it branches off it; one that only runs along it is a guard."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..lines.bridges import FIT_M, MISFIT_M, STAIRS_M, Bridge, bridge, curvature
from ..lines.ends import STEP_M, stretch, way_out
from ..lines.network import LineNetwork
from ..lines.parting import ARC, PartingLaw
from ..polyline import length_along
from ..progress import SILENT, Progress
from .branches import FARTHEST_M, STEADY_M, sharpest
from .crossings import SKIP_M
from .joining import unseen_m
from .junctions import DIRECTION_M

BESIDE_M = 1.0
"""A branch that is no nearer to its stock rail is not led back to it: nothing of the switch was seen."""

SLOPE_M = 4.0
"""Least length of a stock rail beyond the end of its branch: there the branch is to be led back to it."""

LEAST_POINTS = 10
"""A stretch of fewer points, a metre, tells no curvature."""

GUARD_APART_M = 0.13
"""Farthest that a guard or wing rail's axis lies beside a running rail's: a head, and a flangeway of 50 mm."""

GUARD_M = 8.0
"""Longer lines so near another are no guards, but two rails of a very flat switch."""


PULLED_M = 0.03
"""A stock rail's line that strays so far from its curve is the mean of both rails: a stair is half a cell of it."""


@dataclass(frozen=True)
class _Touch:
    """Where a branch leaves its stock rail: line, vertex of it, and the curve from the branch's end to there."""

    stock: int
    vertex: int
    curve: Bridge


def attach_branches(network: LineNetwork, seen: cKDTree, max_gap_m: float, progress: Progress = SILENT) -> LineNetwork:
    """Lead free ends back to the rails that they branch off, by curves that both lines explain.

    Parameters
    ----------
    network : LineNetwork
    seen : cKDTree
        Places of rail cells.
    max_gap_m : float
        The curve may run no further than this where there are none.
    progress : Progress
    """
    if not network.lines:
        return network
    reach_m = FARTHEST_M + SLOPE_M
    low = np.array([line.min(axis=0) for line in network.lines]) - reach_m
    high = np.array([line.max(axis=0) for line in network.lines]) + reach_m
    for end in progress.follow(np.flatnonzero(network.degrees()[network.ends.ravel()] == 1).tolist()):
        from_end = network.from_end(end)
        if length_along(from_end)[-1] < FIT_M:
            continue
        near = np.flatnonzero(((from_end[0] > low) & (from_end[0] < high)).all(axis=1))
        touches = [
            touch
            for number in near.tolist()
            for touch in _touching(from_end, number, network.lines[number])
            if number != end // 2 and unseen_m(touch.curve.points, seen) <= max_gap_m
        ]
        if touches:
            network = _attached(network, end, min(touches, key=lambda touch: touch.curve.cost))
    return network.tidy()


def _touching(from_end: np.ndarray, number: int, line: np.ndarray) -> Iterator[_Touch]:
    """Give where a line branches off another one, if it may."""
    tip, outward = way_out(stretch(from_end, DIRECTION_M))
    axes = np.array([outward, [-outward[1], outward[0]]])
    x, y = axes @ (line - tip).T
    near = (x > -STEADY_M) & (x < FARTHEST_M + SLOPE_M) & (np.abs(y) < BESIDE_M)
    if np.count_nonzero(near) < 2:
        return
    first, last = np.flatnonzero(near)[[0, -1]]
    sense = 1 if x[last] > x[first] else -1
    way = line[first : last + 1][::sense]
    x, y = axes @ (way - tip).T
    if x[0] > 0 or x[-1] < SLOPE_M or (np.diff(x) <= 0).any():
        return
    own = stretch(from_end, min(STEADY_M, -x[0]))
    own_x, own_y = axes @ (own - tip).T
    stock_y = np.interp(own_x, x, y)
    if len(own) < LEAST_POINTS or len(set(np.sign(stock_y - own_y))) > 1:
        return
    law = PartingLaw.fitted(-own_x, np.abs(stock_y - own_y), ARC)
    touch_m = -law.way_at(MISFIT_M)
    seen_bend = curvature(own) - curvature(np.column_stack([own_x, stock_y]) @ axes)
    if law.curvature > sharpest(seen_bend) or not 0 < touch_m < min(FARTHEST_M, x[-1]):
        return
    along = int(np.abs(x - touch_m).argmin())
    onward = line[(first + along if sense > 0 else last - along) :: sense]
    if length_along(onward)[-1] < DIRECTION_M:
        return
    curve = bridge(from_end, onward)
    if curve is None:
        return
    along += int(np.searchsorted(length_along(onward), curve.cuts_m[1]))
    vertex = first + along if sense > 0 else last - along
    if 0 < vertex < len(line) - 1:
        yield _Touch(number, vertex, curve)


def _attached(network: LineNetwork, end: int, touch: _Touch) -> LineNetwork:
    """Lead one end to where it touches its stock rail, whose own line is straightened there."""
    network, vertex = _straightened(network, touch, network.from_end(end)[0])
    network = network.cut_back({end: touch.curve.cuts_m[0]})
    return network.with_end(end, touch.curve.points[::-1], 0, at=(touch.stock, vertex))


def _straightened(network: LineNetwork, touch: _Touch, tip: np.ndarray) -> tuple[LineNetwork, int]:
    """Draw a stock rail as a curve from where a branch touches it to where that is seen apart, if it is pulled aside.

    Returns the network and the number that the vertex of the touch has then.
    """
    line, vertex = network.lines[touch.stock], touch.vertex
    abeam = int(np.hypot(*(line - tip).T).argmin())
    sense = 1 if abeam > vertex else -1
    before, onward = line[vertex::-sense], line[vertex::sense]
    t = length_along(onward)
    far = int(np.searchsorted(t, t[abs(abeam - vertex)] + SKIP_M))
    if far == len(onward) or min(length_along(before)[-1], t[-1] - t[far]) < DIRECTION_M:
        return network, vertex
    curve = bridge(before, onward[far:])
    if curve is None or curve.cuts_m[0] > STEP_M or not len(curve.points):
        return network, vertex
    far += int(np.searchsorted(t[far:] - t[far], curve.cuts_m[1]))
    if far >= len(onward) or cKDTree(curve.points).query(onward[1:far])[0].max(initial=0) < PULLED_M:
        return network, vertex
    first, last = sorted([vertex, vertex + sense * far])
    if network.meets(touch.stock, first + 1, last):
        return network, vertex
    redrawn = network.with_piece(touch.stock, first, last, curve.points[::sense])
    moved = vertex if sense > 0 else vertex + len(redrawn.lines[touch.stock]) - len(line)
    return redrawn, moved


def drop_guards(network: LineNetwork) -> LineNetwork:
    """Remove short lines that lie beside a longer one over their whole length: guard and wing rails, and doubles."""
    lengths = network.lengths()
    short = np.flatnonzero(lengths < GUARD_M)
    if not len(short):
        return network
    reach_m = GUARD_APART_M + STAIRS_M
    dense = [stretch(line, np.inf) for line in network.lines]
    number_of = np.repeat(np.arange(len(dense)), [len(points) for points in dense])
    tree = cKDTree(np.concatenate(dense))
    keep = np.ones(len(lengths), dtype=bool)
    for number in short.tolist():
        beside = [set(number_of[near].tolist()) for near in tree.query_ball_point(dense[number], reach_m)]
        keep[number] = not any(keep[one] and lengths[one] > lengths[number] for one in set.intersection(*beside))
    return network.select(keep)
