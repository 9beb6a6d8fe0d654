"""Rails that cross at a small angle share part of the raster; it is separated into two rails again.

See docs/method.md section 4.9.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..lines.ends import Bridge, bridge, cut_back, even_points, tip_and_direction
from ..lines.network import LineNetwork
from .junctions import DIRECTION_M, ends_by_node, weld_pairs

MAX_MERGED_M = 14.0
"""Largest length that two crossing rails share. Heads of 76 mm in cells of 40 mm share 9 m at 1:26.5, and wing rails
lengthen it at both ends."""

TANGLE_M = 2.5
"""Largest distance from one node of a frog to the next: that of a wing rail's mouth from the tip of the nose at 1:9."""

SKIP_M = 0.5
"""Length of a rail next to the shared part that the other rail still draws aside."""

MISFIT_M = 0.015
"""Misfit allowed to the legs of a crossing. It is larger than across gaps because wing rails widen the legs, and
because four legs that meet are known to belong together."""

WINGS_M = (0.0, 1.0, 2.0, 3.0)
"""Further lengths cut off all legs before they are paired, in this order: wing rails run beside the rails for up to 3 m
on the side of the nose, and where they hide it from a scanner, legs are drawn along them."""

BESIDE_M = 0.4
"""Largest distance of a leg that a flangeway cuts off from the rail that crosses it: two half heads and a flangeway are
0.14 m, and 2.5 m (`TANGLE_M`) of a rail at 1:9 are 0.28 m aside."""

_PAIRINGS = (((0, 2), (1, 3)), ((0, 3), (1, 2)), ((0, 1), (2, 3)))


def resolve_crossings(network: LineNetwork) -> LineNetwork:
    """Draw two rails through every part that two crossing rails share, each a smooth curve between its own free parts.

    A crossing is a node of four lines; or a short line between two nodes of three; or a node of three whose fourth leg
    ends freely before it, because a flangeway of the frog cuts it off; or several nodes and ends close together, which
    four legs leave; or a line beside which two free ends face each other, because flangeways cut off two legs. It is
    resolved if its four legs form two pairs that rails could follow. The rails then cross without a node; the network
    has no passes before.
    """
    joins: dict[tuple[int, int], Bridge] = {}
    cuts_m: dict[int, float] = {}
    dropped: list[int] = []
    network, facing = _cut_beside_ends(network)
    for shared, legs in (*_crossings(network), *facing):
        pairing = _best_pairing(network, legs)
        # The first two legs leave one end of a shared line: as one rail, they would leave the line to none.
        crosses = len(shared) != 1 or tuple(legs)[:2] not in pairing
        if pairing and crosses and not any(end in cuts_m for end in legs):
            joins.update(pairing)
            cuts_m.update(legs)
            dropped += shared
    return weld_pairs(network.bridged(joins, cuts_m, dropped))


