"""Where one rail leaves another the raster shows their mean; both are drawn back to where they part."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..rails import length_along
from .bridges import bridge, curvature
from .crossings import SKIP_M
from .ends import cut_back, stretch, turned, way_out
from .junctions import DEFLECTION_DEG, DIRECTION_M, deflections, ends_by_node
from .network import LineNetwork

FARTHEST_M = 25.0
"""Farthest that a branch is drawn back: a switch blade of 1:26.5 touches its stock rail for about so long."""

STEADY_M = 8.0
"""Stretch over which the curvature of the stem is measured: the rail that keeps it is the main one."""


def resolve_branches(network: LineNetwork, apart_m: float) -> LineNetwork:
    """Draw the rails of every branching as smooth curves from the common stem, and weld the steadier one to it.

    Parameters
    ----------
    network : LineNetwork
    apart_m : float
        Distance between two rails at which the raster shows them apart: railhead and cell together.

    Returns
    -------
    LineNetwork
        Nodes of three lines, one of which continues in both others, lie where the two begin to part.
    """
    lines, nodes, partner = list(network.lines), network.nodes.copy(), {}
    for node, stem, legs in _branchings(network):
        trunk, *rails = (turned(lines[end // 2], end) for end in (stem, *legs))
        if min(length_along(rail)[-1] for rail in rails) < SKIP_M + DIRECTION_M:
            continue
        free = [cut_back(rail, SKIP_M) for rail in rails]
        trunk = _trunk(trunk, free, apart_m)
        curves = [bridge(trunk, rail, held=True) for rail in free] if len(trunk) > 1 else [None]
        if None in curves:
            continue
        nodes[node] = trunk[0]
        lines[stem // 2] = turned(trunk, stem)
        for leg, curve, rail in zip(legs, curves, free):
            rail = cut_back(rail, curve.cuts_m[1])
            lines[leg // 2] = turned(np.concatenate([trunk[:1], curve.points, rail]), leg)
        own = curvature(stretch(trunk, STEADY_M)[::-1])
        steady = legs[int(np.argmin([abs(curve.curvature - own) for curve in curves]))]
        partner[stem], partner[steady] = steady, stem
    return LineNetwork(tuple(lines), nodes, network.ends, network.passes).weld(partner) if partner else network


def _branchings(network: LineNetwork) -> Iterator[tuple[int, int, list[int]]]:
    """List the nodes in which one line end, the stem, continues in two others, the legs."""
    for node, ends in ends_by_node(network):
        if len({end // 2 for end in ends}) == 3 == len(ends) and node not in network.passes[:, 0]:
            widest = deflections(network, ends).max(axis=1, where=~np.eye(3, dtype=bool), initial=0.0)
            stem = int(widest.argmin())
            if widest[stem] < DEFLECTION_DEG:
                yield node, ends[stem], ends[:stem] + ends[stem + 1 :]


def _trunk(stem: np.ndarray, free: list[np.ndarray], apart_m: float) -> np.ndarray:
    """Cut the stem back to where the legs begin to part; nothing is left if it is too short for that.

    The distance between rails that part on an arc grows with the square of the way x from there. At the node it is
    d = `apart_m`; their angle is seen m further on, so that angle x² = 2 d (x + m).
    """
    ways = [way_out(stretch(rail, DIRECTION_M))[1] for rail in free]
    angle = max(abs(ways[0][0] * ways[1][1] - ways[0][1] * ways[1][0]), apart_m / FARTHEST_M)
    further_m = SKIP_M + DIRECTION_M / 2
    back_m = (apart_m + np.sqrt(apart_m**2 + 2 * apart_m * further_m * angle)) / angle
    too_short = length_along(stem)[-1] < back_m + DIRECTION_M
    return stem[:0] if too_short or back_m > FARTHEST_M else cut_back(stem, back_m)
