"""Which rail runs on as which where two part or cross: the one that keeps its curvature, seen over a long way."""

from __future__ import annotations

from ..lines.network import LineNetwork
from .branches import branchings
from .steadiness import unsteadiness

ROUTE_M = 40.0
"""Stretch on either side over which curvatures are compared: at 1:26.5, the flattest turnout in use, the branch then
strays from one curvature by 18 mm, several times what the stairs of the raster leave in doubt; over 30 m by 10 mm."""

LEAST_M = 8.0
"""Shorter stretches between nodes tell no curvature."""


def choose_routes(network: LineNetwork) -> LineNetwork:
    """Let the rail that changes its curvature least run through every node in which one rail leaves another."""
    pieces, partner = network.parted()
    lengths = pieces.lengths()
    for _, stem, legs in branchings(pieces):
        if min(lengths[end // 2] for end in (stem, *legs)) < LEAST_M:
            continue
        steady = min(legs, key=lambda leg: unsteadiness(pieces.from_end(stem), pieces.from_end(leg), ROUTE_M))
        for end in (stem, *legs):
            partner.pop(end, None)
        partner[stem], partner[steady] = steady, stem
    return pieces.weld(partner)
