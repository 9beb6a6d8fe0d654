"""Where one rail leaves another, the raster shows their mean: the one runs on, and the other is led to it by a curve.

See docs/method.md sections 4.10 and 4.11.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..lines.ends import (
    ARC,
    FIT_M,
    MISFIT_M,
    STEP_M,
    STRAIGHT,
    Bridge,
    PartingLaw,
    bridge,
    cut_back,
    even_points,
    tip_and_direction,
)
from ..lines.network import LineNetwork
from ..polyline import Polyline
from ..progress import SILENT, Progress
from .courses import MISFIT_M as KNOWN_MISFIT_M
from .courses import SKIP_M, unseen_m
from .junctions import DIRECTION_M, branchings, unsteadiness
from .slips import MIN_ANGLE_DEG

MAX_BACK_M = 40.0
"""Largest length by which a branch is extended back: on a radius of 2500 m, as at 1:26.5, two rails are 0.2 m apart
after 32 m, and the visible part gives that length to within a quarter."""

STEADY_M = 8.0
"""Length over which the parting of two rails is measured."""

ROUTE_M = 40.0
"""Length on either side over which curvatures are compared. At 1:26.5, the flattest turnout in use, the branch is then
off a constant curvature by 18 mm, several times the uncertainty from stairs; over 30 m, by 10 mm."""

MAX_BESIDE_M = 1.0
"""A branch that ends further from a rail is not connected to it: nothing of the switch has been seen."""

PARTED_M = 0.3
"""Two blurred heads are one ridge up to 0.2 m apart, and check and wing rails, 0.14 m from the axis, bend the end of a
line that crosses a rail. What is further from the rail shows whether the line leaves it on an arc."""

STRAIGHTER, MUCH_STRAIGHTER = 0.9, 0.65
"""Scatter about a straight line, by that about an arc that touches the rail, up to which a line is straight. About an
arc that bends little over its last 8 m both are the stairs of the raster, and within 10 % of each other by chance. A
line that comes close to the rail seems to leave it, and is its branch unless it is much straighter: branches whose
curve ends soon after they have parted have 0.75 and more, legs of crossings 0.3 to 0.6."""

SHARED_M = 0.05
"""Lines that are closer share their cells: each is up to half a cell, `STAIRS_M`, off the mean of both rails, and half
of the distance to an even point of the other is added."""

MIN_AHEAD_M = 4.0
"""Shortest length of a stock rail beyond the end of its branch, where the branch is to be connected."""

MIN_POINTS = 10
"""Fewer even points, on a metre of line, have no measurable curvature."""


def part_branches(network: LineNetwork) -> LineNetwork:
    """Let the stem of every branching run on into its steadiest leg, and the other legs end freely.

    `attach_branches` leads these back. Where three rails part within a few metres, a line too short for its direction
    to be measured connects two branchings, which are taken as one. A stem as short that ends freely is dropped where
    its legs are straight: the cloud ends in a crossing, and the two rails are merged in the stem. The network has no
    passes yet.
    """
    legs_of = {stem: legs for _, stem, legs in branchings(network)}
    short = network.lengths() < SKIP_M + DIRECTION_M
    blind = {stem for stem in legs_of if short[stem // 2] and network.degrees()[network.ends.flat[stem ^ 1]] == 1}
    joins: dict[tuple[int, int], Bridge] = {}
    cuts_m: dict[int, float] = {}
    links: list[int] = []
    for stem, legs in legs_of.items():
        ways = {leg: network.from_end(leg) for leg in legs}
        through = [leg for leg in legs if short[leg // 2] and leg ^ 1 in legs_of]
        for link in through:
            before = ways.pop(link)
            ways.update({leg: np.concatenate([before[:-1], network.from_end(leg)]) for leg in legs_of[link ^ 1]})
        found = _run_on(network, stem, ways, cuts_m)
        if found is not None:
            back_m, steady, curve = found
            joins[stem, steady] = curve
            cuts_m.update({**dict.fromkeys(ways, SKIP_M), stem: back_m})
            links += [link // 2 for link in through]
        elif stem in blind and not short[[leg // 2 for leg in legs]].any() and _cross(*ways.values()):
            cuts_m.update(dict.fromkeys(legs, SKIP_M))
            links.append(stem // 2)
    return network.bridged(joins, cuts_m, links)


def _run_on(
    network: LineNetwork, stem: int, ways: Mapping[int, np.ndarray], cuts_m: Mapping[int, float]
) -> tuple[float, int, Bridge] | None:
    """Find how far back a stem is merged, the leg in which it continues, and the curve; None if no rail could run so.

    Given are the ways from the stem on into its legs, and what has been cut off other ends.
    """
    lengths = network.lengths()
    left_m = {end: lengths[end // 2] - cuts_m.get(end ^ 1, 0.0) for end in (stem, *ways)}
    if len({end // 2 for end in left_m}) < len(left_m) or min(left_m[leg] for leg in ways) < SKIP_M + DIRECTION_M:
        return None
    back_m = max(_merged_m(one, other) for one, other in combinations(ways.values(), 2))
    room_m = left_m[stem] - SKIP_M - DIRECTION_M
    if not 0 < back_m < MAX_BACK_M or room_m <= 0:
        return None
    back_m = min(back_m, room_m)  # where another branching lies in between, the rest is merged there as well
    trunk = cut_back(network.from_end(stem), back_m)
    rails = {leg: cut_back(network.from_end(leg), SKIP_M) for leg in ways}
    steady = min(rails, key=lambda leg: unsteadiness(trunk, rails[leg], ROUTE_M))
    curve = bridge(trunk, rails[steady], misfit_m=KNOWN_MISFIT_M)
    return None if curve is None else (back_m, steady, curve)


def _merged_m(one: np.ndarray, other: np.ndarray) -> float:
    """Measure how far before their node two legs begin to part; not positive if they do not."""
    return -PartingLaw.fitted(*_apart(one, other), ARC).way_at(MISFIT_M)


def _cross(one: np.ndarray, other: np.ndarray) -> bool:
    """Return whether two legs are those of a crossing: they are straight, at an angle to each other."""
    return _is_straight(*_apart(one, other))


def _apart(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the way along two legs from their node and the distance between them, (n,) metres each."""
    one, other = (even_points(cut_back(way, SKIP_M), STEADY_M) for way in (one, other))
    count = min(len(one), len(other))
    return SKIP_M + STEP_M * np.arange(count), np.hypot(*(one[:count] - other[:count]).T)


