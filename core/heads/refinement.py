"""Lateral refinement: lines move to the middle between the edges of their railheads.

The raster leaves a line up to half a cell off its rail, over long distances where the rail is parallel to the grid. The
points show the edges of the head, and thus its middle, more exactly (docs/method.md section 6.2).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..clouds.points import RailPoints
from ..lines.network import LineNetwork
from ..lines.smoothing import bend_through
from ..parameters import Parameters
from ..polyline import Polyline
from ..progress import SILENT, Progress
from .axis import CELL_M, Axis, unseen_m
from .branch_starts import slide_branches
from .head_points import Widths, near_lines, widest
from .own_level import on_own_level
from .strips import measure_strips

ROUNDS, SURE_HEADS = 3, 0.7
"""Rounds of moving lines, and distance of a branch from its stock rail, in head widths, from which most of its head is
free and its line thus reliable."""

ALIGNED_ROUNDS = 2
"""Further rounds in which strips are aligned: a step of 30 mm where strips meet has been drawn as a bend 2 m long, of
which a round removes half."""


def refine(
    network: LineNetwork,
    points: RailPoints,
    head_width_m: Widths,
    smoothing_m: float = Parameters.smoothing_xy_m,
    progress: Progress = SILENT,
    align: bool = False,
    cell_m: float = CELL_M,
) -> LineNetwork:
    """Move smoothed lines, within 3 cm of their rails, onto the axes of their railheads.

    What moves a node fades along its lines over `smoothing_m`; `align` moves the strips of the points onto their mean,
    and `cell_m` is that of the raster from which the lines were drawn. Lines stay as they are where points show no edge
    of a head. Lines that met in a node still do, and branches begin where they touch the rail that they leave.
    """
    by_x = points.xyz[np.argsort(points.xyz[:, 0])] if len(network.passes) else points.xyz
    shares = progress.split(ROUNDS + (ALIGNED_ROUNDS if align and points.strips is not None else 0))
    for number, share in enumerate(shares[:ROUNDS]):
        network = _shifted(network, points, head_width_m, smoothing_m, cell_m, share, by_outline=number > 0)
        network = slide_branches(network, by_x, widest(head_width_m), SURE_HEADS * widest(head_width_m))
    for share in shares[ROUNDS:]:
        network = _shifted(network, points, head_width_m, smoothing_m, cell_m, share, align=True)
    return network


def _shifted(
    network: LineNetwork,
    points: RailPoints,
    widths: Widths,
    smoothing_m: float,
    cell_m: float,
    progress: Progress,
    by_outline: bool = True,
    align: bool = False,
) -> LineNetwork:
    """Move every line to the middle of its head, and the nodes with them."""
    near = near_lines(network.lines, points.xyz, widths, points.strips, progress.span(0.0, 0.7), points.blunt)
    lines = []
    for line, head in zip(network.lines, progress.span(0.7, 1.0).follow(near)):
        strips = measure_strips(head) if by_outline else None
        own = on_own_level(strips.moved(head, align) if strips else head)
        axis = Axis.of(own, unseen_m(cell_m), by_outline)
        lines.append(line + axis.course.at(own.along)[:, None] * Polyline(line).normals)
    return _joined(network, lines, smoothing_m)


def _joined(network: LineNetwork, lines: list[np.ndarray], smoothing_m: float) -> LineNetwork:
    """Make lines that were moved one by one meet again: where lines run through the node, else at the mean of ends."""
    passes = network.passes
    places, votes = np.zeros_like(network.nodes), np.zeros(len(network.nodes))
    through = np.isin(np.arange(len(votes)), passes[:, 0])
    ending = [(node, number, -side) for number, ends in enumerate(network.ends) for side, node in enumerate(ends)]
    passing = [tuple(one) for one in passes.tolist()]
    for node, number, vertex in passing + [one for one in ending if not through[one[0]]]:
        places[node] += lines[number][vertex]
        votes[node] += 1
    nodes = places / votes[:, None]
    anchors: list[list[tuple[int, int]]] = [[] for _ in lines]
    for node, number, vertex in ending + passing:
        anchors[number].append((node, vertex % len(lines[number])))
    for line, own in zip(lines, anchors):
        own_nodes, vertices = np.array(own).T
        bend_through(line, Polyline(line).t / smoothing_m, vertices, nodes[own_nodes])
    return replace(network, lines=tuple(lines), nodes=nodes)
