"""Repair what the raster does to junctions: drop spurs and rungs, cut bends, and run rails through nodes.

See docs/method.md section 4.6.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import find_peaks

from ..lines.ends import STEP_M, even_points, tip_and_direction
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

KINK_DEG = 25.0
"""Two lines that meet more sharply are not one rail: at the least radius, 15 m, a rail turns by 10 degrees in 2.5 m."""

DIRECTION_M = 2.5
"""Length over which directions at a node are compared: longer than the merged part of a 1:9 frog."""

COARSE_M = 1.0
"""Spacing of the points that are compared: directions between closer ones show the stairs."""

BEND_M = 1.5
"""Length of line before and behind a bend that shows its direction: shorter ones show the stairs of the raster."""

BEND_DEG = 2.8
"""A line that changes over to a wing rail at a frog of 1:20 bends by 2.9 degrees, and one that changes over to a check
rail, 0.14 m aside within 2.5 m, by 3; stairs turn directions by a degree. Where a rail only seems to bend, both parts
are joined again."""

SHORTEST_BEND_M = 0.6
"""Smallest distance of two bends, and shortest length that shows a direction."""

STEADY_BEND_M = 10.1
"""Length around a bend whose median is what the rail itself bends."""


def clean_junctions(network: LineNetwork, head_width_m: float) -> LineNetwork:
    """Drop spurs, loops and rungs between rails, and join lines at nodes of degree 2."""
    network = drop_loops(drop_rungs(weld_pairs(network), RUNG_HEADS * head_width_m), SPUR_M)
    return drop_spurs(weld_pairs(network), SPUR_M)


def weld_pairs(network: LineNetwork, most_deg: float = TURNED_BACK_DEG) -> LineNetwork:
    """Join lines at nodes in which exactly two different lines end and none passes; separate them if they turn more."""
    plain = network.degrees() == 2
    plain[network.passes[:, 0]] = False
    partner: dict[int, int] = {}
    for one, other in (pair for node, pair in ends_by_node(network) if plain[node]):
        if one // 2 == other // 2:
            continue
        if deflections(network, [one, other])[0, 1] > most_deg:
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
    outward = outward_ways(network, ends, DIRECTION_M)
    return np.degrees(np.arccos(np.clip(-outward @ outward.T, -1.0, 1.0)))


def outward_ways(network: LineNetwork, ends: Sequence[int], length_m: float) -> np.ndarray:
    """Return the unit vectors out of lines at some of their ends, (k, 2), by the last `length_m` of each."""
    return np.array([tip_and_direction(even_points(network.from_end(end), length_m))[1] for end in ends])


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


def points_of(network: LineNetwork) -> tuple[np.ndarray, np.ndarray]:
    """Place even points on all lines: returns them, (n, 2) metres, and the number of the line of each, (n,)."""
    parts = [even_points(line) for line in network.lines]
    return np.concatenate([np.empty((0, 2)), *parts]), np.repeat(np.arange(len(parts)), [len(part) for part in parts])


def branchings(network: LineNetwork) -> Iterator[tuple[int, int, list[int]]]:
    """Yield the nodes in which one line end, the stem, continues in two others, the legs."""
    for node, ends in ends_by_node(network):
        if len({end // 2 for end in ends}) == 3 == len(ends) and node not in network.passes[:, 0]:
            widest = deflections(network, ends).max(axis=1, where=~np.eye(3, dtype=bool), initial=0.0)
            stem = int(widest.argmin())
            if widest[stem] < DEFLECTION_DEG:
                yield node, ends[stem], ends[:stem] + ends[stem + 1 :]


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


def cut_bends(network: LineNetwork, progress: Progress = SILENT) -> LineNetwork:
    """Cut lines, without passes, where they bend unlike the line around; the parts meet in nodes.

    There, a line may change over to another rail: a check rail or a wing rail that hides it, or one that it crosses.
    """
    lines: list[np.ndarray] = []
    ends: list[tuple[int, int]] = []
    nodes = list(network.nodes)
    for line, (first, last) in progress.follow(zip(network.lines, network.ends.tolist()), len(network.lines)):
        own, bends = Polyline(line), _bends(line)
        numbers = [first, *range(len(nodes), len(nodes) + len(bends)), last]
        nodes += list(own.at(np.array(bends)))
        stops = [0.0, *bends, own.length_m]
        lines += [own.part(*part).xyz for part in zip(stops, stops[1:])] if bends else [line]
        ends += list(zip(numbers, numbers[1:]))
    return LineNetwork(tuple(lines), np.array(nodes).reshape(-1, 2), np.array(ends, dtype=int).reshape(-1, 2))


def _bends(line: np.ndarray) -> list[float]:
    """Find the chainages at which a line bends more than `BEND_DEG` apart from what it bends around them."""
    points = even_points(line)
    width = min(int(BEND_M / STEP_M), (len(points) - 5) // 2)
    if width < SHORTEST_BEND_M / STEP_M:
        return []
    x = np.arange(width) - (width - 1) / 2
    ahead = [np.convolve(ordinates, x[::-1] / (x @ x), "valid") for ordinates in points.T]
    direction = np.degrees(np.unwrap(np.arctan2(ahead[1], ahead[0])))
    bend = direction[width:] - direction[:-width]
    odd = np.abs(bend - median_filter(bend, int(STEADY_BEND_M / STEP_M), mode="nearest"))
    odd = np.where(np.abs(bend) > KINK_DEG, np.abs(bend), odd)
    peaks = find_peaks(odd, height=BEND_DEG, distance=int(SHORTEST_BEND_M / STEP_M))[0]
    return (Polyline(line).length_m * (peaks + width - 0.5) / (len(points) - 1)).tolist()
