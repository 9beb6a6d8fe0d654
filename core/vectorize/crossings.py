"""Rails that cross at a small angle share a stretch of raster; it is taken apart into two rails again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial import cKDTree

from .bridges import Bridge, bridge
from .ends import cut_back, turned
from .junctions import ends_by_node
from .network import LineNetwork

MERGED_M = 14.0
"""Longest stretch that two crossing rails share: heads of 76 mm in cells of 40 mm do so for 9 m at 1:26.5, and wing
rails lengthen it at both ends."""

SKIP_M = 0.5
"""Length of a rail next to the shared stretch that is still drawn aside by the other one."""

MISFIT_M = 0.015
"""Legs of a crossing may stray further from a curve than ends across a gap: wing rails widen them, and four of them
that meet are known to belong together."""

_PAIRINGS = (((0, 2), (1, 3)), ((0, 3), (1, 2)), ((0, 1), (2, 3)))


def resolve_crossings(network: LineNetwork) -> LineNetwork:
    """Draw two rails through every stretch shared by two crossing ones, each a smooth curve between its own free parts.

    A crossing is a node of four lines, or a short line between two nodes of three, or a node of three whose fourth leg
    ends free before it, as flangeways of frogs cut it off. It is resolved if its four legs make two pairs that rails
    could follow; the rails then cross without a node.
    """
    lines, ends, nodes = list(network.lines), network.ends.copy(), list(network.nodes)
    keep = np.ones(len(lines), dtype=bool)
    joins: dict[tuple[int, int], Bridge] = {}
    for shared, legs in _crossings(network):
        pairing = _best_pairing(network, legs)
        if not pairing or any(end in taken for taken in joins for end in legs):
            continue
        joins.update(pairing)
        keep[shared] = False
        more_m = {end: cut for ends, found in pairing.items() for end, cut in zip(ends, found.cuts_m)}
        for end in legs:
            free = cut_back(turned(lines[end // 2], end), SKIP_M + more_m[end])
            lines[end // 2] = turned(free, end)
            ends.flat[end] = len(nodes)
            nodes.append(free[0])
    if not joins:
        return network
    number = np.cumsum(keep) - 1
    partner, bridges = {}, {}
    for (one, other), found in joins.items():
        one, other = (2 * int(number[end // 2]) + end % 2 for end in (one, other))
        partner[one], partner[other] = other, one
        bridges[one], bridges[other] = found.points, found.points[::-1]
    return LineNetwork(tuple(lines), np.array(nodes), ends).select(keep).weld(partner, bridges)


def _crossings(network: LineNetwork) -> Iterator[tuple[list[int], list[int]]]:
    """List the shared lines (one or none) and the four legs of every possible crossing, the most certain ones first."""
    lengths, degrees, at_node = network.lengths(), network.degrees(), dict(ends_by_node(network))
    places = [([], [node]) for node in np.flatnonzero(degrees == 4).tolist()]
    shared = np.flatnonzero((degrees[network.ends] == 3).all(axis=1) & (lengths < MERGED_M))
    places += [([line], network.ends[line].tolist()) for line in shared[np.argsort(lengths[shared])].tolist()]
    candidates = [
        (lines, [end for node in nodes for end in at_node[node] if end // 2 not in lines]) for lines, nodes in places
    ]
    candidates += [([], [*at_node[node], free]) for node, free in _cut_off(network)]
    for lines, legs in candidates:
        if len({end // 2 for end in legs}) == 4 and lengths[[end // 2 for end in legs]].min() > 3 * SKIP_M:
            yield lines, legs


def _cut_off(network: LineNetwork) -> list[tuple[int, int]]:
    """List the nodes of three lines and the free ends near them, nearest first, that all three lines reach beyond."""
    lengths, degrees, at_node = network.lengths(), network.degrees(), dict(ends_by_node(network))
    free, forks = np.flatnonzero(degrees == 1), np.flatnonzero(degrees == 3)
    if not len(free) or not len(forks):
        return []
    near = cKDTree(network.nodes[forks]).sparse_distance_matrix(
        cKDTree(network.nodes[free]), MERGED_M, output_type="coo_matrix"
    )
    found = []
    for fork, tip, distance_m in sorted(
        zip(near.row.tolist(), near.col.tolist(), near.data.tolist()), key=lambda f: f[2]
    ):
        node = int(forks[fork])
        if min(lengths[end // 2] for end in at_node[node]) > distance_m:
            found.append((node, at_node[int(free[tip])][0]))
    return found


def _best_pairing(network: LineNetwork, legs: Sequence[int]) -> dict[tuple[int, int], Bridge]:
    """Find the cheapest way of running two rails through four legs; empty if there is none."""
    cut = {end: cut_back(network.from_end(end), SKIP_M) for end in legs}
    options = []
    for pairing in _PAIRINGS:
        ends = [(legs[first], legs[second]) for first, second in pairing]
        found = {(one, other): bridge(cut[one], cut[other], misfit_m=MISFIT_M) for one, other in ends}
        if None not in found.values():
            options.append(found)
    return min(options, key=lambda found: sum(join.cost for join in found.values()), default={})
