"""The veinerization graph: arcs from every pixel to deeper ones; weak branches are then pruned.

Deseilligny, Stamon and Suen, "Veinerization: a new shape description for flexible skeletonization", IEEE PAMI 20(5),
1998; the steps: docs/method.md sections 4.3 and 4.4.
"""

from __future__ import annotations

import numpy as np

from .pixels import EAST, NORTH, RING, SOUTH, WEST, Pixels

AREA_PIXELS = 12
"""A line end must drain at least this many (doubled) pixels; with fewer it is a bump of the border."""

SECTOR_ANGLE = np.pi
"""A line end must drain a sector of this angle, radians, of its own largest disc: half of the disc."""

_BY_SUM = 1323
_BY_EAST = _BY_SUM + 27
_BY_SOUTH = _BY_SUM + 189
_BY_DISTANCE = 29 * _BY_SUM


def veinerize(pixels: Pixels, distance: np.ndarray) -> np.ndarray:
    """Link every pixel to its steepest deeper neighbours, one in each connected group of them.

    Parameters
    ----------
    pixels : Pixels
    distance : (n,) int array
        Chamfer distance to the background.

    Returns
    -------
    (e, 2) int array
        Undirected edges; the graph has the components of the image and, as independent cycles, its holes.
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

    Parameters
    ----------
    edges : (e, 2) int array
    distance : (n,) int array
        Chamfer distance; two units per pixel.

    Returns
    -------
    edges : (f, 2) int array
        Remaining edges.
    tips : (n,) int array
        For each pixel the far end of the longest branch removed from it, or the pixel itself: where a line that ends
        at the pixel really ends.
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
