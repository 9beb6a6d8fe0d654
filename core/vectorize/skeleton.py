"""From rail cells to lines from node to node: closing, parity fix, distance, veinerization, pruning and tracing.

Cells are sparse sets of pixels: nothing depends on tiles or bounding boxes, so there are no seams, and an empty plain
costs nothing. Veinerization: Deseilligny, Stamon and Suen, "Veinerization: a new shape description for flexible
skeletonization", IEEE PAMI 20(5), 1998. See docs/method.md sections 4.2 to 4.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..lines.network import LineNetwork
from ..polyline import Polyline
from ..progress import SILENT, Progress
from ..raster import RailRaster

RING = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))
"""Row and column steps to the eight neighbours, around from the east; those at even places share an edge."""

EAST, SOUTH_EAST, SOUTH, SOUTH_WEST, WEST, NORTH = 0, 1, 2, 3, 4, 6

STEP_COSTS = (2, 3) * 4
"""Chamfer weights of the steps in `RING`: edge 2, diagonal 3."""

_FAR = 2**30

CLOSING_RADIUS_CELLS = 1
"""A 3x3 square bridges gaps of two cells; a larger one would join a rail and its guard rail."""

HOLE_CELLS = 20
"""Largest hole that is filled. Holes between diverging rails soon grow larger."""

_MARGIN = HOLE_CELLS + 2 * CLOSING_RADIUS_CELLS + 1


@dataclass(frozen=True)
class Pixels:
    """A set of pixels, (n, 2), sorted by row and column.

    `neighbours`, (n, 8), are their numbers in the directions of `RING`; n where there is none.
    """

    cells: np.ndarray
    neighbours: np.ndarray

    def __len__(self) -> int:
        return len(self.cells)


def pixel_set(cells: np.ndarray) -> Pixels:
    """Sort cells, (n, 2) integer rows and columns in any order with any repetitions, and link the neighbours."""
    cells = np.asarray(cells, dtype=np.int64).reshape(-1, 2)
    if len(cells) == 0:
        return Pixels(cells, np.empty((0, len(RING)), dtype=np.int64))
    corner = cells.min(axis=0)
    stride = int(np.ptp(cells[:, 1])) + 2
    keys = np.unique((cells[:, 0] - corner[0]) * stride + cells[:, 1] - corner[1])
    return Pixels(np.column_stack(np.divmod(keys, stride)) + corner, _link(keys, stride))


def _link(keys: np.ndarray, stride: int) -> np.ndarray:
    """Find the neighbours of pixels with sorted `keys` = row * stride + column; the last column of a row is empty."""
    count = len(keys)
    neighbours = np.full((count, len(RING)), count, dtype=np.int32)
    padded = np.append(keys, np.full(3, np.iinfo(np.int64).max))
    place = np.searchsorted(keys, keys + stride - 1)
    for direction, offset in ((SOUTH_WEST, stride - 1), (SOUTH, stride), (SOUTH_EAST, stride + 1), (EAST, 1)):
        if direction == EAST:
            place = np.arange(1, count + 1)
        found = padded[place] == keys + offset
        source, target = np.flatnonzero(found), place[found]
        neighbours[source, direction] = target
        neighbours[target, (direction + 4) % 8] = source
        place = place + found
    return neighbours


def parity_fix(pixels: Pixels) -> Pixels:
    """Double the grid so that every run of n pixels becomes a run of 2 n - 1, whose middle is a pixel.

    A skeleton consists of pixels, so the skeleton of a line of even width would be half a pixel off. Pixel (i, j)
    becomes (2 i, 2 j), and a new pixel is set between neighbours, diagonal ones included. Components and holes stay.
    """
    doubled = 2 * pixels.cells
    between = [
        doubled[pixels.neighbours[:, direction] < len(pixels)] + RING[direction]
        for direction in (EAST, SOUTH_EAST, SOUTH, SOUTH_WEST)
    ]
    return pixel_set(np.concatenate([doubled, *between]))


def chamfer_distance(pixels: Pixels) -> np.ndarray:
    """Measure the distance of each pixel to the background, edge steps 2 and diagonal steps 3, (n,) int array.

    Distances become final in ascending order, and each pixel passes its own on once, so that wide areas of cells, as in
    rasters of something else than rails, take no longer per cell than lines do.
    """
    count = len(pixels)
    distance = np.full(count + 1, _FAR)
    for direction in np.argsort(-np.array(STEP_COSTS), kind="stable").tolist():  # edge steps, which are shorter, last
        distance[:count][pixels.neighbours[:, direction] == count] = STEP_COSTS[direction]
    distance[count] = 0
    waiting = {cost: [np.flatnonzero(distance == cost)] for cost in set(STEP_COSTS)}
    while waiting:
        level = min(waiting)
        final = np.concatenate(waiting.pop(level))
        final = final[distance[final] == level]  # to the others, a shorter path was found
        for direction, cost in enumerate(STEP_COSTS):
            reached = pixels.neighbours[final, direction]
            reached = reached[distance[reached] > level + cost]
            if len(reached):
                distance[reached] = level + cost
                waiting.setdefault(level + cost, []).append(reached)
    return distance[:count]


def close(raster: RailRaster, progress: Progress = SILENT) -> RailRaster:
    """Close the rail cells morphologically and fill holes of at most `HOLE_CELLS` cells.

    The result does not depend on the tiles of the raster: each is processed with a margin wider than the largest hole.
    """
    return raster.map_tiles(_close_window, _MARGIN, progress=progress)


def _close_window(window: np.ndarray) -> np.ndarray:
    if not window.any():
        return window
    side = 2 * CLOSING_RADIUS_CELLS + 1
    grown = ndimage.maximum_filter(window, side, mode="constant", cval=0)
    closed = ndimage.minimum_filter(grown, side, mode="nearest")
    background, _ = ndimage.label(~closed)
    return closed | (np.bincount(background.ravel()) <= HOLE_CELLS)[background]


AREA_PIXELS = 12
"""A line end must drain at least this many (doubled) pixels; with fewer it is a bump of the border."""

SECTOR_ANGLE = np.pi
"""A line end must drain a sector of this angle, radians, of its own largest disc: half of the disc."""

_BY_SUM = 1323
_BY_EAST = _BY_SUM + 27
_BY_SOUTH = _BY_SUM + 189
_BY_DISTANCE = 29 * _BY_SUM


def veinerize(pixels: Pixels, distance: np.ndarray) -> np.ndarray:
    """Link every pixel to its steepest deeper neighbours, one in each connected group of them, by chamfer distance.

    Returns undirected edges, (e, 2); the graph has the components of the image and, as independent cycles, its holes.
    """
    count = len(pixels)
    depth = np.append(distance, 0)
    score = np.append(_score(pixels, depth), -1)
    higher = np.zeros(count, dtype=np.uint8)
    for direction in range(len(RING)):
        higher |= (score[pixels.neighbours[:, direction]] > score[:count]).astype(np.uint8) << np.uint8(direction)
    edges = []
    for members in _GROUPS[higher].T:
        source = np.flatnonzero(members)
        edges.append(np.column_stack([source, _steepest(source, members[source], pixels.neighbours, depth, score)]))
    return np.concatenate(edges)


def prune(edges: np.ndarray, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Remove leaves from the graph until every leaf drains enough area to be the end of a line.

    The chamfer distance counts two units per pixel. Returns the remaining edges, (f, 2), and for each pixel the far end
    of the longest branch removed from it, or the pixel itself, (n,): where a line that ends there really ends.
    """
    count = len(distance)
    needed = np.maximum(AREA_PIXELS, SECTOR_ANGLE / 8 * distance.astype(float) ** 2)
    tail, head = np.concatenate([edges, edges[:, ::-1]]).T
    degree = np.bincount(tail, minlength=count)
    # The sum of the remaining neighbours of a leaf is its only neighbour.
    neighbour_sum = np.bincount(tail, weights=head, minlength=count).astype(np.int64)
    area = np.ones(count, dtype=np.int64)
    longest = np.arange(count, dtype=np.int64)  # steps * count + tip, so that the larger number is the longer branch
    gone = np.zeros(count, dtype=bool)
    leaves = np.flatnonzero(degree == 1)
    while len(leaves):
        leaves = leaves[area[leaves] < needed[leaves]]
        gone[leaves] = True
        facing = gone[neighbour_sum[leaves]] & (leaves > neighbour_sum[leaves])
        gone[leaves[facing]] = False
        leaves = leaves[~facing]
        inner = neighbour_sum[leaves]
        np.add.at(area, inner, area[leaves])
        np.maximum.at(longest, inner, longest[leaves] + count)
        np.subtract.at(degree, inner, 1)
        np.subtract.at(neighbour_sum, inner, leaves)
        leaves = np.unique(inner[degree[inner] == 1])
    return edges[~gone[edges].any(axis=1)], longest % count


