"""Rail ends that face each other across a gap are joined by a curve a rail could follow."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .bridges import STAIRS_M, Bridge, bridge
from .ends import stretch, way_out
from .network import LineNetwork

DIRECTION_M = 2.0
"""Stretch over which an end's direction is measured; the stairs of a raster line are up to this long."""

SHORTEST_M = 0.25
"""Shorter pieces have no direction and join nothing."""


def join_gaps(network: LineNetwork, max_gap_m: float, gap_angle_deg: float) -> LineNetwork:
    """Join free ends that face each other, both within `gap_angle_deg` of the way across, at most `max_gap_m` apart.

    Joins happen in rounds, each end with the partner that costs least, for a joined line shows better where it leads.
    """
    while True:
        joins = _possible_joins(network, max_gap_m, gap_angle_deg)
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


def _possible_joins(network: LineNetwork, max_gap_m: float, gap_angle_deg: float) -> dict[tuple[int, int], Bridge]:
    """Find every pair of free ends that could be joined."""
    free = np.flatnonzero(network.degrees()[network.ends.ravel()] == 1)
    free = free[network.lengths()[free // 2] >= SHORTEST_M]
    if len(free) < 2:
        return {}
    ways = [way_out(stretch(network.from_end(end), DIRECTION_M)) for end in free]
    tips, outward = (np.array(part) for part in zip(*ways))
    pairs = cKDTree(tips).query_pairs(max_gap_m, output_type="ndarray")
    facing = faces(tips, outward, pairs, gap_angle_deg) & faces(tips, outward, pairs[:, ::-1], gap_angle_deg)
    tried = {
        (one, other): bridge(network.from_end(one), network.from_end(other))
        for one, other in free[pairs[facing]].tolist()
    }
    return {ends: found for ends, found in tried.items() if found is not None}


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
