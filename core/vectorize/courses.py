"""Rails keep their courses: of all ways to continue lines through junctions and across gaps, the steadiest is drawn.

See docs/method.md section 4.8.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment
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
from .junctions import DIRECTION_M, drop_spurs, ends_by_node, unsteadiness, weld_pairs

MAX_MERGED_M = 14.0
"""Largest length that two crossing rails share. Heads of 76 mm in cells of 40 mm share 9 m at 1:26.5, and wing rails
lengthen it at both ends."""

SKIP_M = 0.5
"""Length of a rail next to a shared part that the other rail still draws aside."""

CUTS_M = (0.0, SKIP_M, 1.0, 2.0, 3.0)
"""Lengths cut off both ends before they are joined. Weeds, guard rails and wing rails draw ends aside for up to 3 m,
even until two ends overlap side by side."""

MISFIT_M = 0.015
"""Misfit allowed to the lines that a rail continues, larger than that of ends in open track: wing rails widen lines."""

MIN_PIECE_M = 0.3
"""Shorter pieces have no direction and are not joined."""

LINK_M = 3.0
"""A shorter piece between two junctions or bends may be none of any rail: a rung, a swerve, or the mouth of a wing
rail. A spur up to this length that no rail continues is a wing rail."""

UNSEEN_M = 0.10
"""A place this far from all cells shows neither its rail nor one that is merged with it."""

STEADY_M = 8.0
"""Length of line on either side of a join that is to be of one curvature."""

STAIRS_LENGTH_M = 1.0
"""Shorter parts of a line show the direction of stairs."""

STRAY_M = 0.012
"""Standard error of a steady line: places of a rail are anywhere in cells of 0.04 m, which is 0.04 m / √12 rms."""

TURN_DEG = 4.0
"""Standard error of the directions of two ends against the way across: wing rails bend them by about as much."""

FREE = 4.0
"""Cost of an end that is not continued, in squares of standard errors: a join of two ends costs less up to √8 of them,
34 mm off one curve."""

JOIN, CUT_PER_M, UNSEEN = 0.5, 0.3, 2.0
"""Further costs of a join: of having one, so that two rails are not drawn with three; of each metre that is cut off;
and of a part without cells that is as long as the longest gap."""

BESIDE_M = 0.2
BESIDE_SHARE = 0.7
"""A link is left out of the drawing if more of it than this is within `UNSEEN_M` of the joins that replace it."""

LINK_PER_M = 0.8
"""Cost of each metre of a link that is left out: the shared part of two rails that cross at 1:9 costs about as much as
a join."""


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
            return drop_spurs(weld_pairs(network), LINK_M)


class _Joins:
    """The possible joins of a network: the least cost and the bridge of each pair of ends, and which pieces are links.

    A link is a short piece between two junctions or bends, or a longer one between two junctions that two rails may
    share.
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
        tips = self.network.nodes[self.network.ends.ravel()[ends]]
        outward = np.array([_tip(self.network.from_end(end))[1] for end in ends.tolist()])
        pairs = cKDTree(tips).query_pairs(max(self.max_gap_m, MAX_MERGED_M), output_type="ndarray")
        opposite = (outward[pairs[:, 0]] * outward[pairs[:, 1]]).sum(axis=1) < -np.cos(2 * np.arctan(self.slope))
        pairs = np.sort(ends[pairs[opposite]], axis=1)
        nodes = self.network.ends.ravel()
        closes = (self.lengths >= MAX_MERGED_M) & (nodes[::2] != nodes[1::2])
        pairs = pairs[(pairs[:, 0] // 2 != pairs[:, 1] // 2) | closes[pairs[:, 0] // 2]]
        return [(one, other) for one, other in sorted(pairs.tolist())]

    def _cheapest(self, one: int, other: int) -> tuple[float, Bridge] | None:
        """Find the cut of two ends at which joining them costs least; None if no rail could run so, or ends may be."""
        found: tuple[float, Bridge] | None = None
        shortest_m = min(self.lengths[one // 2], self.lengths[other // 2])
        for cut_m in CUTS_M:
            if cut_m > 0 and shortest_m < cut_m + 2 * SKIP_M:
                break
            ways = [cut_back(self.network.from_end(end), cut_m) for end in (one, other)]
            # A curve that replaces bent ends must not swerve to a rail beside them.
            transition_m = TRANSITION_M if cut_m <= SKIP_M else STEADY_TRANSITION_M
            curve = bridge(*ways, misfit_m=MISFIT_M, transition_m=transition_m)
            cost = np.inf if curve is None else JOIN + CUT_PER_M * cut_m + self._cost(ways[0], ways[1], curve)
            if curve is not None and cost < (found[0] if found else 2 * FREE):
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
        gains = {ends: 2 * FREE - cost for ends, cost in self.costs.items()}
        for number in np.flatnonzero(self.lengths < MAX_MERGED_M).tolist():
            gains[2 * number, 2 * number + 1] = 2 * FREE - LINK_PER_M * self.lengths[number]
        return sorted(ends for ends in best_pairs(gains) if ends in self.costs)


def _joined(network: LineNetwork, joins: _Joins) -> tuple[LineNetwork, bool]:
    """Draw the joins that cost least, without the links that they replace; also returns whether there are any."""
    degrees, nodes, at_node = network.degrees(), network.ends.ravel(), dict(ends_by_node(network))
    chosen = joins.chosen()
    taken = {end for ends in chosen for end in ends}
    bridges = {}
    for one, other in chosen:
        node = nodes[one]
        is_branching = node == nodes[other] and degrees[node] == 3 and len(taken.intersection(at_node[node])) == 2
        if not is_branching:
            bridges[one, other] = joins.bridges[one, other]
    if not bridges:
        return network, False
    joined = {end for ends in bridges for end in ends}
    drawn = cKDTree(np.concatenate([np.empty((0, 2)), *(curve.points for curve in bridges.values())]))
    dropped = []
    for number in np.flatnonzero(joins.is_link).tolist():
        own = {2 * number, 2 * number + 1}
        is_loose = any(joined.issuperset(set(at_node[nodes[end]]) - own) for end in own)
        is_short = joins.lengths[number] < LINK_M
        if not own & taken and (is_loose and is_short or _is_beside(network.lines[number], drawn)):
            dropped.append(number)
    return weld_pairs(network.bridged(bridges, {}, dropped)), True


def best_pairs(gains: Mapping[tuple[int, int], float]) -> set[tuple[int, int]]:
    """Choose pairs, each number in one of them at most, whose gains have the largest sum.

    This is an assignment of numbers to numbers in which most are each other's. Of longer rings, every other pair is
    taken, the best ones first, which may miss the largest sum by a little.
    """
    numbers = sorted({number for pair in gains for number in pair})
    place = {number: row for row, number in enumerate(numbers)}
    gain = np.full((len(numbers), len(numbers)), -1e9)
    np.fill_diagonal(gain, 0.0)
    for (one, other), value in gains.items():
        gain[place[one], place[other]] = gain[place[other], place[one]] = value
    rows, columns = linear_sum_assignment(gain, maximize=True)
    pairs: set[tuple[int, int]] = set()
    taken: set[int] = set()
    for row, column in sorted(zip(rows.tolist(), columns.tolist()), key=lambda pair: (-gain[pair], pair)):
        if row != column and gain[row, column] > 0 and not taken & {row, column}:
            taken |= {row, column}
            pairs.add((numbers[min(row, column)], numbers[max(row, column)]))
    return pairs


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
