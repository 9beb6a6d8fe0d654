"""Lateral refinement: lines move to the middle between the edges of their railheads.

The raster leaves a line up to half a cell off its rail, over long distances where the rail is parallel to the grid. The
points show the edges of the head, and thus its middle, more exactly (docs/method.md section 6.2).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..clouds.points import RailPoints
from ..lines.bridges import bridge
from ..lines.network import LineNetwork
from ..lines.network_smoothing import bend_through, smooth_network
from ..lines.smoothing import smooth_profile
from ..parameters import Parameters
from ..polyline import Feet, interpolate, left_normals, length_along, project
from ..progress import SILENT, Progress
from .blunt import Ridge
from .branch_starts import APART_HEADS, slide_branches
from .edges import HALF_HEAD_BINS, Widths, histograms, middles, search_distance, widest
from .flank import Flank, find_flank
from .level import MIN_ON_HEAD, on_top
from .neighbours import free_edges
from .own_level import on_own_level
from .roads import hidden_edges
from .sections import outline_middles, with_outline
from .strips import aligned, measure_strips
from .top import smoothed

MIN_SEEN_SHARE = 0.25
"""Minimum share of a line's stations with visible edges; otherwise the line stays as it is."""

MAX_UNSEEN_M = 6.0
"""Longest section without visible edges that is redrawn from the line on either side, because other rails distort the
raster there: heads that cross at 1:26.5 cover each other over this length. Where an arc of 190 m begins abruptly, the
redrawn line is 3 mm off."""

MIN_COVERED_M, MAX_COVERED_M, MIN_COVERED_PER_M = 2.0, 30.0, 5.0
"""Length of sections that are redrawn because the head is covered, up to two lanes of a road with their sides, and
points per metre at another height that show it."""

ASTRAY_M = 2.0
"""Length on either side of such a section in which the line leaves the head: smoothing draws a step as a bend."""

NARROW_SHARE, NARROW_PERCENTILES = 0.25, (5.0, 95.0)
"""Width of a band of points, in head widths and between these percentiles, in which no edges are looked for: points
that were drawn or computed on the axis, not scanned, all have one offset."""

CURL_M, STEADY_M = 0.8, 3.5
"""Length of a free end that is redrawn, and of the part before it that it continues. The raster curls over two head
widths or more, half a window of 1.25 m adds to that, and the curvature of a tram's rail takes metres to measure."""

MAX_CROSSING_SHIFT_M = 3.0
"""Limit for how far a crossing moves when two lines move by half a head: at 1:26.5 each moves it by 1 m."""

SURE_HEADS = (APART_HEADS, 0.7, 0.7)
"""Distance of a branch from its stock rail, in head widths, from which its line is reliable after each round: first
where the raster separates the two, then where most of the head is free. Closer than that, the line is still biased
towards the start assumed before, which moves the start half a metre forward. Lines without branches need two."""

SETTLING_ROUNDS, SETTLED_M = 2, 0.0008
"""Further rounds for lines that the last one moved by more than this (median): a sixth of it is left. Heads seen from
the side, or of another width than stated, move by 4 to 9 mm in the second round, because edges mislead in the first."""

ALIGNED_ROUNDS = 4
"""Further rounds in which strips are aligned: a step of 30 mm where strips meet has been drawn as a bend 2 m long, of
which a round removes half."""


def refine(
    network: LineNetwork,
    points: RailPoints,
    head_width_m: Widths,
    smoothing_m: float = Parameters.smoothing_xy_m,
    progress: Progress = SILENT,
    align: bool = False,
) -> LineNetwork:
    """Move smoothed lines onto the axes of their railheads.

    Parameters
    ----------
    network : LineNetwork
        Smoothed lines within 3 cm of their rails.
    points : RailPoints
    head_width_m : float or (n,) array
        Width of the heads, of all lines or of each.
    smoothing_m : float
        Sigma of PAEK for the shifts along a line.
    progress : Progress
    align : bool
        Whether the strips of the points are moved onto their mean.

    Returns
    -------
    LineNetwork
        Lines stay as they are where points show no edge of a head. Lines that met in a node still do, and branches
        begin where they touch the rail that they leave.
    """
    least = len(SURE_HEADS) if len(network.passes) else len(SURE_HEADS) - 1
    more = ALIGNED_ROUNDS if align and points.strips is not None else 0
    by_x = points.xyz[np.argsort(points.xyz[:, 0])] if len(network.passes) else points.xyz
    shares, widest_m = progress.split(least + SETTLING_ROUNDS + more), widest(head_width_m)
    moving = np.ones(len(network.lines), dtype=bool)
    for number, share in enumerate(shares[: least + SETTLING_ROUNDS]):
        before = network.lines
        network = _shifted(network, points, head_width_m, smoothing_m, share, by_outline=number > 0, only=moving)
        moved_m = np.array([np.median(np.hypot(*(new - old).T)) for new, old in zip(network.lines, before)])
        if number + 1 >= least:
            moving &= moved_m > SETTLED_M
        sure = SURE_HEADS[min(number, len(SURE_HEADS) - 1)]
        network = slide_branches(network, by_x, widest_m, sure * widest_m)
        if number == 0 and moved_m.any():
            network = smooth_network(network, smoothing_m)
        if not moving.any():
            break
    for share in shares[least + SETTLING_ROUNDS :]:
        network = _shifted(network, points, head_width_m, smoothing_m, share, align=True)
    return network


