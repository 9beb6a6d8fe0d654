"""Branches that end freely next to the rail they leave are connected to it (docs/method.md section 4.12)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..lines.ends import ARC, FIT_M, MISFIT_M, Bridge, PartingLaw, bridge, even_points, tip_and_direction
from ..lines.network import LineNetwork
from ..polyline import length_along
from ..progress import SILENT, Progress
from .branches import MAX_BACK_M, STEADY_M
from .joining import unseen_m
from .junctions import DIRECTION_M

MAX_BESIDE_M = 1.0
"""A branch that ends further from a rail is not connected to it: nothing of the switch has been seen."""

MIN_AHEAD_M = 4.0
"""Shortest length of a stock rail beyond the end of its branch, where the branch is to be connected."""

MIN_POINTS = 10
"""Fewer even points, on a metre of line, have no measurable curvature."""


@dataclass(frozen=True)
class _Touch:
    """Where a branch leaves its stock rail.

    Attributes
    ----------
    stock, vertex : int
        Number of the stock rail's line, and its vertex at this place.
    curve : Bridge
        From the end of the branch to there.
    """

    stock: int
    vertex: int
    curve: Bridge


def attach_branches(network: LineNetwork, seen: cKDTree, max_gap_m: float, progress: Progress = SILENT) -> LineNetwork:
    """Extend free ends to the rails from which they branch off, by curves that explain both lines.

    Parameters
    ----------
    network : LineNetwork
    seen : cKDTree
        Places of rail cells.
    max_gap_m : float
        Largest length of the curve away from all cells.
    progress : Progress
    """
    if not network.lines:
        return network
    low = np.array([line.min(axis=0) for line in network.lines]) - MAX_BESIDE_M
    high = np.array([line.max(axis=0) for line in network.lines]) + MAX_BESIDE_M
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
    """Yield the place where a line branches off line `number`, if there is one."""
    tip, outward = tip_and_direction(even_points(from_end, DIRECTION_M))
    axes = np.array([outward, [-outward[1], outward[0]]])
    x, y = axes @ (line - tip).T
    near = (x > -STEADY_M) & (x < MAX_BACK_M + MIN_AHEAD_M) & (np.abs(y) < MAX_BESIDE_M)
    if np.count_nonzero(near) < 2:
        return
    first, last = np.flatnonzero(near)[[0, -1]]
    sense = 1 if x[last] > x[first] else -1
    way = line[first : last + 1][::sense]
    x, y = axes @ (way - tip).T
    if x[0] > 0 or x[-1] < MIN_AHEAD_M or (np.diff(x) <= 0).any():
        return
    own = even_points(from_end, min(STEADY_M, -x[0]))
    own_x, own_y = axes @ (own - tip).T
    stock_y = np.interp(own_x, x, y)
    if len(own) < MIN_POINTS or len(set(np.sign(stock_y - own_y))) > 1:
        return
    law = PartingLaw.fitted(-own_x, np.abs(stock_y - own_y), ARC)
    touch_m = -law.way_at(MISFIT_M)
    if not 0 < touch_m < min(MAX_BACK_M, x[-1]):
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
    """Extend one end to where it touches its stock rail."""
    network = network.cut_back({end: touch.curve.cuts_m[0]})
    return network.with_end(end, touch.curve.points[::-1], 0, at=(touch.stock, touch.vertex))
