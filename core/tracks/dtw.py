"""Dynamic time warping of two polylines: the sections that are within a tolerance of each other.

The matching of Gribov and Chang, section 9 (docs/method.md section 8.2): a vertex of one polyline paired with a
segment of the other is an edge of the lattice of vertex pairs (i, j); a match is a path along edges, each step
advancing on one of the polylines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

ADVANCE_SECOND, ADVANCE_FIRST = 0, 1
"""Kinds of edges: a vertex of the first with a segment of the second, (i, j) to (i, j + 1), and vice versa."""

TIE = 1e-9
"""Lengths that differ by less, relative to their size (or to 1), are sums of the same segments."""


@dataclass(frozen=True)
class Match:
    """A section of one polyline and the section of another that it matches.

    `first` and `second`, (k,), are successive vertices: from one entry to the next, exactly one of the two advances by
    one. `length` is the sum of the lengths of both sections, `penalty` the squared distance between vertices and their
    segments, integrated over the segments.
    """

    first: np.ndarray
    second: np.ndarray
    length: float
    penalty: float


@dataclass(frozen=True)
class LatticeEdges:
    """Valid pairs of a vertex and a segment as edges of the lattice, (n,) each, sorted by first, second and kind.

    An edge starts at the node (`first`, `second`); its `kind` is ADVANCE_SECOND or ADVANCE_FIRST, and its `length` that
    of the segment.
    """

    first: np.ndarray
    second: np.ndarray
    kind: np.ndarray
    length: np.ndarray
    penalty: np.ndarray


def match_polylines(first: np.ndarray, second: np.ndarray, tolerance: float) -> list[Match]:
    """Find the matches of two polylines, (m, 2) and (n, 2), in their given directions; the longest comes first.

    Vertices are abreast of each other, or else at steps of at most half the tolerance: the middle of a longer segment
    may be too far from any vertex. `tolerance` is the maximum distance between a vertex and a segment, exclusive.

    The longest path wins, and of equally long ones the one with the lowest penalty. Paths that share or continue an
    edge form a cluster, and each cluster gives one match. The paper says that a pair does not "follow" one further
    along; any order works in which pairs precede their continuations, and that of the lattice nodes is used here.
    """
    edges = lattice_edges(first, second, tolerance)
    if not len(edges.first):
        return []
    begin, end, node_count = _lattice_nodes(edges)
    cluster = _clusters(begin, end, node_count)
    best_length, best_penalty, arrival = _best_arrivals(edges, begin, end, node_count)
    length, penalty = best_length[begin] + edges.length, best_penalty[begin] + edges.penalty
    predecessor = arrival[begin]
    order = _longest_then_cheapest(length, penalty)
    _, best = np.unique(cluster[order], return_index=True)
    return [_trace(edges, predecessor, edge, length[edge], penalty[edge]) for edge in order[np.sort(best)].tolist()]


def lattice_edges(first: np.ndarray, second: np.ndarray, tolerance: float) -> LatticeEdges:
    """Pair every vertex with every segment of the other polyline that is closer than the tolerance."""
    ahead, turned = _near_pairs(first, second, tolerance), _near_pairs(second, first, tolerance)
    turned = (turned[1], turned[0], *turned[2:])
    kind = np.repeat([ADVANCE_SECOND, ADVANCE_FIRST], [len(ahead[0]), len(turned[0])])
    i, j, length, penalty = (np.concatenate(columns) for columns in zip(ahead, turned))
    order = np.lexsort((kind, j, i))
    return LatticeEdges(i[order], j[order], kind[order], length[order], penalty[order])


def _near_pairs(points: np.ndarray, line: np.ndarray, tolerance: float) -> tuple[np.ndarray, ...]:
    """Return the vertices of `points` and segments of `line` that are close: both numbers, segment length, penalty."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    reach = tolerance + 0.5 * steps.max(initial=0.0)  # a close segment has an end within this distance
    near = cKDTree(points).sparse_distance_matrix(cKDTree(line), reach, output_type="ndarray")
    vertex = np.concatenate([near["i"], near["i"]])
    segment = np.concatenate([near["j"], near["j"] - 1])
    inside = (segment >= 0) & (segment < len(line) - 1)
    vertex, segment = np.divmod(np.unique(vertex[inside] * len(line) + segment[inside]), len(line))
    p, q = line[segment] - points[vertex], line[segment + 1] - points[vertex]
    close = distance_to_segment(p, q) < tolerance
    return vertex[close], segment[close], steps[segment[close]], squared_distance_integral(p[close], q[close])


