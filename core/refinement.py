"""Lateral refinement: lines move to the middle between both edges of their railhead.

The raster leaves a line up to half a cell beside its rail, for long stretches where the rail runs along the grid. The
points know better: where most of them lie within one head width, there the head is (ALGORITHMS.md section 1.9).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .head_edges import HALF_HEAD, histograms, middles, widest_reach
from .points import RailPoints
from .polyline import left_normals, project
from .progress import SILENT, Progress
from .railhead import on_top
from .rails import length_along
from .smoothing import smooth_profile
from .vectorize.network import LineNetwork

ROUNDS = 2
"""The second round sees the head upright and whole; a third moves lines by less than 0.1 mm."""

LEAST_SHARE = 0.25
"""Share of a line's stations that have to show both edges; otherwise the line stays as it is."""

JUNCTION_M = 1.5
"""Two heads are one within this distance of a node: lines stay there, and move fully at twice the distance."""


def refine(
    network: LineNetwork,
    points: RailPoints,
    head_width_m: float,
    smoothing_m: float = 0.8,
    progress: Progress = SILENT,
) -> LineNetwork:
    """Move smoothed lines onto the axes of their railheads.

    Parameters
    ----------
    network : LineNetwork
        Smoothed lines within 3 cm of their rails.
    points : RailPoints
    head_width_m : float
    smoothing_m : float
        Sigma of PAEK for the shifts along a line.
    progress : Progress

    Returns
    -------
    LineNetwork
        Lines stay as they are at nodes in which several meet, and where points show no two edges of a head.
    """
    for number in range(ROUNDS):
        share = progress.span(number / ROUNDS, (number + 1) / ROUNDS)
        network = _refine_once(network, points, head_width_m, smoothing_m, share)
    return network


def _refine_once(
    network: LineNetwork, points: RailPoints, head_width_m: float, smoothing_m: float, progress: Progress
) -> LineNetwork:
    feet = project(network.lines, points.xyz[:, :2], widest_reach(head_width_m), progress.span(0.0, 0.7))
    freedom = _freedom(network)
    lines = []
    for number, line in enumerate(progress.span(0.7, 1.0).follow(network.lines)):
        mine = feet.of(number)
        top, _ = on_top(mine.t, mine.across, points.xyz[mine.point, 2], head_width_m)
        along = length_along(line)
        shift = _shifts(mine.t[top], mine.across[top], along, head_width_m, smoothing_m)
        lines.append(line + (shift * freedom[number])[:, None] * left_normals(line))
    nodes = network.nodes.copy()
    for (start, end), line in zip(network.ends, lines):
        nodes[start], nodes[end] = line[0], line[-1]
    return replace(network, lines=tuple(lines), nodes=nodes)


def _freedom(network: LineNetwork) -> list[np.ndarray]:
    """Say how much each vertex of each line may move: from 0 near shared nodes to 1."""
    shared = network.degrees() > 1
    along = [length_along(line) for line in network.lines]
    freedom = [np.ones(len(t)) for t in along]
    fixed = [
        (number, along[number][-side])
        for number, ends in enumerate(network.ends)
        for side in (0, 1)
        if shared[ends[side]]
    ]
    fixed += [(line, along[line][vertex]) for _, line, vertex in network.passes.tolist()]
    for number, t in fixed:
        freedom[number] = np.minimum(freedom[number], np.clip(np.abs(along[number] - t) / JUNCTION_M - 1, 0, 1))
    return freedom


def _shifts(
    t: np.ndarray, across: np.ndarray, along: np.ndarray, head_width_m: float, smoothing_m: float
) -> np.ndarray:
    """How far to the left a line has to move at its vertices, (m,); 0 where the points do not tell."""
    stations, counts, wide_counts = histograms(t, across, along[-1], head_width_m)
    middle = middles(counts, wide_counts) * head_width_m / (2 * HALF_HEAD)
    known = np.isfinite(middle)
    if known.sum() < max(LEAST_SHARE * len(stations), 2):
        return np.zeros(len(along))
    return smooth_profile(stations[known], middle[known], smoothing_m, along)
