"""Where one rail leaves another, the raster shows their mean; both are redrawn from where they part.

See docs/method.md section 4.11.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..lines.ends import ARC, MISFIT_M, STEP_M, PartingLaw, bridge, cut_back, even_points, turned
from ..lines.network import LineNetwork
from ..polyline import length_along
from .crossings import MISFIT_M as KNOWN_MISFIT_M
from .crossings import SKIP_M
from .junctions import DEFLECTION_DEG, DIRECTION_M, deflections, ends_by_node, unsteadiness

MAX_BACK_M = 40.0
"""Largest length by which a branch is extended back: on a radius of 2500 m, as at 1:26.5, two rails are 0.2 m apart
after 32 m, and the visible part gives that length to within a quarter."""

STEADY_M = 8.0
"""Length over which the parting of two rails is measured."""

MERGED_M, MIN_LEG_M = 8.0, 8.0
"""Length of the stem of three rails in which they are merged, and shortest leg that shows which of them goes on: rails
that part on 190 m have separate heads after 7.5 m."""

ROUTE_M = 40.0
"""Length on either side over which curvatures are compared. At 1:26.5, the flattest turnout in use, the branch is then
off a constant curvature by 18 mm, several times the uncertainty from stairs; over 30 m, by 10 mm."""

MIN_LENGTH_M = 8.0
"""Shorter parts between nodes have no measurable curvature."""


def resolve_branches(network: LineNetwork) -> LineNetwork:
    """Draw both rails of every branching as smooth curves from their common stem.

    Which of them continues the stem is left open.

    Parameters
    ----------
    network : LineNetwork
        Lines without passes.

    Returns
    -------
    LineNetwork
        Nodes of three lines, one of which continues in both others, are where these two begin to part.
    """
    lines, nodes = list(network.lines), network.nodes.copy()
    for node, stem, legs in branchings(network):
        trunk, *rails = (turned(lines[end // 2], end) for end in (stem, *legs))
        if min(length_along(rail)[-1] for rail in rails) < SKIP_M + DIRECTION_M:
            continue
        trunk = _trunk(trunk, rails)
        drawn = [_drawn(trunk, rail) for rail in rails] if len(trunk) > 1 else [None]
        redrawn = [line for line in drawn if line is not None]
        if len(redrawn) < len(drawn):
            continue
        nodes[node] = trunk[0]
        lines[stem // 2] = turned(trunk, stem)
        for leg, line in zip(legs, redrawn):
            lines[leg // 2] = turned(line, leg)
    return LineNetwork(tuple(lines), nodes, network.ends, network.passes)


def free_third_rails(network: LineNetwork) -> LineNetwork:
    """Where three rails part within a few metres, draw the one that goes on straight, and let the others end freely.

    A short line then connects two branchings, too short for its direction to be measured; `attach_branches` leads the
    free rails back to the one that goes on.
    """
    freed = True
    while freed:
        freed = False
        stems = {node: (stem, legs) for node, stem, legs in branchings(network)}
        for link in np.flatnonzero(network.lengths() < SKIP_M + DIRECTION_M).tolist():
            for near, far in ((0, 1), (1, 0)):
                first, second = (stems.get(int(network.ends[link, side])) for side in (near, far))
                if first is None or second is None or second[0] != 2 * link + far or 2 * link + near not in first[1]:
                    continue
                legs = [leg for leg in first[1] if leg != 2 * link + near] + second[1]
                drawn = _third_freed(network, first[0], link, legs)
                if drawn is not None:
                    network, freed = drawn, True
                    break
            if freed:
                break
    return network


def _third_freed(network: LineNetwork, stem: int, link: int, legs: list[int]) -> LineNetwork | None:
    """Join a stem with the steadiest of three legs, and free the others; None if no rail could go on so."""
    trunk = network.from_end(stem)
    rails = {leg: cut_back(network.from_end(leg), SKIP_M) for leg in legs if network.lengths()[leg // 2] > MIN_LEG_M}
    if len(rails) < len(legs) or len({end // 2 for end in (stem, link * 2, *legs)}) < 5:
        return None
    if length_along(trunk)[-1] < MERGED_M + MIN_LEG_M:
        return None
    trunk = cut_back(trunk, MERGED_M)
    steady = min(legs, key=lambda leg: unsteadiness(trunk, rails[leg], MIN_LEG_M))
    curve = bridge(trunk, rails[steady], misfit_m=KNOWN_MISFIT_M)
    if curve is None:
        return None
    cuts_m = dict.fromkeys(legs, SKIP_M) | {stem: MERGED_M + curve.cuts_m[0], steady: SKIP_M + curve.cuts_m[1]}
    keep = np.arange(len(network.lines)) != link
    one, other = (end - 2 * (end // 2 > link) for end in (stem, steady))
    points = {one: curve.points, other: curve.points[::-1]}
    return network.cut_back(cuts_m).select(keep).weld({one: other, other: one}, points)


def branchings(network: LineNetwork) -> Iterator[tuple[int, int, list[int]]]:
    """Yield the nodes in which one line end, the stem, continues in two others, the legs."""
    for node, ends in ends_by_node(network):
        if len({end // 2 for end in ends}) == 3 == len(ends) and node not in network.passes[:, 0]:
            widest = deflections(network, ends).max(axis=1, where=~np.eye(3, dtype=bool), initial=0.0)
            stem = int(widest.argmin())
            if widest[stem] < DEFLECTION_DEG:
                yield node, ends[stem], ends[:stem] + ends[stem + 1 :]


def _trunk(stem: np.ndarray, rails: list[np.ndarray]) -> np.ndarray:
    """Cut the stem back to where the legs begin to part; no vertices if that is too far or the stem too short."""
    one, other = (even_points(cut_back(rail, SKIP_M), STEADY_M) for rail in rails)
    count = min(len(one), len(other))
    apart_m = np.hypot(*(one[:count] - other[:count]).T)
    law = PartingLaw.fitted(SKIP_M + STEP_M * np.arange(count), apart_m, ARC)
    back_m = -law.way_at(MISFIT_M)
    too_short = length_along(stem)[-1] < back_m + DIRECTION_M
    if too_short or not 0 < back_m < MAX_BACK_M:
        return stem[:0]
    return cut_back(stem, back_m)


def _drawn(trunk: np.ndarray, rail: np.ndarray) -> np.ndarray | None:
    """Draw a leg from the end of the stem on, by a bridge to its free part; None if there is no bridge."""
    free = cut_back(rail, SKIP_M)
    curve = bridge(trunk, free, held=True, misfit_m=KNOWN_MISFIT_M)
    if curve is None:
        return None
    return np.concatenate([trunk[:1], curve.points, cut_back(free, curve.cuts_m[1])])


def choose_routes(network: LineNetwork) -> LineNetwork:
    """Let the rail whose curvature changes least pass through each node in which one rail leaves another."""
    pieces, partner = network.parted()
    lengths = pieces.lengths()
    for _, stem, legs in branchings(pieces):
        if min(lengths[end // 2] for end in (stem, *legs)) < MIN_LENGTH_M:
            continue
        scores = [unsteadiness(pieces.from_end(stem), pieces.from_end(leg), ROUTE_M) for leg in legs]
        steady = legs[scores.index(min(scores))]
        for end in (stem, *legs):
            partner.pop(end, None)
        partner[stem], partner[steady] = steady, stem
    return pieces.weld(partner)
