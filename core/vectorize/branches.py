"""Where one rail leaves another the raster shows their mean; both are drawn back to where they part."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..lines.bridges import MISFIT_M, STAIRS_M, bridge, curvature
from ..lines.ends import STEP_M, cut_back, stretch, turned
from ..lines.network import LineNetwork
from ..lines.parting import ARC, PartingLaw
from ..polyline import length_along
from .crossings import MISFIT_M as KNOWN_MISFIT_M
from .crossings import SKIP_M
from .junctions import DEFLECTION_DEG, DIRECTION_M, deflections, ends_by_node

FARTHEST_M = 40.0
"""Farthest that a branch is drawn back: on 2500 m of radius, as at 1:26.5, two rails are 0.2 m apart after 32 m, and
what is seen of them tells that length to a quarter."""

STEADY_M = 8.0
"""Stretch of two rails over which is measured how they part."""

SHARPER = 2.0
UNSURE_CURVATURE = 16 * STAIRS_M / STEADY_M**2
"""A branch begins on the arc that it goes on with: no more bent than so many times what is seen of it, and what stairs
at both ends of that stretch may hide. This tells switches from frogs."""


def resolve_branches(network: LineNetwork) -> LineNetwork:
    """Draw the rails of every branching as smooth curves from the common stem; which runs on is left open.

    Returns
    -------
    LineNetwork
        Nodes of three lines, one of which continues in both others, lie where the two begin to part.
    """
    lines, nodes = list(network.lines), network.nodes.copy()
    for node, stem, legs in branchings(network):
        trunk, *rails = (turned(lines[end // 2], end) for end in (stem, *legs))
        if min(length_along(rail)[-1] for rail in rails) < SKIP_M + DIRECTION_M:
            continue
        free = [cut_back(rail, SKIP_M) for rail in rails]
        trunk = _trunk(trunk, rails)
        curves = (
            [bridge(trunk, rail, held=True, misfit_m=KNOWN_MISFIT_M) for rail in free] if len(trunk) > 1 else [None]
        )
        if None in curves:
            continue
        nodes[node] = trunk[0]
        lines[stem // 2] = turned(trunk, stem)
        for leg, curve, rail in zip(legs, curves, free):
            rail = cut_back(rail, curve.cuts_m[1])
            lines[leg // 2] = turned(np.concatenate([trunk[:1], curve.points, rail]), leg)
    return LineNetwork(tuple(lines), nodes, network.ends, network.passes)


def branchings(network: LineNetwork) -> Iterator[tuple[int, int, list[int]]]:
    """List the nodes in which one line end, the stem, continues in two others, the legs."""
    for node, ends in ends_by_node(network):
        if len({end // 2 for end in ends}) == 3 == len(ends) and node not in network.passes[:, 0]:
            widest = deflections(network, ends).max(axis=1, where=~np.eye(3, dtype=bool), initial=0.0)
            stem = int(widest.argmin())
            if widest[stem] < DEFLECTION_DEG:
                yield node, ends[stem], ends[:stem] + ends[stem + 1 :]


def _trunk(stem: np.ndarray, rails: list[np.ndarray]) -> np.ndarray:
    """Cut the stem back to where the legs begin to part; nothing is left if that is too far, or the stem too short."""
    one, other = (stretch(cut_back(rail, SKIP_M), STEADY_M) for rail in rails)
    count = min(len(one), len(other))
    apart_m = np.hypot(*(one[:count] - other[:count]).T)
    law = PartingLaw.fitted(SKIP_M + STEP_M * np.arange(count), apart_m, ARC)
    back_m = -law.way_at(MISFIT_M)
    too_short = length_along(stem)[-1] < back_m + DIRECTION_M
    if too_short or not 0 < back_m < FARTHEST_M or law.curvature > sharpest(curvature(one) - curvature(other)):
        return stem[:0]
    return cut_back(stem, back_m)


def sharpest(seen: float) -> float:
    """Tell how sharply rails may bend apart where they merge if beyond they bend apart by `seen`, 1/m both."""
    return SHARPER * abs(seen) + UNSURE_CURVATURE
