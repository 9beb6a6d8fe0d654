"""Rails keep their courses: of all ways to continue lines through junctions and across gaps, the steadiest is drawn.

See docs/method.md sections 4.8 and 4.9.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ..lines.ends import (
    STAIRS_M,
    STEADY_TRANSITION_M,
    STEP_M,
    TRANSITION_M,
    Bridge,
    bridge,
    cut_back,
    even_points,
    tip_and_direction,
    turned,
)
from ..lines.network import LineNetwork
from ..progress import SILENT, Progress
from .cells import STAIRS_LENGTH_M, STEADY_M, RailCells
from .junctions import DIRECTION_M, KINK_DEG, branchings, points_of, unsteadiness, weld_pairs

MAX_MERGED_M = 14.0
"""Largest length that two crossing rails share. Heads of 76 mm in cells of 40 mm share 9 m at 1:26.5, and wing rails
lengthen it at both ends."""

SKIP_M = 0.5
"""Length of a rail next to a shared part that the other rail still draws aside."""

CUTS_M = (0.0, SKIP_M, 1.0, 2.0, 3.0)
"""Lengths cut off both ends before they are joined. Weeds, guard rails and wing rails draw ends aside for up to 3 m,
even until two ends overlap side by side."""

MISFIT_M = 0.015
"""Misfit allowed to the lines that a rail continues: wing rails widen them. The cost of a join contains the rest."""

MIN_PIECE_M = 0.3
"""Shorter pieces have no direction and are not joined."""

UNSEEN_M = 0.12
"""A place this far from all cells shows neither its rail, nor one that is merged with it, nor a check rail that hides
it, whose head begins 0.10 m from the axis of the rail. A link closer than this may be what shows the rail."""

STRAY_M = 0.012
"""Standard error of a steady line: a rail is anywhere in cells of 0.04 m, which is 0.04 m / √12 rms."""

TURN_DEG = 4.0
"""Standard error of the directions of two ends against the way across: wing rails bend them by about as much."""

FREE = 4.0
"""Cost of an end that nothing continues, in squares of standard errors: two ends are joined up to √7.5 of them, 33 mm
off one curve. A join that changes the side of the partner costs as much."""

HALF_USED = 1000.0
"""Cost of a free end of a link that is used: more than all that speaks for using it."""

JOIN, CUT_PER_M, UNSEEN = 0.5, 0.3, 2.0
"""What a join costs in any case, so that one is better than two; each metre that is cut off both ends; and a part
without cells that is as long as the longest gap."""

LINK_PER_M, STUB_PER_M, ALONE_PER_M = 0.5, 1.0, 2.0
"""Cost of each metre that no rail uses: of a link, of a piece with one free end, and of one with two, which nothing
else explains. The shared part of two rails that cross at 1:9 costs as much as a join."""

BESIDE_M, BESIDE_SHARE = 0.2, 0.7
"""An unused link of which a larger share is this close to the joins that replace it is left out. A check rail is 0.14 m
from the axis of its rail."""


def follow_courses(
    network: LineNetwork, cells: RailCells, max_gap_m: float, gap_angle_deg: float, progress: Progress = SILENT
) -> LineNetwork:
    """Join the ends of lines that continue each other, through junctions, past bends and across gaps.

    All joins are chosen together: at the least cost, each end has one partner or none, and links are used with both of
    their ends or left out. So two rails that cross share no line, whatever nodes the raster has there. Choosing goes in
    rounds, because a joined line shows better where it leads. Where a line continues in one of two others in a node, it
    is a branching, which stays, in one node; see `part_branches`.

    A line whose partner, the other rail of its track, is on its left does not continue one whose partner is on its
    right. At most `max_gap_m` of a join is away from all cells, and both ends point at each other within
    `gap_angle_deg`. The network has no passes.
    """
    while True:
        network, joined = _joined(network, _Joins(network, cells, max_gap_m, gap_angle_deg, progress))
        if not joined:
            return weld_pairs(network, KINK_DEG)


class _Joins:
    """The possible joins of a network: the least cost and the bridge of each pair of ends, and which pieces are links.

    A link is a piece between two junctions or bends that may belong to no rail, or to two: what rails share where they
    cross, a check rail that hides one, a rung between two.
    """

    def __init__(
        self, network: LineNetwork, cells: RailCells, max_gap_m: float, gap_angle_deg: float, progress: Progress
    ) -> None:
        self.network, self.cells = network, cells
        self.max_gap_m, self.slope = max_gap_m, float(np.tan(np.radians(gap_angle_deg)))
        self.lengths = network.lengths()
        degrees = network.degrees()[network.ends].min(axis=1, initial=9)
        self.is_link = (degrees >= 2) & (self.lengths < MAX_MERGED_M)
        points, self.number = points_of(network)
        self.drawn = cKDTree(points)
        self.costs: dict[tuple[int, int], float] = {}
        self.bridges: dict[tuple[int, int], Bridge] = {}
        for one, other in self._near():
            progress.check()
            found = self._cheapest(one, other)
            if found is not None:
                self.costs[one, other], self.bridges[one, other] = found
        self.links_along = {ends: self._links_along(ends) for ends in self.bridges}

    def _near(self) -> list[tuple[int, int]]:
        """List the pairs of ends that a join could connect; those of one long piece would close a loop."""
        ends = np.flatnonzero(np.repeat(self.lengths >= MIN_PIECE_M, 2))
        if len(ends) < 2:
            return []
        nodes = self.network.ends.ravel()
        tips, outward = (np.array(one) for one in zip(*(_tip(self.network.from_end(end)) for end in ends.tolist())))
        pairs = cKDTree(tips).query_pairs(max(self.max_gap_m, MAX_MERGED_M), output_type="ndarray")
        across = tips[pairs[:, 1]] - tips[pairs[:, 0]]
        for ways, number in ((across, pairs[:, 0]), (-across, pairs[:, 1])):
            # Once both ends are cut back, they are further apart.
            pairs = np.where(_points_along(outward[number], ways, self.slope, 2 * CUTS_M[-1]), pairs.T, -1).T
        pairs = np.sort(ends[pairs[pairs[:, 0] >= 0]], axis=1)
        closes = (self.lengths >= MAX_MERGED_M) & (nodes[::2] != nodes[1::2])
        pairs = pairs[(pairs[:, 0] // 2 != pairs[:, 1] // 2) | closes[pairs[:, 0] // 2]]
        return [(one, other) for one, other in sorted(pairs.tolist())]

    def _cheapest(self, one: int, other: int) -> tuple[float, Bridge] | None:
        """Find the cut of two ends at which joining them costs least; None if no rail could run so, or ends may be."""
        found: tuple[float, Bridge] | None = None
        shortest_m = min(self.lengths[one // 2], self.lengths[other // 2])
        for cut_m in CUTS_M:
            if shortest_m < cut_m + SKIP_M and cut_m > 0:
                break
            way, other_way = (cut_back(self.network.from_end(end), cut_m) for end in (one, other))
            (tip, outward), (other_tip, other_outward) = tips = _tip(way), _tip(other_way)
            across = other_tip - tip
            if not _points_along(outward, across, self.slope) or not _points_along(other_outward, -across, self.slope):
                continue
            # A curve that replaces bent ends must not swerve to a rail beside them.
            transition_m = TRANSITION_M if cut_m <= SKIP_M else STEADY_TRANSITION_M
            curve = bridge(way, other_way, misfit_m=MISFIT_M, transition_m=transition_m)
            if curve is None:
                continue
            cost = JOIN + CUT_PER_M * cut_m + self._cost((way, other_way), tips, curve)
            if cost < (found[0] if found else 2 * FREE):
                found = cost, replace(curve, cuts_m=(curve.cuts_m[0] + cut_m, curve.cuts_m[1] + cut_m))
        return found

    def _cost(
        self,
        ways: tuple[np.ndarray, np.ndarray],
        tips: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]],
        curve: Bridge,
    ) -> float:
        """Return what speaks against a curve from one way to another, given from their ends inward, with their tips."""
        (one, other), ((tip, outward), (other_tip, other_outward)) = ways, tips
        gap_m = unseen_m(curve.points, self.cells.tree)
        if gap_m > self.max_gap_m:
            return np.inf
        bends = np.array([-_curvature(one), _curvature(other)])
        across = other_tip - tip
        expected = bends.mean() * np.hypot(*across) / 2
        turns = np.array([_angle(outward, across), _angle(across, -other_outward)]) - expected
        # A curvature that begins or ends in the middle strays from a constant one by a 36th of its rise in STEADY_M.
        own_m = np.abs(bends).max() * STEADY_M**2 / 36
        turn = float(np.sum(turns**2)) / np.radians(TURN_DEG) ** 2
        stray = unsteadiness(one, other, STEADY_M) ** 2 / (STRAY_M**2 + own_m**2)
        cost = turn + stray + UNSEEN * gap_m / max(self.max_gap_m, STEP_M)
        return cost + FREE * self.cells.change_of_sides(one, other) if cost < 2 * FREE else np.inf

    def _links_along(self, ends: tuple[int, int]) -> np.ndarray:
        """Return the number of the link at each place of the bridge between two ends that runs along another one."""
        points = self.bridges[ends].points
        if not len(points):
            return np.empty(0, dtype=int)
        near_m, nearest = self.drawn.query(points)
        number = self.number[nearest]
        return number[(near_m < UNSEEN_M) & self.is_link[number] & ~np.isin(number, [end // 2 for end in ends])]

    def _saved(self, ends: tuple[int, int], used: Collection[int]) -> float:
        """Return what the bridge between two ends saves by running along links, which it explains.

        A link that is left out costs something because nothing explains it. Two rails that cross do, half of it each.
        Those that are `used` are not left out.
        """
        left_out = ~np.isin(self.links_along[ends], list(used))
        return 0.5 * LINK_PER_M * STEP_M * np.count_nonzero(left_out)

    def chosen(self) -> list[tuple[int, int]]:
        """List the joins that together cost about least.

        Which links are left out is only known once joins have been chosen, so they are chosen twice: what the joins of
        the first choice use saves others nothing in the second.
        """
        first = self._cheapest_joins(used=())
        return self._cheapest_joins(used={end // 2 for ends in first for end in ends})

    def _cheapest_joins(self, used: Collection[int]) -> list[tuple[int, int]]:
        """List the joins that cost about least if links are `used`."""
        return sorted(ends for ends in best_pairs(self._gains(used)) if ends in self.costs)

    def _gains(self, used: Collection[int]) -> dict[tuple[int, int], float]:
        """Return what each join gains, and each piece that no join uses; see `_saved` for the links that are `used`."""
        free = np.where(self.is_link, HALF_USED, FREE)
        free_ends = (self.network.degrees()[self.network.ends] == 1).sum(axis=1)
        per_m = np.where(self.is_link, LINK_PER_M, np.where(free_ends == 2, ALONE_PER_M, STUB_PER_M))
        gains = {
            ends: free[ends[0] // 2] + free[ends[1] // 2] - cost + self._saved(ends, used)
            for ends, cost in self.costs.items()
        }
        for number in np.flatnonzero(self.lengths < MAX_MERGED_M).tolist():
            # The free end of a piece that ends in a node is the end of a rail, whether it is used or not.
            saved = free[number] * (1 if free_ends[number] == 1 else 2)
            gains[2 * number, 2 * number + 1] = saved - per_m[number] * self.lengths[number]
        return gains


def _joined(network: LineNetwork, joins: _Joins) -> tuple[LineNetwork, bool]:
    """Draw the joins that cost least, without the links that they replace; also returns whether there are any."""
    chosen = joins.chosen()
    taken = {end for ends in chosen for end in ends}
    unused = [number for number in np.flatnonzero(joins.is_link).tolist() if not taken & {2 * number, 2 * number + 1}]
    branching = _branching(network, chosen, unused)
    bridges = _apart({ends: joins.bridges[ends] for ends in chosen if ends not in branching}, joins)
    if bridges:
        return weld_pairs(network.bridged(bridges, {}, _replaced(network, bridges, unused)), KINK_DEG), True
    single = _in_one_node(network, branching.values(), unused)
    return single, len(single.lines) < len(network.lines)


def _apart(bridges: Mapping[tuple[int, int], Bridge], joins: _Joins) -> dict[tuple[int, int], Bridge]:
    """Leave out bridges for which, with a cheaper one at the other end, more is cut off a piece than there is.

    The next round finds them again, if they are any good, once the cheaper ones are drawn.
    """
    kept = dict(bridges)
    cuts_m = {end: cut_m for ends, curve in bridges.items() for end, cut_m in zip(ends, curve.cuts_m)}
    for ends in sorted(bridges, key=lambda ends: -joins.costs[ends]):
        if any(cuts_m[end] + cuts_m.get(end ^ 1, 0.0) > joins.lengths[end // 2] for end in ends):
            del kept[ends], cuts_m[ends[0]], cuts_m[ends[1]]
    return kept


def _replaced(network: LineNetwork, bridges: Mapping[tuple[int, int], Bridge], unused: Collection[int]) -> list[int]:
    """List the unused links that run beside bridges."""
    drawn = cKDTree(np.concatenate([np.empty((0, 2)), *(curve.points for curve in bridges.values())]))
    return [
        number
        for number in unused
        if np.mean(drawn.query(even_points(network.lines[number]))[0] < BESIDE_M) > BESIDE_SHARE
    ]


def _branching(
    network: LineNetwork, chosen: Collection[tuple[int, int]], unused: Sequence[int]
) -> dict[tuple[int, int], list[int]]:
    """Find the joins that pass a place in which one line continues in several, with all ends there but of links.

    Such a join leaves a single end over, or several that all leave the line to the same side of branchings.
    """
    nodes = network.ends.ravel()
    place = _places(network, unused)[nodes]
    place[[2 * number + side for number in unused for side in (0, 1)]] = -1
    known = {node for node, *_ in branchings(network)}
    taken = {end for ends in chosen for end in ends}
    found = {}
    for ends in chosen:
        here = np.flatnonzero(place == place[ends[0]])
        left = [end for end in here.tolist() if end not in taken]
        if place[ends[0]] == place[ends[1]] and left and len(here) == len(left) + 2:
            ahead = _tip(network.from_end(ends[0]))[1]
            onward = {float(_tip(network.from_end(end))[1] @ ahead) > 0 for end in left}
            if len(left) == 1 or len(onward) == 1 and known.issuperset(nodes[here].tolist()):
                found[ends] = here.tolist()
    return found


def _places(network: LineNetwork, unused: Sequence[int]) -> np.ndarray:
    """Give nodes that `unused` links connect the same number, (k,)."""
    graph = coo_matrix((np.ones(len(unused)), tuple(network.ends[unused].T)), shape=(len(network.nodes),) * 2)
    return connected_components(graph, directed=False)[1]


def _in_one_node(network: LineNetwork, branching: Collection[list[int]], unused: Sequence[int]) -> LineNetwork:
    """Let the three lines of each branching meet in the node that is nearest to all, without the links around it.

    Where rails part, holes between their heads and where blurred heads touch again make several nodes with links.
    """
    place = _places(network, unused)
    at = place[network.ends[unused, 0]]
    lines, ends, dropped = list(network.lines), network.ends.copy(), []
    for own in branching:
        nodes = network.ends.flat[own]
        links = np.flatnonzero(at == place[nodes[0]]).tolist()
        if not links or not len({end // 2 for end in own}) == len(own) == 3:
            continue
        places = network.nodes[nodes]
        nearest = int(np.argmin(cdist(places, places).sum(axis=0)))
        for end in (end for end, node in zip(own, nodes) if node != nodes[nearest]):
            lines[end // 2] = turned(np.concatenate([places[[nearest]], turned(lines[end // 2], end)]), end)
        ends.flat[own] = nodes[nearest]
        dropped += [unused[link] for link in links]
    return replace(network, lines=tuple(lines), ends=ends).select(~np.isin(np.arange(len(lines)), dropped))


def best_pairs(gains: Mapping[tuple[int, int], float]) -> set[tuple[int, int]]:
    """Choose pairs, each number in one of them at most, whose gains have about the largest sum.

    The assignment of numbers to numbers with the largest gain pairs most of them. Where it forms a ring of three or
    more instead, the best of the pairs of neighbours are taken, which may miss the largest sum by a little.
    """
    chosen: set[tuple[int, int]] = set()
    left = {pair: gain for pair, gain in gains.items() if gain > 0}
    while left:
        for ring in _rings(left):
            chosen |= max(_pairs_along(ring, left), key=lambda pairs: sum(left[pair] for pair in pairs))
        taken = {number for pair in chosen for number in pair}
        left = {pair: gain for pair, gain in left.items() if not taken.intersection(pair)}
    return chosen


def _rings(gains: Mapping[tuple[int, int], float]) -> list[list[int]]:
    """Assign numbers to numbers with the largest gain, and list those that are assigned to each other in a ring."""
    numbers = sorted({number for pair in gains for number in pair})
    gain = np.zeros((len(numbers), len(numbers)))
    for pair, value in gains.items():
        row, column = np.searchsorted(numbers, pair)
        gain[row, column] = gain[column, row] = value
    _, partner = linear_sum_assignment(gain, maximize=True)
    rings, seen = [], set()
    for first in range(len(numbers)):
        ring = []
        while first not in seen:
            seen.add(first)
            ring.append(numbers[first])
            first = int(partner[first])
        if len(ring) > 1:
            rings.append(ring)
    return rings


def _pairs_along(ring: Sequence[int], gains: Mapping[tuple[int, int], float]) -> Iterator[set[tuple[int, int]]]:
    """Yield the sets of pairs of neighbours in a ring, begun at each of its numbers, that have a gain."""
    for first in range(len(ring)):
        turned = [*ring[first:], *ring[:first]]
        pairs = [(min(pair), max(pair)) for pair in zip(turned[::2], turned[1::2])]
        yield {pair for pair in pairs if pair in gains}


def unseen_m(points: np.ndarray, seen: cKDTree) -> float:
    """Measure the length of a curve away from all cells, given its points, one every `STEP_M`."""
    return STEP_M * np.count_nonzero(seen.query(points)[0] > UNSEEN_M) if len(points) else 0.0


def _points_along(outward: np.ndarray, way: np.ndarray, slope: float, further_m: float = 0.0) -> np.ndarray:
    """Return whether directions point along ways, (..., 2) metres each and prolonged by `further_m`, within a slope."""
    ahead = (way * outward).sum(axis=-1) + further_m
    aside = np.abs(way[..., 0] * outward[..., 1] - way[..., 1] * outward[..., 0])
    return (ahead > 0) & (aside <= ahead * slope + STAIRS_M)


def _tip(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where a line, given from its end inward, ends, (2,), and the unit vector out of it, (2,)."""
    return tip_and_direction(even_points(line, DIRECTION_M))


def _curvature(line: np.ndarray) -> float:
    """Estimate the curvature of the first `STEADY_M` of a line from the directions of both its ends, to the left."""
    points = even_points(line, STEADY_M)
    third = len(points) // 3
    if third * STEP_M < STAIRS_LENGTH_M:
        return 0.0
    ahead = [-tip_and_direction(part)[1] for part in (points[:third], points[-third:])]
    return _angle(*ahead) / (2 * third * STEP_M)


def _angle(one: np.ndarray, other: np.ndarray) -> float:
    """Return the angle from one direction to another, to the left, radians."""
    return float(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other))
