"""Which leg of a branching continues the stem: the one that keeps its curvature (docs/method.md section 4.13)."""

from __future__ import annotations

from ..lines.network import LineNetwork
from .branches import branchings
from .steadiness import unsteadiness

ROUTE_M = 40.0
"""Length on either side over which curvatures are compared. At 1:26.5, the flattest turnout in use, the branch is then
off a constant curvature by 18 mm, several times the uncertainty from stairs; over 30 m, by 10 mm."""

MIN_LENGTH_M = 8.0
"""Shorter parts between nodes have no measurable curvature."""


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