def attach_branches(network: LineNetwork, seen: cKDTree, max_gap_m: float, progress: Progress = SILENT) -> LineNetwork:
    """Extend free ends to the rails from which they branch off, by curves that explain both lines.

    Such a curve is at most `max_gap_m` long away from all cells, `seen`.
    """
    if not network.lines:
        return network
    low = np.array([line.min(axis=0) for line in network.lines]) - MAX_BESIDE_M
    high = np.array([line.max(axis=0) for line in network.lines]) + MAX_BESIDE_M
    for end in progress.follow(np.flatnonzero(network.degrees()[network.ends.ravel()] == 1).tolist()):
        from_end = network.from_end(end)
        if Polyline(from_end).length_m < FIT_M:
            continue
        near = np.flatnonzero(((from_end[0] > low) & (from_end[0] < high)).all(axis=1))
        touches = [
            (touch.beyond, touch.curve.cost, number, touch)
            for number in near.tolist()
            if number != end // 2 and (touch := _touch(from_end, network.lines[number])) is not None
            if unseen_m(touch.curve.points, seen) <= max_gap_m
        ]
        if touches:
            *_, number, touch = min(touches, key=lambda touch: touch[:2])
            network = network.cut_back({end: touch.curve.cuts_m[0]})
            network = network.with_end(end, touch.curve.points[::-1], 0, at=(number, touch.vertex))
    return network.tidy()


class _Touch(NamedTuple):
    """The vertex of a line from which another one branches off, and the curve that leads there.

    Where the law of an arc puts this `beyond` the end of the line, as where the cloud ends in a switch, the curve leads
    to this end.
    """

    vertex: int
    curve: Bridge
    beyond: bool


