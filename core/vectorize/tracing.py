"""The pruned graph of pixels becomes polylines that run from node to node (docs/method.md section 4.5)."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..lines.network import LineNetwork
from ..polyline import length_along
from ..raster import RailRaster
from .pixels import Pixels

TANGENT_PIXELS = 25
"""Length over which the direction of a line end is measured before it is extended by the pixels that pruning took."""


def trace(raster: RailRaster, pixels: Pixels, edges: np.ndarray, tips: np.ndarray) -> LineNetwork:
    """Make polylines of the edges of a graph on doubled pixels.

    Parameters
    ----------
    raster : RailRaster
        Raster whose cells were doubled into the pixels.
    pixels : Pixels
    edges : (e, 2) int array
    tips : (n,) int array
        For each pixel, the pixel up to which a line that ends there is extended.
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

    Every edge is two half-edges, each with a pointer to the next one; pointer doubling ranks them all at once.

    Parameters
    ----------
    edges : (e, 2) int array
    count : int
        Number of vertices.

    Returns
    -------
    vertices : (n,) int array
        Vertices of all chains in sequence, both end nodes included.
    borders : (c + 1,) int array
        Where each chain begins in `vertices`.
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
    along = length_along(inward)
    back = [np.interp(min(TANGENT_PIXELS, along[-1]), along, axis) for axis in inward.T]
    outward = (inward[0] - back) / np.hypot(*(inward[0] - back))
    return max(np.dot(tip - inward[0], outward), 0.0) * outward