def distance_to_segment(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the distance of the segments from p to q, (n, 2) each, from the origin, (n,)."""
    along = q - p
    squared = np.einsum("ij,ij->i", along, along)
    share = np.clip(-np.einsum("ij,ij->i", p, along) / np.maximum(squared, np.finfo(float).tiny), 0.0, 1.0)
    return np.linalg.norm(p + share[:, None] * along, axis=1)


def squared_distance_integral(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Integrate the squared distance from the origin along the segments from p to q, (n, 2) each; returns (n,).

    Gribov and Chang, appendix.
    """
    length = np.linalg.norm(q - p, axis=1)
    return length / 3 * np.einsum("ij,ij->i", p, p + q) + length / 3 * np.einsum("ij,ij->i", q, q)


def _lattice_nodes(edges: LatticeEdges) -> tuple[np.ndarray, np.ndarray, int]:
    """Find the lattice nodes, numbered from 0, where edges start, (n,), and end, (n,), and the number of nodes."""
    width = int(edges.second.max()) + 2
    begin = edges.first * width + edges.second
    end = begin + np.where(edges.kind == ADVANCE_FIRST, width, 1)
    used, number = np.unique(np.concatenate([begin, end]), return_inverse=True)
    begin, end = number.reshape(2, -1)
    return begin, end, len(used)


def _clusters(begin: np.ndarray, end: np.ndarray, node_count: int) -> np.ndarray:
    """Return the number of each edge's cluster, (n,): edges are linked where one continues another.

    A node links its edges only if some end and some start there.
    """
    continued = np.zeros((2, node_count), dtype=bool)
    continued[0, end] = continued[1, begin] = True
    through = continued[0] & continued[1]
    arriving, leaving = np.flatnonzero(through[end]), np.flatnonzero(through[begin])
    edge = np.concatenate([arriving, leaving])
    node = len(begin) + np.concatenate([end[arriving], begin[leaving]])
    size = len(begin) + node_count
    links = coo_matrix((np.ones(len(edge), dtype=bool), (edge, node)), shape=(size, size))
    return connected_components(links, directed=False)[1][: len(begin)]


def _best_arrivals(edges: LatticeEdges, begin: np.ndarray, end: np.ndarray, node_count: int) -> tuple[np.ndarray, ...]:
    """Return length and penalty of the best path to each node and its last edge, -1 if there is none; (k,) each.

    Plain lists are used because the edges must be taken one by one, for which numpy is ten times slower.
    """
    best_length, best_penalty, arrival = [0.0] * node_count, [0.0] * node_count, [-1] * node_count
    steps = zip(begin.tolist(), end.tolist(), edges.length.tolist(), edges.penalty.tolist())
    for edge, (here, there, length, penalty) in enumerate(steps):
        length += best_length[here]
        penalty += best_penalty[here]
        gain = length - best_length[there]
        tie = TIE * length if length > 1.0 else TIE
        if gain > tie or (gain >= -tie and penalty < best_penalty[there]):
            best_length[there], best_penalty[there], arrival[there] = length, penalty, edge
    return np.array(best_length), np.array(best_penalty), np.array(arrival)


def _longest_then_cheapest(length: np.ndarray, penalty: np.ndarray) -> np.ndarray:
    """Return the order, (n,), by descending length and, for equal lengths, by ascending penalty."""
    falling = np.argsort(-length, kind="stable")
    shorter = -np.diff(length[falling]) > TIE * np.maximum(length[falling][1:], 1.0)
    rank = np.concatenate([[0], np.cumsum(shorter)])
    return falling[np.lexsort((penalty[falling], rank))]


def _trace(edges: LatticeEdges, predecessor: np.ndarray, last: int, length: float, penalty: float) -> Match:
    """Follow the predecessors from a path's last edge to its first."""
    backwards = [last]
    while predecessor[backwards[-1]] >= 0:
        backwards.append(int(predecessor[backwards[-1]]))
    path = np.array(backwards[::-1])
    first = np.append(edges.first[path], edges.first[last] + (edges.kind[last] == ADVANCE_FIRST))
    second = np.append(edges.second[path], edges.second[last] + (edges.kind[last] == ADVANCE_SECOND))
    return Match(first, second, float(length), float(penalty))