def _touch(from_end: np.ndarray, line: np.ndarray) -> _Touch | None:
    """Find where a line, given from its end inward, branches off another one."""
    shared_m = _shared_m(from_end, line)
    if Polyline(from_end).length_m - shared_m < FIT_M:
        return None
    from_end = cut_back(from_end, shared_m)
    tip, outward = tip_and_direction(even_points(from_end, DIRECTION_M))
    axes = np.array([outward, [-outward[1], outward[0]]])
    x, y = axes @ (line - tip).T
    near = np.flatnonzero((x > -STEADY_M) & (x < MAX_BACK_M + MIN_AHEAD_M) & (np.abs(y) < MAX_BESIDE_M))
    if len(near) < 2:
        return None
    way = np.arange(near[0], near[-1] + 1)[:: 1 if x[near[-1]] > x[near[0]] else -1]
    x, y = x[way], y[way]
    if x[0] > 0 or x[-1] < MIN_AHEAD_M or (np.diff(x) < -STEP_M).any():
        return None
    own_x, own_y = axes @ (even_points(from_end, min(STEADY_M, -x[0])) - tip).T
    apart_m = np.interp(own_x, np.maximum.accumulate(x), y) - own_y
    if len(own_x) < MIN_POINTS or len(set(np.sign(apart_m))) > 1 or _is_leg(from_end, line):
        return None
    arc = PartingLaw.fitted(-own_x, np.abs(apart_m), ARC)
    touch_m = -arc.way_at(MISFIT_M)
    if not 0 < touch_m < MAX_BACK_M:
        return None
    beyond = bool(touch_m >= x[-1])
    touch_m = x[-1] - DIRECTION_M if beyond else touch_m
    onward = way[int(np.abs(x - touch_m).argmin())]
    stock = line[onward:] if way[0] < way[-1] else line[onward::-1]
    curve = bridge(from_end, stock, misfit_m=KNOWN_MISFIT_M) if Polyline(stock).length_m >= DIRECTION_M else None
    if curve is None:
        return None
    further = int(np.searchsorted(Polyline(stock).t, curve.cuts_m[1]))
    vertex = int(onward + further if way[0] < way[-1] else onward - further)
    curve = replace(curve, cuts_m=(shared_m + curve.cuts_m[0], curve.cuts_m[1]))
    return _Touch(vertex, curve, beyond) if 0 < vertex < len(line) - 1 else None


def _shared_m(from_end: np.ndarray, line: np.ndarray) -> float:
    """Measure the length, from its end inward, over which a line is drawn on another one: both share their cells."""
    apart_m = _distances_to(even_points(from_end, MAX_BACK_M), line)
    return STEP_M * int(np.argmax(np.append(apart_m, np.inf) > SHARED_M))


def _distances_to(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Return the distances of points from a line, (n,) metres; infinite beyond its ends, and far from the first one."""
    reach = np.abs(line - points[0]).max(axis=1) < MAX_BACK_M
    if reach.sum() < 2:
        return np.full(len(points), np.inf)
    places = even_points(line[reach])
    apart_m, nearest = cKDTree(places).query(points)
    return np.where((nearest > 0) & (nearest < len(places) - 1), apart_m, np.inf)


def _is_leg(from_end: np.ndarray, line: np.ndarray) -> bool:
    """Return whether a line, given from its end inward, is a straight leg of a crossing of another, not its branch."""
    apart_m = _distances_to(even_points(from_end, 2 * STEADY_M), line)
    first = int(np.argmax(np.append(apart_m, np.inf) > PARTED_M))
    apart_m = apart_m[first:][: int(STEADY_M / STEP_M)]
    apart_m = apart_m[np.isfinite(apart_m)]
    share = MUCH_STRAIGHTER if first else STRAIGHTER
    return len(apart_m) * STEP_M >= FIT_M and _is_straight(STEP_M * np.arange(len(apart_m)), apart_m, share)


def _is_straight(way: np.ndarray, apart: np.ndarray, share: float = STRAIGHTER) -> bool:
    """Return whether two lines part at an angle, and a straight line explains their distance better than an arc.

    `way` and `apart`, (n,), are the way along one of them and the distance between both there.
    """
    straight, arc = (PartingLaw.fitted(way, apart, law) for law in (STRAIGHT, ARC))
    of_straight, of_arc = (np.std(law(way) - apart) for law in (straight, arc))
    return bool(straight.slope > np.tan(np.radians(MIN_ANGLE_DEG)) and of_straight < share * of_arc)