def _shifted(
    network: LineNetwork,
    points: RailPoints,
    widths: Widths,
    smoothing_m: float,
    progress: Progress,
    by_outline: bool = True,
    align: bool = False,
    only: np.ndarray | None = None,
) -> LineNetwork:
    """Move every line, or only those of a mask, to the middle of its head, and the nodes with them."""
    feet = project(network.lines, points.xyz[:, :2], search_distance(widest(widths)), progress.span(0.0, 0.7))
    edges = free_edges(network.lines, widest(widths))
    strips = measure_strips(network.lines, feet, points, edges, widths) if align else None
    of_lines = np.broadcast_to(widths, len(network.lines))
    free_ends = (network.degrees() == 1)[network.ends]
    lines = []
    for number, line in enumerate(progress.span(0.7, 1.0).follow(network.lines)):
        if only is not None and not only[number]:
            lines.append(line.copy())
            continue
        mine, head_width_m = feet.of(number), float(of_lines[number])
        z = points.xyz[mine.point, 2]
        if strips is not None:
            mine, z = aligned(strips[number], mine, z, points)
        own = on_own_level(mine.t, mine.across, z, head_width_m)
        other, mine, z = mine.t[~own], mine[own], z[own]
        flank = find_flank(mine.t, mine.across, z, head_width_m)
        if flank is not None:
            lines.append(_moved_off(line, mine, flank, smoothing_m))
            continue
        if _is_narrow(mine.across, head_width_m):
            lines.append(_moved_onto(line, mine))
            continue
        top, _ = on_top(mine.t, mine.across, z, head_width_m)
        along = length_along(line)
        free = edges[number] & ~hidden_edges(mine.t[top], mine.across[top], along[-1], head_width_m, edges[number])
        ridge = Ridge.find(mine.t, mine.across, z, along[-1], head_width_m)
        if ridge is not None:
            stations, middle = ridge.t, ridge.offset_m
        else:
            stations, middle = _middles(mine.t[top], mine.across[top], along[-1], head_width_m, free)
        if by_outline and ridge is None:
            seen = np.isfinite(middle) & free.all(axis=0)
            middle = with_outline(middle, outline_middles(mine.t, mine.across, z, along[-1], head_width_m, seen))
        known = np.isfinite(middle)
        if known.sum() < max(MIN_SEEN_SHARE * len(stations), 2):
            lines.append(line)
            continue
        shift = smooth_profile(stations[known], middle[known], smoothing_m, along)
        moved = line + shift[:, None] * left_normals(line)
        moved = _redrawn(moved, along, _unseen(stations, known))
        moved = _redrawn(moved, along, _covered(mine.t[top], other))
        lines.append(_with_redrawn_ends(moved, along, free_ends[number], mine.t[top]))
    return _joined(network, lines, smoothing_m)


def _is_narrow(across: np.ndarray, head_width_m: float) -> bool:
    """Return whether all points near a line, by their offsets from it, form a band in which no edges can be seen."""
    if len(across) < MIN_ON_HEAD:
        return False
    low, high = np.percentile(across, NARROW_PERCENTILES)
    return bool(high - low < NARROW_SHARE * head_width_m)


def _moved_onto(line: np.ndarray, feet: Feet) -> np.ndarray:
    """Move a line sideways onto the middle of its points."""
    return line + np.median(feet.across) * left_normals(line)


def _moved_off(line: np.ndarray, feet: Feet, flank: Flank, smoothing_m: float) -> np.ndarray:
    """Move a line along one face of its head onto the axis."""
    along_face = smoothed(feet.t, feet.across, smoothing_m).at(length_along(line))
    shift = along_face + flank.left_m - np.median(feet.across)
    return line + shift[:, None] * left_normals(line)


