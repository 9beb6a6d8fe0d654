"""From a raster of rail cells to lines: closing, parity fix, veinerization, pruning, tracing, junctions and gaps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..lines.ends import even_points, tip_and_direction
from ..lines.network import LineNetwork
from ..parameters import Parameters
from ..progress import SILENT, Progress
from ..raster import RailRaster
from .branches import attach_branches, part_branches
from .cells import RailCells
from .courses import follow_courses
from .junctions import clean_junctions, cut_bends, run_through, weld_pairs
from .skeleton import chamfer_distance, close, parity_fix, pixel_set, prune, trace, veinerize
from .slips import add_curves, open_slips

__all__ = ["LineNetwork", "vectorize"]

SETTLING_M = 1.0
"""A free end moves onto the straight line through this last part of its line: a shorter part shows the raster, a longer
one may bend."""


def vectorize(
    raster: RailRaster,
    head_width_m: float,
    max_gap_m: float = Parameters.max_gap_m,
    gap_angle_deg: float = Parameters.gap_angle_deg,
    min_length_m: float = Parameters.min_length_m,
    progress: Progress = SILENT,
    spacings_m: Sequence[float] = (),
) -> LineNetwork:
    """Turn rail cells into lines: one per rail, straight through junctions and across gaps (docs/method.md section 4).

    The cells are those that FRPDF has cleaned. Detail at junctions that is smaller than the width of the railhead
    counts as noise. Ends at most `max_gap_m` apart are joined if each points at the other within `gap_angle_deg`. Lines
    shorter than `min_length_m` are dropped unless they connect two junctions. `spacings_m`, the distances between the
    axes of a track's rails, show which lines of a crossing continue each other, and where slips are; without them, no
    slips are found. The lines, in local metres, still have the stairs of the raster; smooth them next.
    """
    closed = close(raster, progress.span(0.0, 0.3))
    cells = pixel_set(closed.cells())
    progress.check()
    pixels = parity_fix(cells)
    progress.check()
    distance = chamfer_distance(pixels)
    progress.check()
    edges = veinerize(pixels, distance)
    progress.check()
    edges, tips = prune(edges, distance)
    progress.check()
    traced = trace(closed, pixels, edges, tips)
    progress.set_fraction(0.6)
    progress.check()
    rail_cells = RailCells(cKDTree(closed.to_local(pixels.cells / 2)), spacings_m)
    network, slips = open_slips(clean_junctions(traced, head_width_m), rail_cells)
    network = cut_bends(network, progress.span(0.6, 0.7))
    network = follow_courses(network, rail_cells, max_gap_m, gap_angle_deg, progress.span(0.7, 0.9))
    network = run_through(part_branches(add_curves(network, slips)))
    network = attach_branches(network, rail_cells.tree, max_gap_m, progress.span(0.9, 1.0))
    return _settle_ends(_drop_short(network, min_length_m))


def _drop_short(network: LineNetwork, min_length_m: float) -> LineNetwork:
    """Drop short lines with a free end, and join lines that only a dropped one kept apart."""
    while True:
        loose = (network.degrees()[network.ends] == 1).any(axis=1)
        keep = ~loose | (network.lengths() >= min_length_m)
        if keep.all():
            return network
        network = weld_pairs(network.select(keep))


def _settle_ends(network: LineNetwork) -> LineNetwork:
    """Move free ends sideways onto the straight line through their last part, because smoothing keeps them in place."""
    lines, nodes = [line.copy() for line in network.lines], network.nodes.copy()
    for end in np.flatnonzero(network.degrees()[network.ends.ravel()] == 1).tolist():
        tip, _ = tip_and_direction(even_points(network.from_end(end), SETTLING_M))
        lines[end // 2][-1 if end % 2 else 0] = nodes[network.ends.flat[end]] = tip
    return replace(network, lines=tuple(lines), nodes=nodes)
