"""Sparse sets of pixels: neighbours, the parity fix (docs/method.md section 4.2) and the distance to the background.

Nothing here depends on tiles or bounding boxes, so there are no seams, and an empty plain costs nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

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
    """A set of pixels, sorted by row and column.

    Attributes
    ----------
    cells : (n, 2) int64 array
        Rows and columns.
    neighbours : (n, 8) int array
        Number of the neighbour in each direction of `RING`; n where there is none.
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
