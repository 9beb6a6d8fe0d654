"""Refinement: lines move to the middle between the edges of their heads, and branches to where they touch stock rails.

The raster leaves a line up to half a cell off its rail, over long distances where the rail is parallel to the grid. The
points show the edges of the head, and thus its middle, more exactly (docs/method.md section 6.2). The raster separates
two rails from where their heads are a cell apart; the points show both outer edges from where the heads are side by
side. Before that, the branch is the end of an arc or a straight blade; points between the two decide (section 6.3).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..clouds.points import RailPoints
from ..lines.ends import ARC, STRAIGHT, PartingLaw, left_of
from ..lines.network import LineNetwork
from ..lines.smoothing import bend_through
from ..parameters import Parameters
from ..polyline import Polyline
from ..progress import SILENT, Progress
from .axis import CELL_M, Axis, unseen_m
from .head_points import HeadPoints, Widths, near_lines, widest
from .own_level import on_own_level
from .strips import measure_strips

ROUNDS = 3
"""Rounds of moving lines."""

ALIGNED_ROUNDS = 2
"""Further rounds in which strips are aligned: a step of 30 mm where strips meet has been drawn as a bend 2 m long, of
which a round removes half."""


class Apart(NamedTuple):
    """Distances between the axes of two rails that part, in head widths.

    From `free` on, most of the branch's head is free and its line thus reliable; from `drawn` on, the raster has a cell
    between the heads; and up to `last`, the way they part shows where they touch.
    """

    free: float
    drawn: float
    last: float


SHARP_APART, BLUNT_APART = Apart(0.7, 1.3, 3.0), Apart(1.5, 1.5, 6.0)
"""These distances for sharp and for blunt heads. Two blunt heads that are nearer are one ridge, and the line of either
is drawn away from the other, by 20 mm in images that blur by 4 cm."""

MIN_PART_M = 1.5
"""Shortest part that shows it: an eighth of the length in which the flattest switch opens by the width of a head."""

MAX_BACK_M = 35.0
"""No branch touches its stock rail further than this before both lines are reliable: at 1.5 heads, radii of 5000 m."""

HEEL_SPREAD_M = 0.15
"""Distance between the axes up to which a blade is straight: at the heels of American switches it is 6 1/4 inches."""

EMPTY_SHARE = 0.4
"""Between the edges of a straight blade and of an arc, point density relative to that on the adjacent head below which
a head is ruled out. Noise of a centimetre fills an empty gap to a quarter, and leaves three quarters of a head."""

MIN_ON_HEAD = 20
"""With fewer points on the adjacent head, the branch is taken for an arc, as most are."""

VERTEX_STEP_M = 0.1
"""Spacing of the vertices that are added at the start of a branch."""


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
        network = slide_branches(network, by_x, widest(head_width_m), bool(points.blunt))
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
    near = near_lines(network.lines, points, widths, progress.span(0.0, 0.7))
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


def slide_branches(network: LineNetwork, xyz: np.ndarray, head_width_m: float, blunt: bool = False) -> LineNetwork:
    """Let each branch begin where it touches the rail that it leaves.

    The distance between axes that part on an arc grows with the square of the way, that next to a straight blade, as
    American switches have, in proportion to it. Both fit where the heads are apart, but the arc begins metres before
    the blade. Where the points, `xyz` (k, 3) in order of x, show no head next to the stock rail there, it is a blade.
    Branches that part in any other way stay unchanged. `blunt` says whether the cloud blunts heads.
    """
    apart = BLUNT_APART if blunt else SHARP_APART
    free_range_m, drawn_range_m = (
        (first * head_width_m, apart.last * head_width_m) for first in (apart.free, apart.drawn)
    )
    starts = [
        (number, end)
        for number, (node, stock, _) in enumerate(network.passes.tolist())
        for end in np.flatnonzero(network.ends.ravel() == node).tolist()
        if end // 2 != stock
    ]
    partings = [_parting(network, end, number, drawn_range_m) for number, end in starts]
    counts = [np.zeros(2) if one is None else _points_of_arc(network, one, xyz, head_width_m) for one in partings]
    for (number, end), count in zip(starts, counts):
        network = _slide(network, end, number, free_range_m, _power(count))
    return network.tidy()


@dataclass(frozen=True)
class _Parting:
    """How a line parts from the one that passes its node, number `stock`, at chainage `node_m` of it.

    `sense` is the direction along the other line in which this one leaves, 1 or -1, and `left` the side, 1 for the
    left. `way` and `apart`, (n,), are the way along the other line from the node and the distance between the axes, in
    the part that shows the parting; `kept` is the vertex of this line, from its end, at the first of these places.
    """

    node_m: float
    stock: int
    sense: float
    way: np.ndarray
    apart: np.ndarray
    left: float
    kept: int

    def law(self, power: int) -> PartingLaw:
        """Fit an arc, or a straight blade up to its heel."""
        used = self.apart <= HEEL_SPREAD_M
        if power == ARC or np.count_nonzero(used) < 3:  # the widest heads hide the heel
            used[:] = True
        return PartingLaw.fitted(self.way[used], self.apart[used], power)


def _parting(network: LineNetwork, end: int, number: int, between_m: tuple[float, float]) -> _Parting | None:
    """See how a line's end parts from the line of pass `number`; None where too little of it is visible."""
    _, stock, vertex = network.passes[number].tolist()
    branch, line = network.from_end(end), network.lines[stock]
    own = Polyline(line)
    along, feet = own.t, own.feet(branch, MAX_BACK_M / 10)
    feet = feet[np.argsort(feet.point)]
    if len(feet.t) < 2:
        return None
    sense = 1.0 if feet.t[-1] > along[vertex] else -1.0
    way, apart = sense * (feet.t - along[vertex]), np.abs(feet.across)
    first, last = _part(apart, *between_m)
    if first + 2 > last or way[last - 1] - way[first] < MIN_PART_M:
        return None
    left, kept = float(np.sign(feet.across[first])), int(feet.point[first])
    return _Parting(float(along[vertex]), stock, sense, way[first:last], apart[first:last], left, kept)