def _cut_beside_ends(network: LineNetwork) -> tuple[LineNetwork, list[tuple[list[int], dict[int, float]]]]:
    """Cut lines beside which two free ends face each other, both on one side, at the feet of these.

    Where two rails cross, such a line is the one of them as far as the first foot and the other one from the second
    foot on. Also returns the shared part of each crossing and its four legs, those of the line first: without a
    crossing they are one rail.
    """
    nodes, passes, facing = list(network.nodes), [], []
    for number, vertices, tips in _beside_ends(network):
        feet = [len(nodes), len(nodes) + 1]
        nodes += list(network.lines[number][vertices])
        passes += [(node, number, vertex) for node, vertex in zip(feet, vertices)]
        facing.append((feet, tips))
    if not facing:
        return network, []
    cut, _ = replace(network, nodes=np.array(nodes), passes=np.array(passes)).parted()
    at_node, lengths = dict(ends_by_node(cut)), cut.lengths()
    crossings = []
    for feet, tips in facing:
        shared = set.intersection(*({end // 2 for end in at_node[node]} for node in feet))
        ends = [end for node in (*feet, *tips) for end in at_node[node] if end // 2 not in shared]
        legs = dict.fromkeys(ends, SKIP_M)
        if len(shared) == 1 and _are_legs(lengths, legs):
            crossings.append((sorted(shared), legs))
    return cut, crossings


def _beside_ends(network: LineNetwork) -> Iterator[tuple[int, list[int], list[int]]]:
    """Yield lines beside two free ends that face each other: number, vertices at the feet in order, and their nodes."""
    free = np.flatnonzero(network.degrees()[network.ends.ravel()] == 1)
    if len(free) < 2:
        return
    tips = [tip_and_direction(even_points(network.from_end(end), DIRECTION_M)) for end in free.tolist()]
    places, outward = (np.array(one) for one in zip(*tips))
    near = sorted(cKDTree(places).query_pairs(MAX_MERGED_M))
    across = {(one, other): places[other] - places[one] for one, other in near}
    facing = [pair for pair, way in across.items() if way @ outward[pair[0]] >= 0 >= way @ outward[pair[1]]]
    feet = _feet(network, places) if facing else []
    for one, other in facing:
        for number in sorted((feet[one].keys() & feet[other].keys()) - {int(free[one]) // 2, int(free[other]) // 2}):
            line = network.lines[number]
            first, last = feet[one][number], feet[other][number]
            along, aside = line[last] - line[first], places[[one, other]] - line[[first, last]]
            left = along[0] * aside[:, 1] - along[1] * aside[:, 0]
            if first != last and left[0] * left[1] > 0:
                step = 1 if first < last else -1
                yield number, [first, last][::step], network.ends.flat[free[[one, other]]][::step].tolist()


def _feet(network: LineNetwork, places: np.ndarray) -> list[dict[int, int]]:
    """Return for each place, (n, 2), the nearest vertex, within `BESIDE_M`, of each line inside its ends."""
    inside = [np.arange(1, len(line) - 1) for line in network.lines]
    number, vertex = np.repeat(np.arange(len(inside)), [len(own) for own in inside]), np.concatenate(inside)
    xy = np.concatenate([line[own] for line, own in zip(network.lines, inside)])
    found = []
    for place, near in zip(places, cKDTree(xy).query_ball_point(places, BESIDE_M)):
        farthest_first = sorted(near, key=lambda one: -float(np.hypot(*(xy[one] - place))))
        found.append({int(number[one]): int(vertex[one]) for one in farthest_first})
    return found


def _crossings(network: LineNetwork) -> Iterator[tuple[list[int], dict[int, float]]]:
    """Yield the shared lines (one or none) and the four legs of every possible crossing, the most certain ones first.

    The value of each leg is the length of it next to the crossing that does not belong to its rail alone.
    """
    lengths, degrees, at_node = network.lengths(), network.degrees(), dict(ends_by_node(network))
    places: list[tuple[list[int], list[int]]] = [([], [node]) for node in np.flatnonzero(degrees == 4).tolist()]
    shared = np.flatnonzero((degrees[network.ends] == 3).all(axis=1) & (lengths < MAX_MERGED_M))
    places += [([line], network.ends[line].tolist()) for line in shared[np.argsort(lengths[shared])].tolist()]
    crossings = [
        (lines, {end: SKIP_M for node in nodes for end in at_node[node] if end // 2 not in lines})
        for lines, nodes in places
    ]
    crossings += [([], legs) for legs in _cut_off(network)] + list(_tangled(network))
    for lines, legs in crossings:
        if _are_legs(lengths, legs):
            yield lines, legs


def _are_legs(lengths: np.ndarray, legs: Mapping[int, float]) -> bool:
    """Return whether these are ends of four different lines, long enough to show where their rails run."""
    least_m = {end // 2: max(3 * SKIP_M, skip_m + SKIP_M) for end, skip_m in legs.items()}
    return len(legs) == len(least_m) == 4 and all(lengths[line] > length_m for line, length_m in least_m.items())


def _tangled(network: LineNetwork) -> Iterator[tuple[list[int], dict[int, float]]]:
    """Yield the crossings whose wing rails, flangeways and nose are several nodes in the raster: four legs leave them.

    Such nodes, and ends, are at most `TANGLE_M` from the next one.
    """
    lengths = network.lengths()
    nodes = np.flatnonzero(network.degrees() != 2)
    if not len(nodes):
        return
    tree = cKDTree(network.nodes[nodes])
    near = tree.sparse_distance_matrix(tree, TANGLE_M, output_type="coo_matrix")
    tangle = np.full(len(network.nodes), -1)
    tangle[nodes] = connected_components(near, directed=False)[1]
    own = tangle[network.ends]
    within = (own[:, 0] == own[:, 1]) & (own[:, 0] >= 0) & (lengths < MAX_MERGED_M)
    for number in np.flatnonzero(np.bincount(own[within, 0], minlength=1) > 1).tolist():
        legs = np.flatnonzero((own.ravel() == number) & ~np.repeat(within, 2))
        yield np.flatnonzero(within & (own[:, 0] == number)).tolist(), dict.fromkeys(legs.tolist(), SKIP_M)


def _cut_off(network: LineNetwork) -> list[dict[int, float]]:
    """List the crossings to which a flangeway leaves only three legs, with every free end that may be the fourth.

    The leg towards the free end is shared up to that end. Nearer free ends come first.
    """
    degrees, at_node = network.degrees(), dict(ends_by_node(network))
    free, forks = np.flatnonzero(degrees == 1), np.flatnonzero(degrees == 3)
    if not len(free) or not len(forks):
        return []
    near = cKDTree(network.nodes[forks]).sparse_distance_matrix(
        cKDTree(network.nodes[free]), MAX_MERGED_M, output_type="coo_matrix"
    )
    found = []
    for fork, tip in np.column_stack([near.row, near.col])[np.argsort(near.data, kind="stable")].tolist():
        legs, across = at_node[int(forks[fork])], network.nodes[free[tip]] - network.nodes[forks[fork]]
        reach_m = float(np.hypot(*across))
        ways = [
            even_points(network.from_end(end), max(reach_m, SKIP_M))[-1] - network.nodes[forks[fork]] for end in legs
        ]
        stem = legs[int(np.argmax([way @ across for way in ways]))]
        found.append({**dict.fromkeys(legs, SKIP_M), stem: reach_m + SKIP_M, at_node[int(free[tip])][0]: SKIP_M})
    return found


def _best_pairing(network: LineNetwork, legs: Mapping[int, float]) -> dict[tuple[int, int], Bridge]:
    """Connect four legs in the two pairs that turn least; empty if no rails could follow.

    Rails that continued as each other would turn by the angle at which they cross, both.
    """
    lengths = network.lengths()
    shortest_m = min(lengths[end // 2] - skip_m for end, skip_m in legs.items())
    options = [
        option
        for wing_m in WINGS_M
        if wing_m == 0 or shortest_m > wing_m + DIRECTION_M
        for option in _options(network, {end: skip_m + wing_m for end, skip_m in legs.items()}, wing_m)
    ]
    if not options:
        return {}
    _, straightest = min(options, key=lambda option: option[0])
    return next(bridges for _, bridges in options if bridges.keys() == straightest.keys())


def _options(
    network: LineNetwork, legs: Mapping[int, float], wing_m: float
) -> Iterator[tuple[float, dict[tuple[int, int], Bridge]]]:
    """Yield each way to connect four legs in two pairs that rails could follow, with the sum of its squared turns."""
    cut = {end: cut_back(network.from_end(end), skip_m) for end, skip_m in legs.items()}
    tips = {end: tip_and_direction(even_points(way, DIRECTION_M)) for end, way in cut.items()}
    ends = list(legs)
    for (a, b), (c, d) in _PAIRINGS:
        pairs = (ends[a], ends[b]), (ends[c], ends[d])
        found = {pair: bridge(cut[pair[0]], cut[pair[1]], misfit_m=MISFIT_M) for pair in pairs}
        bridges = {
            pair: replace(curve, cuts_m=(curve.cuts_m[0] + wing_m, curve.cuts_m[1] + wing_m))
            for pair, curve in found.items()
            if curve is not None
        }
        if len(bridges) == len(pairs):
            yield sum(_turn(tips[one], tips[other]) for one, other in pairs), bridges


def _turn(one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> float:
    """Sum the squared turns, as chords, from one end to the other and on into it, given their tips and directions."""
    (tip, outward), (other_tip, other_outward) = one, other
    across = (other_tip - tip) / np.hypot(*(other_tip - tip))
    return float(np.sum((across - outward) ** 2 + (across + other_outward) ** 2))
