"""Places that look like tracks in a cloud without guides: each tile is searched in all directions for two ridges.

The heights of a tile above the ground, seen along a direction, make a profile; two ridges at the distance of the rails
that explain it better than a level bed are a find, which is then checked as sections along guides are (`ridges`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.ndimage import distance_transform_edt, map_coordinates, median_filter

from ..progress import SILENT, Progress
from .ridges import HALF_M, Shape, binned, fit, windows
from .squares import ROW

CELL_M, AROUND_CELLS = 1.0, 5
"""Cells whose mean height states the ground, and the cells along a side whose median smooths it: a track bed is wider
than half of them, and rails and kerbs are not."""

OFF_GROUND_M = 0.35
"""Points farther from the ground than this are plants, cars, wires and walls."""

TILE_M, STEP_M = 20.0, 10.0
"""Side of a tile, and the distance to the next one where the surroundings of a find are searched."""

FEW_POINTS, MOST_POINTS = 60, 4000
"""Points in a tile below which it shows nothing, and above which every second, third, ... is enough."""

DIRECTIONS = 240
"""Directions that are tried: over half a tile, half a step is 7 cm, the width of a ridge."""

BIN_M, REACH_M = 0.1, 15.0
"""Width of the bins across, and half that of a profile: half the diagonal of a tile and of a bed."""

WINDOW_POINTS = 30
"""Points on a bed below which two ridges are chance."""

LOWEST_M, HIGHEST_M, ROUGHEST_M = 0.015, 0.16, 0.08
"""Heights of ridges between which they may be rails, and the standard deviation about them up to which it is a bed."""

LIKELY, FINDS = 10.0, 4
"""Log-likelihood of two ridges above a level bed that makes a find, which open ground does not reach, and the number of
finds in a tile, one for each track."""

ASIDE_M, TURNED_RAD = 1.0, 0.15
"""Finds closer than this, and turned by less, are the same."""

CHECK_BIN_M, CHECK_M = 0.05, 0.25
"""Width of the bins in which a find is checked, and how far to the sides."""

RIVALS_M, RIVAL_SHARE = (0.4, 1.1), 0.6
"""Distances at which another place excludes a find, if it has this share of its score: furrows of a field repeat."""

CHECKED = 4.0
"""Gain of both rails, less the flaws of their bed, that a find must have over a tile."""


@dataclass(frozen=True)
class Finds:
    """Places that look like tracks.

    Attributes
    ----------
    xy : (n, 2) array
        Middle of the track next to the middle of its tile, metres.
    direction : (n,) array
        Radians from east, 0 to pi.
    score : (n,) array
        Gain of both rails, less the flaws of their bed.
    """

    xy: np.ndarray
    direction: np.ndarray
    score: np.ndarray

    @classmethod
    def joined(cls, rows: list[tuple[float, float, float, float]]) -> Finds:
        """Return rows of x, y, direction and score as columns."""
        table = np.array(rows, dtype=float).reshape(-1, 4)
        return cls(table[:, :2], table[:, 2], table[:, 3])


def search(
    xyz: np.ndarray, first: np.ndarray, side_m: float, shape: Shape, progress: Progress = SILENT
) -> list[tuple[float, float, float, float]]:
    """Search a square for tracks.

    Parameters
    ----------
    xyz : (n, 3) array
        Points in the square and within `TILE_M` around it, metres.
    first : (2,) array
        Its corner with the smallest coordinates, multiples of `TILE_M`.
    shape : Shape
        Ridges as they are expected.

    Returns
    -------
    list of (x, y, direction, score)
    """
    near = _above_ground(xyz)
    tiles = _Tiles(near, first - TILE_M)
    count = int(round(side_m / STEP_M))
    grid = [(i, j) for i in range(2, count + 2, 2) for j in range(2, count + 2, 2)]
    found: dict[tuple[int, int], list[tuple[float, float, float, float]]] = {}
    for place in progress.follow(grid, len(grid)):
        found[place] = tiles.finds(place, shape)
    likely = {(i + a, j + b) for (i, j), rows in found.items() if rows for a in (-1, 0, 1) for b in (-1, 0, 1)}
    for place in sorted(likely - found.keys()):
        progress.check()
        found[place] = tiles.finds(place, shape)
    return [row for place in sorted(found) for row in found[place]]


def _above_ground(xyz: np.ndarray) -> np.ndarray:
    """Return the points near the ground with their heights above it, (k, 3)."""
    low = np.floor(xyz[:, :2].min(axis=0) / CELL_M) * CELL_M
    at = (xyz[:, :2] - low) / CELL_M
    shape = tuple((np.floor(at.max(axis=0)).astype(int) + 1).tolist())
    cell = np.ravel_multi_index(tuple(np.floor(at).astype(np.int64).T), shape)
    count = np.bincount(cell, minlength=shape[0] * shape[1]).reshape(shape)
    total = np.bincount(cell, xyz[:, 2], minlength=shape[0] * shape[1]).reshape(shape)
    nearest = distance_transform_edt(count == 0, return_distances=False, return_indices=True)
    ground = median_filter((total / np.maximum(count, 1))[tuple(nearest)], AROUND_CELLS, mode="nearest")
    height = xyz[:, 2] - map_coordinates(ground, at.T - 0.5, order=1, mode="nearest")
    near = np.abs(height) < OFF_GROUND_M
    return np.column_stack([xyz[near, :2], height[near]])


class _Tiles:
    """Points sorted into cells of `STEP_M`, of which two by two make a tile."""

    def __init__(self, xyh: np.ndarray, corner: np.ndarray) -> None:
        cell = np.floor((xyh[:, :2] - corner) / STEP_M).astype(np.int64)
        key = cell[:, 0] * ROW + cell[:, 1]
        order = np.argsort(key, kind="stable")
        self._points, self._key, self._corner = xyh[order], key[order], corner

    def finds(self, place: tuple[int, int], shape: Shape) -> list[tuple[float, float, float, float]]:
        """Search the tile with this first cell."""
        points = np.concatenate([self._cell(place[0] + i, place[1] + j) for i in (0, 1) for j in (0, 1)])
        if len(points) < FEW_POINTS:
            return []
        points = points[:: -(-len(points) // MOST_POINTS)]
        middle = self._corner + (np.array(place) + 1) * STEP_M
        local = points - [*middle, 0.0]
        rows = []
        for direction, left in _likely(local, shape):
            score, moved = _check(local, direction, left, shape)
            if score > CHECKED:
                x, y = middle + moved * np.array([-np.sin(direction), np.cos(direction)])
                rows.append((float(x), float(y), direction, score))
        return rows

    def _cell(self, i: int, j: int) -> np.ndarray:
        first, last = np.searchsorted(self._key, [i * ROW + j, i * ROW + j + 1])
        return self._points[first:last]


def _likely(local: np.ndarray, shape: Shape) -> Iterator[tuple[float, float]]:
    """Yield directions and distances to the left of the middle of a tile at which two ridges are likely."""
    score = _scores(local, shape.spacing_m, shape.width_m)
    places = (np.arange(score.shape[1]) - score.shape[1] // 2) * BIN_M
    for _ in range(FINDS):
        row, column = np.unravel_index(int(score.argmax()), score.shape)
        if score[row, column] < LIKELY:
            return
        yield float(_directions()[row]), float(places[column])
        turned = np.abs(np.arange(DIRECTIONS) - row)
        turned = np.minimum(turned, DIRECTIONS - turned) * np.pi / DIRECTIONS
        mirrored = np.where(np.abs(np.arange(DIRECTIONS) - row) > DIRECTIONS / 2, -1, 1)
        close = np.abs(places - mirrored[:, None] * places[column]) < ASIDE_M
        score = np.where((turned < TURNED_RAD)[:, None] & close, 0.0, score)


@lru_cache(maxsize=1)
def _directions() -> np.ndarray:
    return np.arange(DIRECTIONS) * np.pi / DIRECTIONS


@lru_cache(maxsize=4)
def _kernels(spacing_m: float, width_m: float) -> np.ndarray:
    """Return what sums the bins of a profile about each place: all, by the ridges' height, and by its square."""
    bins, places = int(round(2 * REACH_M / BIN_M)), int(round(TILE_M / BIN_M)) + 1
    u = (np.arange(bins) + 0.5) * BIN_M - REACH_M
    u = u[:, None] - (np.arange(places) - places // 2) * BIN_M
    bed = np.abs(u) < HALF_M
    ridges = bed * np.exp(-0.5 * ((np.abs(u) - spacing_m / 2) / width_m) ** 2)
    return np.stack([bed.astype(float), ridges, ridges**2]).astype(np.float32)


def _scores(local: np.ndarray, spacing_m: float, width_m: float) -> np.ndarray:
    """Return the log-likelihood of two ridges above that of a level bed, (DIRECTIONS, places)."""
    directions = _directions()
    across = local[:, 1:2] * np.cos(directions) - local[:, :1] * np.sin(directions)
    bins = int(round(2 * REACH_M / BIN_M))
    column = ((across + REACH_M) / BIN_M).astype(np.int32) + np.arange(DIRECTIONS, dtype=np.int32) * bins
    height = np.repeat(local[:, 2], DIRECTIONS)
    count, total, squares = (
        np.bincount(column.ravel(), weight, DIRECTIONS * bins).reshape(DIRECTIONS, bins).astype(np.float32)
        for weight in (None, height, height**2)
    )
    bed, ridges, ridges_squared = _kernels(spacing_m, width_m)
    number = np.maximum(count @ bed, 1.0)
    mean, expected = total @ bed / number, count @ ridges / number
    spread = np.maximum(count @ ridges_squared - number * expected**2, 1e-3)
    shared = total @ ridges - number * mean * expected
    level = np.maximum(squares @ bed - number * mean**2, 1e-6)
    height_m = shared / spread
    rest = np.maximum(level - height_m * shared, 1e-6)
    fits = (number > WINDOW_POINTS) & (height_m > LOWEST_M) & (height_m < HIGHEST_M)
    return np.where(fits & (rest < number * ROUGHEST_M**2), 0.5 * number * np.log(level / rest), 0.0)


def _check(local: np.ndarray, direction: float, left_m: float, shape: Shape) -> tuple[float, float]:
    """Return the score of a place with all checks of two rails on a bed, and where to the left it is best."""
    across = local[:, 1] * np.cos(direction) - local[:, 0] * np.sin(direction) - left_m
    half, aside = int(round(HALF_M / CHECK_BIN_M)), int(round(RIVALS_M[1] / CHECK_BIN_M))
    bins, low_m = 2 * (half + aside) + 1, -(half + aside + 0.5) * CHECK_BIN_M
    section = np.zeros(len(across), dtype=np.int64)
    count, height = binned(section, across, local[:, 2], 1, low_m, bins, CHECK_BIN_M)
    u = (np.arange(2 * half + 1) - half) * CHECK_BIN_M
    found = fit(windows(count, len(u)), windows(height, len(u)), u, shape, passes=3)
    score, place = (found.gain - found.flaw)[0], (np.arange(2 * aside + 1) - aside) * CHECK_BIN_M
    best = int(np.where(np.abs(place) <= CHECK_M, score, -np.inf).argmax())
    apart = np.abs(place - place[best])
    rival = score[(apart > RIVALS_M[0]) & (apart < RIVALS_M[1])].max()
    return float(score[best]) if rival < RIVAL_SHARE * score[best] else 0.0, left_m + float(place[best])