def _score(pixels: Pixels, depth: np.ndarray) -> np.ndarray:
    """Refine the depth so that no two neighbours tie: by depth, depth of the edge neighbours, south, east, position."""
    around = pixels.neighbours
    rows, columns = (pixels.cells - pixels.cells.min(axis=0, initial=0)).T
    return (
        _BY_DISTANCE * depth[:-1]
        + _BY_SUM * (depth[around[:, WEST]] + depth[around[:, NORTH]])
        + _BY_EAST * depth[around[:, EAST]]
        + _BY_SOUTH * depth[around[:, SOUTH]]
        + 9 * rows
        + 3 * columns
    )


def _steepest(
    source: np.ndarray, members: np.ndarray, neighbours: np.ndarray, depth: np.ndarray, score: np.ndarray
) -> np.ndarray:
    """Find the neighbour with the largest gain of score among those whose bit is set in `members`, (n,).

    A diagonal step is longer than an edge step, so a third of its gain in depth is subtracted.
    """
    best = np.full(len(source), np.iinfo(np.int64).min)
    chosen = np.zeros(len(source), dtype=np.int64)
    for direction in range(len(RING)):
        target = neighbours[source, direction]
        gain = score[target] - score[source]
        if direction % 2:
            gain -= (depth[target] - depth[source]) * (_BY_DISTANCE // 3)
        better = (members >> np.uint8(direction) & 1).astype(bool) & (gain > best)
        best[better], chosen[better] = gain[better], target[better]
    return chosen


def _groups_of(flags: int) -> list[int]:
    """Split the set bits of a ring of neighbours into 8-connected groups, as bit masks."""
    groups: list[int] = []
    for direction in range(len(RING)):
        if not flags >> direction & 1:
            continue
        # Edge neighbours on both sides of a diagonal neighbour touch each other; diagonal neighbours do not.
        reach = (1, 7) if direction % 2 else (1, 2, 6, 7)
        linked = sum(1 << (direction + step) % 8 for step in reach)
        touching = [group for group in groups if group & linked]
        groups = [group for group in groups if not group & linked]
        groups.append(sum(touching) | 1 << direction)
    return groups


def _group_table() -> np.ndarray:
    """List the bit masks of the groups, at most four, in each of 256 sets of neighbours, (256, 4)."""
    table = np.zeros((256, 4), dtype=np.uint8)
    for flags in range(256):
        for number, group in enumerate(_groups_of(flags)):
            table[flags, number] = group
    return table


_GROUPS = _group_table()


TANGENT_PIXELS = 25
"""Length over which the direction of a line end is measured before it is extended by the pixels that pruning took."""


def trace(raster: RailRaster, pixels: Pixels, edges: np.ndarray, tips: np.ndarray) -> LineNetwork:
    """Make polylines of the edges, (e, 2), of a graph on pixels into which the cells of a raster were doubled.

    A line that ends at a pixel is extended up to its tip, (n,) numbers of pixels.
    """
    if len(edges) == 0:
        return LineNetwork((), np.empty((0, 2)), np.empty((0, 2), dtype=np.int64))
    vertices, borders = chains(edges, len(pixels))
    corners, borders = _corners(vertices, borders, pixels.cells)
    lines = np.split(corners, borders[1:-1])
    used, ends = np.unique([(line[0], line[-1]) for line in lines], return_inverse=True)
    ends = ends.reshape(-1, 2)
    degree = np.bincount(ends.ravel())
    nodes = pixels.cells[used].astype(float)
    positions = [pixels.cells[line].astype(float) for line in lines]
    for line, (start, end) in zip(positions, ends):
        for inward, node in ((line, start), (line[::-1], end)):
            if degree[node] == 1:
                inward[0] += _extension(inward, pixels.cells[tips[used[node]]])
                nodes[node] = inward[0]
    return LineNetwork(tuple(raster.to_local(line / 2) for line in positions), raster.to_local(nodes / 2), ends)


def chains(edges: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Cut a graph into chains at all vertices whose degree is not 2; a closed loop is cut at one of its vertices.

    Every edge is two half-edges, each with a pointer to the next one; pointer doubling ranks them all at once. Returns
    the vertices of all chains in sequence, both end nodes included, and where each chain begins among them, (c + 1,).
    """
    tail, head = np.concatenate([edges, edges[:, ::-1]]).T
    number = np.arange(len(tail))
    reverse = np.roll(number, len(edges))
    degree = np.bincount(tail, minlength=count)
    runs_on = (degree == 2) & ~_seams(edges, degree)
    leaving_sum = np.bincount(tail, weights=number, minlength=count).astype(np.int64)
    jump = np.where(runs_on[head], leaving_sum[head] - reverse, number)
    steps = (jump != number).astype(np.int64)
    while not np.array_equal(jump[jump], jump):
        steps += steps[jump]
        jump = jump[jump]

    first = number[~runs_on[tail]]
    first = first[jump[first] < reverse[first]]
    kept = np.zeros(len(tail), dtype=bool)
    kept[jump[first]] = True
    members = number[kept[jump]]
    members = members[np.lexsort([-steps[members], jump[members]])]
    last = np.flatnonzero(steps[members] == 0)
    vertices = np.insert(tail[members], last + 1, head[members[last]])
    return vertices, np.concatenate([[0], last + 2 + np.arange(len(last))])


def _seams(edges: np.ndarray, degree: np.ndarray) -> np.ndarray:
    """Mark one vertex of every closed loop, (count,) bool."""
    count = len(degree)
    graph = coo_matrix((np.ones(len(edges), dtype=np.int8), edges.T), shape=(count, count))
    _, component = connected_components(graph, directed=False)
    has_node = np.bincount(component, weights=degree != 2) > 0
    _, first = np.unique(component, return_index=True)
    seams = np.zeros(count, dtype=bool)
    seams[first] = ~has_node
    return seams


def _corners(vertices: np.ndarray, borders: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Drop vertices at which a chain is straight: the same line with a fraction of the vertices."""
    step = np.diff(cells[vertices], axis=0)
    keep = np.ones(len(vertices), dtype=bool)
    keep[1:-1] = (step[1:] != step[:-1]).any(axis=1)
    keep[borders[:-1]] = True
    keep[borders[1:] - 1] = True
    return vertices[keep], np.concatenate([[0], np.cumsum(keep)])[borders]


def _extension(inward: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """Return the step out of a line, given from its end inward, along its direction there until level with `tip`."""
    line = Polyline(inward)
    back = line.at(np.array([min(TANGENT_PIXELS, line.length_m)]))[0]
    outward = (inward[0] - back) / np.hypot(*(inward[0] - back))
    return max(np.dot(tip - inward[0], outward), 0.0) * outward