def _with_redrawn_ends(line: np.ndarray, along: np.ndarray, free_ends: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Redraw the free ends of a line as a continuation of the line: the raster's lines curl where a rail ends.

    Parameters
    ----------
    line : (n, 2) array
    along : (n,) array
        Chainages of its vertices.
    free_ends : (2,) bool array
        Whether its start and its end are free.
    t : (k,) array
        Chainages of the points on the head, increasing; the raster's lines go on where there are no more.
    """
    line = line.copy()
    ends = ((line, along, t[0]), (line[::-1], along[-1] - along[::-1], along[-1] - t[-1]))
    for (from_end, t_end, shown), free in zip(ends, free_ends):
        start = max(shown, 0.0) + CURL_M
        steady = (t_end >= start) & (t_end <= start + STEADY_M)
        if free and steady.sum() > 3 and along[-1] > 2 * (start + STEADY_M):
            curled = t_end < start
            curve = np.polynomial.polynomial.polyfit(t_end[steady], from_end[steady], 2)
            from_end[curled] = np.polynomial.polynomial.polyval(t_end[curled], curve).T
    return line


def _joined(network: LineNetwork, lines: list[np.ndarray], smoothing_m: float) -> LineNetwork:
    """Make lines that were moved one by one meet again: where lines run through the node, else at the mean of ends."""
    passes = _crossings(network.passes, lines)
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
        bend_through(line, length_along(line) / smoothing_m, vertices, nodes[own_nodes])
    return replace(network, lines=tuple(lines), nodes=nodes, passes=passes)


def _crossings(passes: np.ndarray, lines: list[np.ndarray]) -> np.ndarray:
    """Find the vertices at which lines that run through the same node cross after they were moved."""
    passes = passes.copy()
    for node in np.unique(passes[:, 0]):
        one, *others = np.flatnonzero(passes[:, 0] == node)
        for other in others:
            (_, a, vertex), b = passes[one], passes[other, 1]
            along = length_along(lines[a])
            nearby = np.arange(1, len(lines[a]) - 1)
            nearby = nearby[np.abs(along[nearby] - along[vertex]) < MAX_CROSSING_SHIFT_M]
            feet = project([lines[b]], lines[a][nearby], MAX_CROSSING_SHIFT_M)
            if a != b and len(feet.t):
                best = np.argmin(np.abs(feet.across))
                passes[one, 2] = nearby[feet.point[best]]
                passes[other, 2] = np.argmin(np.abs(length_along(lines[b])[1:-1] - feet.t[best])) + 1
    return passes


def _middles(
    t: np.ndarray, across: np.ndarray, length_m: float, head_width_m: float, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return stations along a line and the offset of the head's middle to the left there; NaN without visible edges."""
    stations, counts, wide_counts = histograms(t, across, length_m, head_width_m)
    return stations, middles(counts, wide_counts, free) * head_width_m / (2 * HALF_HEAD_BINS)


def _unseen(stations: np.ndarray, known: np.ndarray) -> list[tuple[float, float]]:
    """List the sections between known stations that are short enough to be redrawn, by their chainages."""
    numbers = np.flatnonzero(known)
    gaps = [(stations[a], stations[b]) for a, b in zip(numbers, numbers[1:]) if b - a > 1]
    return [(start, end) for start, end in gaps if end - start <= MAX_UNSEEN_M]


def _covered(t: np.ndarray, other: np.ndarray) -> list[tuple[float, float]]:
    """List the sections that have points at another height than the rail only, which the line follows.

    Parameters
    ----------
    t, other : (n,), (k,) arrays
        Chainages of the points on the head, and of those at another height, increasing.
    """
    if len(t) < 2 or not len(other):
        return []
    wide = np.flatnonzero(np.diff(t) > MIN_COVERED_M)
    gaps = np.column_stack([t[wide], t[wide + 1]])
    length_m = gaps[:, 1] - gaps[:, 0]
    count = np.diff(np.searchsorted(other, gaps), axis=1)[:, 0]
    gaps = gaps[(count > MIN_COVERED_PER_M * length_m) & (length_m <= MAX_COVERED_M)]
    return [(start - ASTRAY_M, end + ASTRAY_M) for start, end in gaps.tolist()]


def _redrawn(line: np.ndarray, along: np.ndarray, unseen: list[tuple[float, float]]) -> np.ndarray:
    """Redraw unseen sections of a line as smooth curves from the line on either side."""
    line = line.copy()
    for start, end in unseen:
        first, last = np.searchsorted(along, [start, end])
        found = bridge(line[first::-1], line[last:]) if 0 < first < last < len(line) - 1 else None
        if found is not None:
            # The curve leaves out what strays from it on either side: closed to a vertex there, it would turn back.
            first = int(np.searchsorted(along, along[first] - found.cuts_m[0], side="right")) - 1
            last = int(np.searchsorted(along, along[last] + found.cuts_m[1]))
            if not 0 <= first < last < len(line):
                continue
            curve = np.concatenate([line[[first]], found.points, line[[last]]])
            share = (along[first : last + 1] - along[first]) / (along[last] - along[first])
            t = length_along(curve)
            line[first : last + 1] = interpolate(curve, t, share * t[-1])
    return line
