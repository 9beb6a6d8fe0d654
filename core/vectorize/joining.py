"""Rail ends that face each other across a gap are joined by a curve a rail could follow."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .bridges import STAIRS_M, Bridge, bridge
from .crossings import MERGED_M
from .ends import STEP_M, cut_back, stretch, way_out
from .network import LineNetwork

DIRECTION_M = 2.0
"""Stretch over which an end's direction is measured; the stairs of a raster line are up to this long."""

HOOK_M = 1.0
"""Length over which weeds and other rails bend the end of a line aside; its direction is tried with and without."""

SHORTEST_M = 0.25
"""Shorter pieces have no direction and join nothing."""


UNSEEN_M = 0.10
"""A place this far from any cell has no points of its rail, nor of one that it is merged with."""


def join_gaps(
    network: LineNetwork, max_gap_m: float, gap_angle_deg: float, seen: cKDTree | None = None, at_nodes: bool = True
) -> LineNetwork:
    """Join ends that face each other, both within `gap_angle_deg` of the way across, at most `max_gap_m` apart.

    At least one of the two is free; the other may end in a node, as at a frog that was taken for a branching, unless
    `at_nodes` is false. Joins happen in rounds, each end with the partner that costs least, for a joined line shows
    better where it leads.

    Parameters
    ----------
    network : LineNetwork
    max_gap_m, gap_angle_deg : float
    seen : cKDTree, optional
        Places of rail cells. Ends up to `MERGED_M` apart are joined too, if no more than `max_gap_m` of the way lies
        far from these: where rails merge, an end is not a gap.
    at_nodes : bool
    """
    while True:
        joins = _possible_joins(network, max_gap_m, gap_angle_deg, seen, at_nodes)
        best: dict[int, tuple[int, int]] = {}
        for ends in sorted(joins, key=lambda ends: (joins[ends].cost, ends), reverse=True):
            best[ends[0]] = best[ends[1]] = ends
        partner, bridges, cuts_m = {}, {}, {}
        for one, other in (ends for ends in joins if best[ends[0]] == best[ends[1]] == ends):
            partner[one], partner[other] = other, one
            cuts_m[one], cuts_m[other] = joins[one, other].cuts_m
            bridges[one], bridges[other] = joins[one, other].points, joins[one, other].points[::-1]
        if not partner:
            return network
        network = network.cut_back(cuts_m).weld(partner, bridges)


def _possible_joins(
    network: LineNetwork, max_gap_m: float, gap_angle_deg: float, seen: cKDTree | None, at_nodes: bool
) -> dict[tuple[int, int], Bridge]:
    """Find every pair of ends that could be joined."""
    degrees = network.degrees()[network.ends.ravel()]
    free = np.flatnonzero(degrees != 2) if at_nodes else np.flatnonzero(degrees == 1)
    free = free[network.lengths()[free // 2] >= SHORTEST_M]
    if len(free) < 2:
        return {}
    tips, outward = _ways(network, free, 0.0)
    straight_tips, straight = _ways(network, free, HOOK_M)
    reach_m = max_gap_m if seen is None else max(max_gap_m, MERGED_M)
    pairs = cKDTree(tips).query_pairs(reach_m, output_type="ndarray")
    pairs = pairs[(degrees[free[pairs]] == 1).any(axis=1)]
    facing = np.ones(len(pairs), dtype=bool)
    for order in (pairs, pairs[:, ::-1]):
        facing &= faces(tips, outward, order, gap_angle_deg) | faces(straight_tips, straight, order, gap_angle_deg)
    tried = {
        (one, other): bridge(network.from_end(one), network.from_end(other))
        for one, other in free[pairs[facing]].tolist()
    }
    return {
        ends: found
        for ends, found in tried.items()
        if found is not None and (seen is None or unseen_m(found.points, seen) <= max_gap_m)
    }


def _ways(network: LineNetwork, ends: np.ndarray, hook_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Tips and unit vectors out of line ends, (k, 2) each, the last `hook_m` of longer lines left out of account."""
    tips, outward = [], []
    lengths = network.lengths()
    for end in ends.tolist():
        line = network.from_end(end)
        cut_m = hook_m if lengths[end // 2] > hook_m + DIRECTION_M else 0.0
        tip, way = way_out(stretch(cut_back(line, cut_m), DIRECTION_M))
        tips.append(tip + cut_m * way)
        outward.append(way)
    return np.array(tips), np.array(outward)


def unseen_m(points: np.ndarray, seen: cKDTree) -> float:
    """Length of a curve's points, one every `STEP_M`, that lie far from all cells."""
    return STEP_M * np.count_nonzero(seen.query(points)[0] > UNSEEN_M) if len(points) else 0.0


def faces(tips: np.ndarray, outward: np.ndarray, pairs: np.ndarray, angle_deg: float) -> np.ndarray:
    """Tell for which pairs the second tip lies within the fan before the first.

    Parameters
    ----------
    tips, outward : (k, 2) arrays
        Line ends and the unit vectors out of the lines there.
    pairs : (n, 2) int array
    angle_deg : float
        Half of the fan's opening.

    Returns
    -------
    (n,) bool array
    """
    across = tips[pairs[:, 1]] - tips[pairs[:, 0]]
    way = outward[pairs[:, 0]]
    ahead = (across * way).sum(axis=1)
    aside = np.abs(across[:, 0] * way[:, 1] - across[:, 1] * way[:, 0])
    return (ahead > 0) & (aside <= ahead * np.tan(np.radians(angle_deg)) + STAIRS_M)
