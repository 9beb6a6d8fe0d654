"""Rails keep their courses: of all ways to continue lines through junctions and across gaps, the steadiest is drawn.

See docs/method.md section 4.8.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

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
)
from ..lines.network import LineNetwork
from ..progress import SILENT, Progress
from .junctions import DIRECTION_M, branchings, drop_spurs, ends_by_node, unsteadiness, weld_pairs

MAX_MERGED_M = 14.0
"""Largest length that two crossing rails share. Heads of 76 mm in cells of 40 mm share 9 m at 1:26.5, and wing rails
lengthen it at both ends."""

SKIP_M = 0.5
"""Length of a rail next to a shared part that the other rail still draws aside."""

CUTS_M = (0.0, SKIP_M, 1.0, 2.0, 3.0)
"""Lengths cut off both ends before they are joined. Weeds, guard rails and wing rails draw ends aside for up to 3 m,
even until two ends overlap side by side."""

WING_M = 3.0
"""What no rail continues up to this length at a junction is a wing rail, a rung or a swerve, and is left out."""

MISFIT_M = 0.015
"""Misfit allowed to the lines that a rail continues: wing rails widen them. The cost of a join contains the rest."""

MIN_PIECE_M = 0.3
"""Shorter pieces have no direction and are not joined."""

UNSEEN_M = 0.12
"""A place this far from all cells shows neither its rail, nor one that is merged with it, nor a check rail that hides
it, whose head begins 0.10 m from the axis of the rail."""

STEADY_M = 8.0
"""Length of line on either side of a join that is to be of one curvature."""

STAIRS_LENGTH_M = 1.0
"""Shorter parts of a line show the direction of stairs."""

STRAY_M = 0.012
"""Standard error of a steady line: a rail is anywhere in cells of 0.04 m, which is 0.04 m / √12 rms."""

TURN_DEG = 4.0
"""Standard error of the directions of two ends against the way across: wing rails bend them by about as much."""

FREE = 4.0
"""Cost of an end that nothing continues, in squares of standard errors: two ends are joined up to √8 of them, 34 mm off
one curve."""

HALF_USED = 1000.0
"""Cost of a free end of a link that is used: more than all that speaks for using it."""

JOIN, CUT_PER_M, UNSEEN = 0.5, 0.3, 2.0
"""What a join costs in any case, so that one is better than two; each metre that is cut off; and a part without cells
that is as long as the longest gap."""

LINK_PER_M, PIECE_PER_M = 0.5, 1.0
"""Cost of each metre of a link, and of another piece, that no rail uses. The shared part of two rails that cross at 1:9
costs as much as a join."""

BESIDE_M, BESIDE_SHARE = 0.2, 0.7
"""An unused link of which a larger share is this close to the joins that replace it is left out. A check rail is 0.14 m
from the axis of its rail."""


def follow_courses(
    network: LineNetwork, seen: cKDTree, max_gap_m: float, gap_angle_deg: float, progress: Progress = SILENT
) -> LineNetwork:
    """Join the ends of lines that continue each other, through junctions, past bends and across gaps.

    All joins are chosen together: at the least cost, each end has one partner or none, and links are used with both of
    their ends or left out. So two rails that cross share no line, whatever nodes the raster has there. Choosing goes in
    rounds, because a joined line shows better where it leads. Where a line continues in one of two others in a node, it
    is a branching, which stays; see `part_branches`.

    At most `max_gap_m` of a join is away from all cells, `seen`, and both ends point at each other within
    `gap_angle_deg`. The network has no passes.
    """
    while True:
        progress.check()
        network, joined = _joined(network, _Joins(network, seen, max_gap_m, gap_angle_deg))
        if not joined:
            return drop_spurs(weld_pairs(network), WING_M)


class _Joins:
    """The possible joins of a network: the least cost and the bridge of each pair of ends, and which pieces are links.

    A link is a piece between two junctions or bends that may belong to no rail, or to two: what rails share where they
    cross, a check rail that hides one, a rung between two.
    """

    def __init__(self, network: LineNetwork, seen: cKDTree, max_gap_m: float, gap_angle_deg: float) -> None:
        self.network, self.seen = network, seen
        self.max_gap_m, self.slope = max_gap_m, float(np.tan(np.radians(gap_angle_deg)))
        self.lengths = network.lengths()
        degrees = network.degrees()[network.ends].min(axis=1, initial=9)
        self.is_link = (degrees >= 2) & (self.lengths < MAX_MERGED_M)
        self.costs: dict[tuple[int, int], float] = {}
        self.bridges: dict[tuple[int, int], Bridge] = {}
        for one, other in self._near():
            found = self._cheapest(one, other)
            if found is not None:
                self.costs[one, other], self.bridges[one, other] = found

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
            ahead = (ways * outward[number]).sum(axis=1) + 2 * CUTS_M[-1]
            aside = np.abs(ways[:, 0] * outward[number, 1] - ways[:, 1] * outward[number, 0])
            pairs = np.where((ahead > 0) & (aside <= ahead * self.slope + STAIRS_M), pairs.T, -1).T
        pairs = np.sort(ends[pairs[pairs[:, 0] >= 0]], axis=1)
        closes = (self.lengths >= MAX_MERGED_M) & (nodes[::2] != nodes[1::2])
        pairs = pairs[(pairs[:, 0] // 2 != pairs[:, 1] // 2) | closes[pairs[:, 0] // 2]]
        return [(one, other) for one, other in sorted(pairs.tolist())]

    def _cheapest(self, one: int, other: int) -> tuple[float, Bridge] | None:
        """Find the cut of two ends at which joining them costs least; None if no rail could run so, or ends may be."""
        found: tuple[float, Bridge] | None = None
        shortest_m = min(self.lengths[one // 2], self.lengths[other // 2])
        for cut_m in CUTS_M:
            if shortest_m < cut_m + 2 * SKIP_M and cut_m > 0:
                break
            way, other_way = (cut_back(self.network.from_end(end), cut_m) for end in (one, other))
            # A curve that replaces bent ends must not swerve to a rail beside them.
            transition_m = TRANSITION_M if cut_m <= SKIP_M else STEADY_TRANSITION_M
            curve = bridge(way, other_way, misfit_m=MISFIT_M, transition_m=transition_m)
            if curve is None:
                continue
            cost = JOIN + CUT_PER_M * cut_m + self._cost(way, other_way, curve)
            if cost < (found[0] if found else 2 * FREE):
                found = cost, replace(curve, cuts_m=(curve.cuts_m[0] + cut_m, curve.cuts_m[1] + cut_m))
        return found

    def _cost(self, one: np.ndarray, other: np.ndarray, curve: Bridge) -> float:
        """Return what speaks against a curve from one way to another, given from their ends inward."""
        (tip, outward), (other_tip, other_outward) = _tip(one), _tip(other)
        gap_m = unseen_m(curve.points, self.seen)
        if gap_m > self.max_gap_m or not self._faces(tip, outward, other_tip, other_outward):
            return np.inf
        bends = np.array([-_curvature(one), _curvature(other)])
        across = other_tip - tip
        expected = bends.mean() * np.hypot(*across) / 2
        turns = np.array([_angle(outward, across), _angle(across, -other_outward)]) - expected
        # A curvature that begins or ends in the middle strays from a constant one by a 36th of its rise in STEADY_M.
        own_m = np.abs(bends).max() * STEADY_M**2 / 36
        turn = float(np.sum(turns**2)) / np.radians(TURN_DEG) ** 2
        stray = unsteadiness(one, other, STEADY_M) ** 2 / (STRAY_M**2 + own_m**2)
        return turn + stray + UNSEEN * gap_m / max(self.max_gap_m, STEP_M)

    def _faces(self, tip: np.ndarray, outward: np.ndarray, other_tip: np.ndarray, other_outward: np.ndarray) -> bool:
        """Return whether two ends point at each other."""
        across = other_tip - tip
        for way, direction in ((across, outward), (-across, other_outward)):
            ahead, aside = way @ direction, abs(way[0] * direction[1] - way[1] * direction[0])
            if ahead <= 0 or aside > ahead * self.slope + STAIRS_M:
                return False
        return True

    def chosen(self) -> list[tuple[int, int]]:
        """List the joins that together cost least."""
        free = np.where(self.is_link, HALF_USED, FREE)
        gains = {ends: free[ends[0] // 2] + free[ends[1] // 2] - cost for ends, cost in self.costs.items()}
        for number in np.flatnonzero(self.lengths < MAX_MERGED_M).tolist():
            per_m = LINK_PER_M if self.is_link[number] else PIECE_PER_M
            gains[2 * number, 2 * number + 1] = 2 * free[number] - per_m * self.lengths[number]
        return sorted(ends for ends in best_pairs(gains) if ends in self.costs)


def _joined(network: LineNetwork, joins: _Joins) -> tuple[LineNetwork, bool]:
    """Draw the joins that cost least, without the links that they replace; also returns whether there are any."""
    nodes, at_node = network.ends.ravel(), dict(ends_by_node(network))
    chosen = joins.chosen()
    taken = {end for ends in chosen for end in ends}
    unused = [number for number in np.flatnonzero(joins.is_link).tolist() if not taken & {2 * number, 2 * number + 1}]
    bridges = {ends: joins.bridges[ends] for ends in chosen if not _is_branching(network, ends, taken, unused)}
    if not bridges:
        return network, False
    cuts_m = {end: cut_m for ends, curve in bridges.items() for end, cut_m in zip(ends, curve.cuts_m)}
    for ends in sorted(bridges, key=lambda ends: -joins.costs[ends]):
        # What two joins cut off one piece, more than there is, is decided once the cheaper one is drawn.
        if any(cuts_m[end] + cuts_m.get(end ^ 1, 0.0) > joins.lengths[end // 2] for end in ends):
            del bridges[ends], cuts_m[ends[0]], cuts_m[ends[1]]
    joined = {end for ends in bridges for end in ends}
    drawn = cKDTree(np.concatenate([np.empty((0, 2)), *(curve.points for curve in bridges.values())]))
    dropped = []
    for number in unused:
        own = {2 * number, 2 * number + 1}
        is_loose = any(joined.issuperset(set(at_node[nodes[end]]) - own) for end in own)
        if is_loose and joins.lengths[number] < WING_M or _is_beside(network.lines[number], drawn):
            dropped.append(number)
    return weld_pairs(network.bridged(bridges, {}, dropped)), True


def _is_branching(network: LineNetwork, ends: tuple[int, int], taken: Collection[int], unused: Collection[int]) -> bool:
    """Return whether a join passes nodes, connected by `unused` links, in which one line continues in several.

    It leaves a single end over then, or several that all leave the line to the same side of branchings.
    """
    nodes, links = network.ends.ravel(), network.ends[list(unused)].T
    graph = coo_matrix((np.ones(len(unused)), tuple(links)), shape=(len(network.nodes),) * 2)
    place = connected_components(graph, directed=False)[1][nodes]
    here = set(np.flatnonzero(place == place[ends[0]]).tolist()) - {2 * n + side for n in unused for side in (0, 1)}
    left = sorted(here - set(taken))
    if not here.issuperset(ends) or len(here) != 2 + len(left) or len(left) < 2:
        return here.issuperset(ends) and len(here) == 3 and len(left) == 1
    onward = [float(_tip(network.from_end(end))[1] @ _tip(network.from_end(ends[0]))[1]) > 0 for end in left]
    known = {node for node, *_ in branchings(network)}
    return len(set(onward)) == 1 and known.issuperset(nodes[list(here)].tolist())


def best_pairs(gains: Mapping[tuple[int, int], float]) -> set[tuple[int, int]]:
    """Choose pairs, each number in one of them at most, whose gains have the largest sum.

    The assignment of numbers to numbers with the largest gain pairs most of them. Where it forms a ring of three or
    more instead, the best pairs with and without its best pair are compared.
    """
    chosen: set[tuple[int, int]] = set()
    for part in _parts({pair: gain for pair, gain in gains.items() if gain > 0}):
        chosen |= _best_of_part(part)
    return chosen


def _best_of_part(gains: dict[tuple[int, int], float]) -> set[tuple[int, int]]:
    numbers = sorted({number for pair in gains for number in pair})
    gain = np.zeros((len(numbers), len(numbers)))
    for pair, value in gains.items():
        row, column = np.searchsorted(numbers, pair)
        gain[row, column] = gain[column, row] = value
    _, partner = linear_sum_assignment(gain, maximize=True)
    rings = np.flatnonzero((partner[partner] != np.arange(len(numbers))) & (gain[np.arange(len(numbers)), partner] > 0))
    if not len(rings):
        return {pair for pair in gains if partner[numbers.index(pair[0])] == numbers.index(pair[1])}
    best = max(rings.tolist(), key=lambda row: gain[row, partner[row]])
    one, other = sorted((numbers[best], numbers[partner[best]]))
    others = {pair: value for pair, value in gains.items() if not {one, other} & set(pair)}
    options = best_pairs(others) | {(one, other)}, best_pairs({p: v for p, v in gains.items() if p != (one, other)})
    return max(options, key=lambda pairs: sum(gains[pair] for pair in pairs))


def _parts(gains: dict[tuple[int, int], float]) -> list[dict[tuple[int, int], float]]:
    """Split pairs into groups that share no number."""
    if not gains:
        return []
    numbers, pairs = np.unique(list(gains), return_inverse=True)
    one, other = pairs.reshape(-1, 2).T
    graph = coo_matrix((np.ones(len(one)), (one, other)), shape=(len(numbers),) * 2)
    count, part = connected_components(graph, directed=False)
    groups: list[dict[tuple[int, int], float]] = [{} for _ in range(count)]
    for (pair, gain), number in zip(gains.items(), one.tolist()):
        groups[part[number]][pair] = gain
    return groups


def unseen_m(points: np.ndarray, seen: cKDTree) -> float:
    """Measure the length of a curve away from all cells, given its points, one every `STEP_M`."""
    return STEP_M * np.count_nonzero(seen.query(points)[0] > UNSEEN_M) if len(points) else 0.0


def _is_beside(line: np.ndarray, drawn: cKDTree) -> bool:
    """Return whether most of a line is so close to bridges that these explain it, given their points."""
    return bool(drawn.n) and float(np.mean(drawn.query(even_points(line))[0] < BESIDE_M)) > BESIDE_SHARE


def _tip(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
