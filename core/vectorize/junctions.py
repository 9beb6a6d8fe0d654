"""Repair what the raster does to junctions: drop spurs, rungs and kinks, and run rails through nodes.

See docs/method.md section 4.6.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ..lines.ends import STEP_M, even_points, tip_and_direction
from ..lines.finishing import parts_without_turns
from ..lines.network import LineNetwork
from ..polyline import Polyline
from ..progress import SILENT, Progress

SPUR_M = 1.0
"""A shorter branch with a free end is a weed on the side of the rail; a longer one may continue beyond a gap."""

RUNG_HEADS = 4.0
RUNG_DEG = 30.0
"""A shorter and steeper line between two rails is a rung: cells across the flangeway, or where two blunt heads begin to
be one ridge, 0.2 m apart and more."""

DEFLECTION_DEG = 15.0
"""A rail turns by less where it passes through a node; the steepest turnouts in use leave at about 14 degrees."""

TURNED_BACK_DEG = 90.0
"""Two lines that meet more sharply are not one rail, but the legs of a switch whose stem is missing."""

DIRECTION_M = 2.5
"""Length over which directions at a node are compared: longer than the merged part of a 1:9 frog."""

COARSE_M = 1.0
"""Spacing of the points that are compared: directions between closer ones show the stairs."""

KINK_DEG, KINK_STEP_M = 25.0, 0.5
"""No rail turns by this angle within a metre, measured between stations this far apart; the stairs of a raster turn by
6 degrees."""


def clean_junctions(network: LineNetwork, head_width_m: float) -> LineNetwork:
    """Drop spurs, loops and rungs between rails, and join lines at nodes of degree 2."""
    network = drop_loops(drop_rungs(weld_pairs(network), RUNG_HEADS * head_width_m), SPUR_M)
    return drop_spurs(weld_pairs(network), SPUR_M)


def weld_pairs(network: LineNetwork) -> LineNetwork:
    """Join lines at nodes in which exactly two different lines end and none passes; separate them if they turn back."""
    plain = network.degrees() == 2
    plain[network.passes[:, 0]] = False
    partner: dict[int, int] = {}
    for one, other in (pair for node, pair in ends_by_node(network) if plain[node]):
        if one // 2 == other // 2:
            continue
        if deflections(network, [one, other])[0, 1] > TURNED_BACK_DEG:
            network = network.with_end(other, network.from_end(other)[:1], 1)
        else:
            partner[one], partner[other] = other, one
    return network.weld(partner) if partner else network


def drop_spurs(network: LineNetwork, length_m: float) -> LineNetwork:
    """Drop branches with a free end shorter than `length_m`; of several at one junction, the shortest first.

    Dropping it may turn the next one into the rail's own end, which must stay.
    """
    while True:
        degrees, lengths = network.degrees()[network.ends], network.lengths()
        spur = (degrees.min(axis=1, initial=9) == 1) & (degrees.max(axis=1, initial=0) > 2) & (lengths < length_m)
        if not spur.any():
            return network
        rows = np.flatnonzero(spur)
        rows = rows[np.argsort(lengths[rows], kind="stable")]
        junction = network.ends[rows, degrees[rows].argmax(axis=1)]
        _, first = np.unique(junction, return_index=True)
        keep = np.ones(len(network.lines), dtype=bool)
        keep[rows[first]] = False
        network = weld_pairs(network.select(keep))


def drop_rungs(network: LineNetwork, length_m: float) -> LineNetwork:
    """Drop links shorter than `length_m` that do not continue another line at either of their nodes."""
    ends_at = dict(ends_by_node(network))
    keep = np.ones(len(network.lines), dtype=bool)
    short = (network.degrees()[network.ends] > 2).all(axis=1) & (network.lengths() < length_m)
    for line in np.flatnonzero(short).tolist():
        steep = True
        for end in (2 * line, 2 * line + 1):
            others = [end, *(other for other in ends_at[network.ends.flat[end]] if other != end)]
            steep &= bool(deflections(network, others)[0, 1:].min() > RUNG_DEG)
        keep[line] = not steep
    return network.select(keep)


def drop_loops(network: LineNetwork, length_m: float) -> LineNetwork:
    """Draw one straight line for two shorter than `length_m` between the same two nodes: one rail with a hole."""
    lines, keep = list(network.lines), np.ones(len(network.lines), dtype=bool)
    between: dict[tuple[int, ...], int] = {}
    for number in np.flatnonzero(network.lengths() < length_m).tolist():
        ends = network.ends[number].tolist()
        first = between.setdefault(tuple(sorted(ends)), number)
        if first != number and ends[0] != ends[1]:
            lines[first], keep[number] = network.nodes[network.ends[first]], False
    return replace(network, lines=tuple(lines)).select(keep)


def run_through(network: LineNetwork) -> LineNetwork:
    """Join lines through nodes of degree 3 and more, straightest pairs first; the remaining lines end there."""
    partner: dict[int, int] = {}
    for _, ends in ends_by_node(network):
        if len(ends) > 2:
            partner.update(_straightest(network, ends))
    return network.weld(partner) if partner else network


def deflections(network: LineNetwork, ends: Sequence[int]) -> np.ndarray:
    """Measure by how much a line that arrives at one end would turn to continue at another, (k, k) degrees."""
    outward = np.array([tip_and_direction(even_points(network.from_end(end), DIRECTION_M))[1] for end in ends])
    return np.degrees(np.arccos(np.clip(-outward @ outward.T, -1.0, 1.0)))


def _straightest(network: LineNetwork, ends: Sequence[int]) -> dict[int, int]:
    """Pair the line ends of one node by smallest deflection."""
    turn = deflections(network, ends)
    pairs = np.argwhere(np.triu(turn < DEFLECTION_DEG, 1))
    paired: dict[int, int] = {}
    for first, second in pairs[np.argsort(turn[tuple(pairs.T)])].tolist():
        one, other = ends[first], ends[second]
        if one not in paired and other not in paired and one // 2 != other // 2:
            paired[one], paired[other] = other, one
    return paired


def ends_by_node(network: LineNetwork) -> Iterable[tuple[int, list[int]]]:
    """Yield each node with the line ends in it."""
    flat = network.ends.ravel()
    order = np.argsort(flat, kind="stable")
    nodes, first = np.unique(flat[order], return_index=True)
    return zip(nodes.tolist(), (group.tolist() for group in np.split(order, first[1:])))


def unsteadiness(one: np.ndarray, other: np.ndarray, length_m: float) -> float:
    """Measure how far two lines are off one curve of constant curvature through both, metres rms.

    Both are given from the ends that face each other inward, and `length_m` of each counts. Headings are summed along
    the way, which unrolls tight curves as well.
    """
    coarse = int(round(COARSE_M / STEP_M))
    points = np.concatenate([even_points(one, length_m)[::coarse][::-1], even_points(other, length_m)[::coarse]])
    if len(points) < 4:
        return 0.0
    way = np.diff(points, axis=0)
    way = way[np.abs(way).max(axis=1) > 0]
    length = np.hypot(*way.T)
    heading = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
    along = np.concatenate([[0.0], np.cumsum(length)])
    aside = np.concatenate([[0.0], np.cumsum(length * (heading - heading.mean()))])
    along = along / along[-1]
    return float(np.sqrt(np.mean((aside - np.polyval(np.polyfit(along, aside, 2), along)) ** 2)))


def cut_kinks(network: LineNetwork, progress: Progress = SILENT) -> LineNetwork:
    """Cut lines, without passes, where they turn too sharply for a rail, and drop the bent part; new ends are free."""
    lines: list[np.ndarray] = []
    ends: list[list[int]] = []
    nodes = list(network.nodes)
    for line, own in progress.follow(zip(network.lines, network.ends.tolist()), len(network.lines)):
        for start, end in parts_without_turns(line, STEP_M, KINK_STEP_M, KINK_DEG):
            piece = line if end - start >= Polyline(line).length_m else Polyline(line).part(start, end).xyz
            lines.append(piece)
            ends.append([])
            for node, was, now in zip(own, line[[0, -1]], piece[[0, -1]]):
                ends[-1].append(node if (was == now).all() else len(nodes))
                nodes += [] if (was == now).all() else [now]
    whole = LineNetwork(tuple(lines), np.array(nodes).reshape(-1, 2), np.array(ends, dtype=int).reshape(-1, 2))
    return weld_pairs(whole.tidy())
