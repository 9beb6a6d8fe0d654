"""Points on railheads: those near the axes of kept lines, in the height of their tops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .lines import Lines
from .pieces import HIDDEN_M, links
from .settings import Tolerances
from .tops import TENTHS_OF_MM

MEAN_M = 1.5
"""Length to either side over which tops are averaged: a beam from the air blends each of them with the ballast."""

UNDER_MEAN_M = 0.02
"""Tops this far below the mean are left out of it: a wide beam at the side of a head blends it with the ballast."""

NEAREST, MIN_AXES = 6, 2
"""Axes that are looked at for a point, and how many of them it must be on: where two heads part there are some of
each, and single axes are led astray by a guard rail."""

NEAR_M, BEYOND_M = 0.12, HIDDEN_M + 0.3
"""Distance to an axis up to which a point may be on it, along a line and at its ends. Behind a wheel at the end of a
cloud, the rail is too short to show its direction: the axis before the wheel continues to it."""

RIDGE_M2 = 5.0
"""Keeps the line through the tops level where few of them are seen, or near each other only."""

WIDEST_M = 0.075
"""Distance from the axis within which points count towards the width of a top: short of a guard rail."""


@dataclass(frozen=True)
class Near:
    """Points and the cells nearest to them in whose height they are.

    Attributes
    ----------
    count : int
        Number of points.
    point, cell : (m,) int arrays
        Pairs; the nearest cell of each point comes first.
    across : (m,) array
        How far the point is across from the axis of the cell, metres.
    """

    count: int
    point: np.ndarray
    cell: np.ndarray
    across: np.ndarray

    @classmethod
    def find(cls, xy: np.ndarray, z: np.ndarray, lines: Lines, tops: np.ndarray, tolerances: Tolerances) -> Near:
        """Find the `NEAREST` cells around points.

        Parameters
        ----------
        xy, z : (n, 2) and (n,) arrays
        lines : Lines
        tops : (cells,) array
            Heights of the cells' tops.
        tolerances : Tolerances
        """
        top, grade = _along(lines, tops)
        points = _roughly_near(xy, z, lines, top, tolerances)
        if not len(points):
            return cls(len(xy), points, points, np.empty(0))
        count = np.arange(1, min(NEAREST, len(lines.axis)) + 1)
        within_m = max(lines.reach_m, BEYOND_M)
        _, near = cKDTree(lines.axis).query(xy[points], k=count, distance_upper_bound=within_m)
        row, rank = np.nonzero(near < len(lines.axis))
        point, cell = points[row], near[row, rank]
        step = xy[point] - lines.axis[cell]
        ahead, across = (np.einsum("ij,ij->i", step, unit[cell]) for unit in (lines.along, lines.across))
        above = z[point] - top[cell] - grade[cell] * ahead
        level = (above >= -tolerances.below_m) & (above <= tolerances.above_m)
        return cls(len(xy), point[level], cell[level], across[level])

    def on(self, half_m: float, fits: np.ndarray) -> np.ndarray:
        """Return which points are within `half_m` of `MIN_AXES` axes that fit, (m,) bool; (count,) bool."""
        on = (np.abs(self.across) <= half_m) & fits
        return np.bincount(self.point[on], minlength=self.count) >= MIN_AXES

    def widths(self, piece: np.ndarray) -> np.ndarray:
        """Width of the top of each piece: that of a bar whose points scatter across as much, (pieces,) metres.

        `piece` has the piece of each cell, (cells,).
        """
        inside = np.abs(self.across) < WIDEST_M
        # Whole numbers add up to the same sum in any order of the points.
        across, number = np.round(self.across[inside] * TENTHS_OF_MM), piece[self.cell[inside]]
        count = int(piece.max()) + 1
        points = np.maximum(np.bincount(number, minlength=count), 1)
        mean = np.bincount(number, across, count) / points
        spread = np.sqrt(np.maximum(np.bincount(number, across**2, count) / points - mean**2, 0))
        return np.sqrt(12) * spread / TENTHS_OF_MM


def _along(lines: Lines, tops: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fit a straight line to the tops, (cells,), along each cell's line: its height at the cell and gradient."""
    pairs, count = links(lines, MEAN_M), len(tops)
    own, other = np.concatenate([pairs, pairs[:, ::-1], np.repeat(np.arange(count)[:, None], 2, axis=1)]).T
    ahead = np.einsum("ij,ij->i", lines.axis[other] - lines.axis[own], lines.along[own])
    rise = tops[other] - tops[own]
    used = np.ones(len(own), dtype=bool)
    for _ in range(2):
        cell, x, y = own[used], ahead[used], rise[used]
        seen = np.maximum(np.bincount(cell, minlength=count), 1)
        mean_x, mean_y = np.bincount(cell, x, count) / seen, np.bincount(cell, y, count) / seen
        spread, common = (np.bincount(cell, x * other, count) for other in (x, y))
        grade = (common - seen * mean_x * mean_y) / (spread - seen * mean_x**2 + RIDGE_M2)
        offset = mean_y - grade * mean_x
        used = rise - offset[own] - grade[own] * ahead >= -UNDER_MEAN_M
    return tops + offset, grade


def _roughly_near(xy: np.ndarray, z: np.ndarray, lines: Lines, top: np.ndarray, tolerances: Tolerances) -> np.ndarray:
    """Return the points, (k,) numbers, near axes and beyond the ends of lines, and few others; see `Near.find`."""
    pairs = links(lines, NEAR_M)
    own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    ahead = np.einsum("ij,ij->i", lines.axis[other] - lines.axis[own], lines.along[own])
    continues = np.zeros((2, len(lines.axis)), dtype=bool)
    continues[(ahead > 0).astype(int), own] = True
    found = []
    for cells, reach_m in ((np.arange(len(top)), NEAR_M), (np.flatnonzero(~continues.all(axis=0)), BEYOND_M)):
        point, place = around(xy, lines.axis[cells], reach_m)
        above = z[point] - top[cells[place]]
        found.append(point[(above > -3 * tolerances.below_m) & (above < 3 * tolerances.above_m)])
    return np.union1d(*found)


def around(xy: np.ndarray, places: np.ndarray, reach_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the points, (k,) numbers, in cells around places, (m, 2), and for each a place there, (k,) numbers.

    All points within `reach_m` of a place are returned, and few others: many times as fast as to ask each point for
    the nearest place.
    """
    if not len(places):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    corner = places.min(axis=0) - 2 * reach_m
    columns, rows = np.floor((places - corner) / reach_m).astype(np.int32).T
    image = np.full((int(columns.max()) + 3, int(rows.max()) + 3), -1)
    for right in (-1, 0, 1):
        for up in (-1, 0, 1):
            image[columns + right, rows + up] = np.arange(len(places))
    image[columns, rows] = np.arange(len(places))
    column, row = (
        np.clip((values - low) / reach_m, 0, size - 1).astype(np.int32)
        for values, low, size in zip(xy.T, corner, image.shape)
    )
    place = image[column, row]
    point = np.flatnonzero(place >= 0)
    return point, place[point]