def _slide(network: LineNetwork, end: int, number: int, between_m: tuple[float, float], power: int) -> LineNetwork:
    """Move one line's end along the line that passes its node."""
    parting = _parting(network, end, number, between_m)
    if parting is None:
        return network
    touch = parting.law(power).touch
    if not parting.way[0] - MAX_BACK_M <= touch < parting.way[0]:
        return network
    line, vertex = network.lines[parting.stock], network.passes[number, 2]
    along = Polyline(line).t
    start = int(np.argmin(np.abs(along - along[vertex] - parting.sense * touch)))
    if not 0 < start < len(line) - 1 or network.meets(end // 2, *network.span(end, parting.kept)):
        return network
    across = parting.left * parting.apart[0]
    new = _blade(line, along[start], along[vertex] + parting.sense * parting.way[0], across, power)
    return network.with_end(end, new, parting.kept, at=(parting.stock, start))


def _part(apart: np.ndarray, min_m: float, max_m: float) -> tuple[int, int]:
    """Find the part from the last place less than `min_m` apart to the first one more than `max_m` apart.

    Returns its first place and one more than its last.
    """
    beyond = np.flatnonzero(apart > max_m)
    last = int(beyond[0]) if len(beyond) else len(apart)
    below = np.flatnonzero(apart[:last] < min_m)
    return int(below[-1]) + 1 if len(below) else 0, last


def _points_of_arc(network: LineNetwork, parting: _Parting, xyz: np.ndarray, head_width_m: float) -> np.ndarray:
    """Count points where only an arc has its head, and on as wide a part of the adjacent head: (2,)."""
    blade, arc = parting.law(STRAIGHT), parting.law(ARC)
    line, along = network.lines[parting.stock], Polyline(network.lines[parting.stock]).t
    way = parting.sense * (along - parting.node_m)
    shared = (way >= max(arc.touch, parting.way[0] - MAX_BACK_M)) & (way <= parting.way[0])
    if np.count_nonzero(shared) < 2 or not np.isfinite(arc.touch):
        return np.zeros(2)
    piece = line[shared]
    reach_m = head_width_m + parting.apart[0]
    low, high = piece.min(axis=0) - reach_m, piece.max(axis=0) + reach_m
    near = xyz[slice(*np.searchsorted(xyz[:, 0], [low[0], high[0]]))]
    near = near[(near[:, 1] > low[1]) & (near[:, 1] < high[1])]
    feet = Polyline(piece).feet(near[:, :2], reach_m)
    if not len(feet.t):
        return np.zeros(2)
    free = np.ones((2, 0), dtype=bool)
    top, _ = HeadPoints(feet.t, feet.across, near[feet.point, 2], head_width_m, piece, free).top
    feet = feet[top]
    way = parting.sense * (feet.t + along[shared][0] - parting.node_m)
    wide = arc(way) - blade(way)
    beyond = parting.left * feet.across - 0.5 * head_width_m - blade(way)
    return np.array([np.count_nonzero((outward > 0) & (outward < wide)) for outward in (beyond, -beyond)])


def _power(counts: np.ndarray) -> int:
    """Decide between an arc and a straight blade from the counts of points at a switch, see `_points_of_arc`."""
    on_arc, on_head = counts
    return STRAIGHT if on_head >= MIN_ON_HEAD and on_arc < EMPTY_SHARE * on_head else ARC


def _blade(line: np.ndarray, touch: float, first: float, across: float, power: int) -> np.ndarray:
    """Return places from chainage `touch`, where they are on the line, to `first`, where they are `across` to its left.

    Neither end is included.
    """
    share = np.linspace(0, 1, max(int(abs(first - touch) / VERTEX_STEP_M), 1) + 1)[1:-1]
    return left_of(line, touch + share * (first - touch), across * share**power)
