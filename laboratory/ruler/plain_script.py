"""A plain script that extracts rails by closing, scikit-image's skeleton and Gaussian smoothing.

It is the baseline in each table of accuracy.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_closing, binary_dilation, convolve, gaussian_filter1d, label, maximum
from scipy.spatial import cKDTree
from skimage.morphology import skeletonize

from ...core.clouds.points import RailPoints
from ...core.polyline import Polyline
from ...core.raster import cell_size, rasterize

SMOOTHING_M = 0.8
"""Standard deviation of the Gaussian along a piece: the same number as in our smoothing."""

SHORTEST_M = 1.0
"""Length below which pieces are dropped, as in our lines."""

REACH_M = 0.10
"""Radius in plan of the points that give the height of a vertex, as in our elevation."""

CLOSING = np.ones((5, 5), dtype=bool)
"""Closes holes of up to four cells, the distance between profiles."""

SPUR_CELLS, PRUNINGS = 10, 3
"""Length below which branches are spurs, and rounds of pruning: each round can expose new spurs."""

AROUND = np.ones((3, 3), dtype=int)


def script_lines(points: RailPoints, gauge_m: float, head_width_m: float) -> list:
    """Extract rail lines, (n, 3) local metres, with plain methods."""
    raster = rasterize(points.xyz, cell_size(gauge_m, head_width_m))
    cells = raster.cells()
    corner = cells.min(axis=0) - 2
    height, width = cells.max(axis=0) + 3 - corner
    top, left = corner.tolist()
    skeleton = skeletonize(binary_closing(raster.read(top, left, int(height), int(width)), CLOSING))
    for _ in range(PRUNINGS):
        skeleton = _pruned(skeleton)
    lines = []
    for piece in _pieces(skeleton):
        xy = raster.to_local(piece + corner)
        length_m = Polyline(xy).length_m
        if length_m >= SHORTEST_M:
            sigma = SMOOTHING_M / (length_m / (len(xy) - 1))
            lines.append(gaussian_filter1d(xy, sigma, axis=0, mode="mirror"))
    risen = [(xy, _heights(xy, points.xyz)) for xy in lines]
    return [np.column_stack([xy, z]) for xy, z in risen if z is not None]


def _pieces(skeleton: np.ndarray) -> list:
    """Cut a skeleton at its junctions and return the cells of each piece in order, a list of (n, 2) arrays."""
    chains, count = label(skeleton & (_neighbours(skeleton) <= 2), AROUND)
    cells = np.argwhere(chains)
    order = np.argsort(chains[tuple(cells.T)], kind="stable")
    borders = np.searchsorted(chains[tuple(cells[order].T)], np.arange(1, count + 2))
    return [_ordered(cells[order[a:b]]) for a, b in zip(borders, borders[1:])]


def _pruned(skeleton: np.ndarray) -> np.ndarray:
    """Delete short branches that start at a junction, and thin the junctions again."""
    neighbours = _neighbours(skeleton)
    junctions = skeleton & (neighbours > 2)
    chains, count = label(skeleton & ~junctions, AROUND)
    numbers = np.arange(1, count + 1)
    free = maximum(neighbours == 1, chains, numbers).astype(bool)
    hanging = maximum(binary_dilation(junctions, AROUND), chains, numbers).astype(bool)
    short = np.bincount(chains.ravel())[1:] < SPUR_CELLS
    spurs = np.append(False, free & hanging & short)
    return skeletonize(skeleton & ~spurs[chains])


def _neighbours(skeleton: np.ndarray) -> np.ndarray:
    """Count the set cells around each set cell; other cells have 0."""
    return skeleton * (convolve(skeleton.astype(int), AROUND, mode="constant") - 1)


def _ordered(cells: np.ndarray) -> np.ndarray:
    """Return the cells of a chain in order from one of its ends."""
    links = cKDTree(cells).query_ball_point(cells, 1.5)
    at = min(range(len(cells)), key=lambda number: len(links[number]))
    walk, seen = [at], {at}
    while True:
        ahead = [number for number in links[at] if number not in seen]
        if not ahead:
            return cells[walk]
        at = min(ahead, key=lambda number: np.abs(cells[number] - cells[at]).sum())
        walk.append(at)
        seen.add(at)


def _heights(xy: np.ndarray, points: np.ndarray) -> np.ndarray | None:
    """Return the smoothed mean height of the points around each vertex, linear across gaps, or None without points."""
    near = cKDTree(points[:, :2]).query_ball_point(xy, REACH_M)
    z = np.array([points[numbers, 2].mean() if numbers else np.nan for numbers in near])
    known = np.flatnonzero(np.isfinite(z))
    if len(known) == 0:
        return None
    z = np.interp(np.arange(len(z)), known, z[known])
    spacing_m = Polyline(xy).length_m / (len(xy) - 1)
    return gaussian_filter1d(z, SMOOTHING_M / spacing_m, mode="mirror")
