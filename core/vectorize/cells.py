"""The cells of rails, and what they show beside a line: the other rail of its track.

See docs/method.md section 4.9.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..lines.ends import STEP_M, even_points

STEADY_M = 8.0
"""Length of line on either side of a join that is to be of one curvature."""

STAIRS_LENGTH_M = 1.0
"""Shorter parts of a line show the direction of stairs."""

AT_GAUGE_M = 0.045
"""Largest distance from a place at gauge to the nearest cell of a partner: half the diagonal of a cell, and the stairs
of the line."""


@dataclass(frozen=True)
class RailCells:
    """Places of rail cells, (n, 2) local metres, as a tree, and the distances between the axes of a track's rails."""

    tree: cKDTree
    spacings_m: Sequence[float] = ()

    def change_of_sides(self, one: np.ndarray, other: np.ndarray) -> float:
        """Return how surely, 0 to 1, two ways, given from their ends inward, have their partners on different sides."""
        sides, other_sides = self._partners(one)[::-1], self._partners(other)
        return min(max(sides), max(other_sides)) - max(min(pair) for pair in zip(sides, other_sides))

    def _partners(self, way: np.ndarray) -> tuple[float, float]:
        """Return the shares of a way, up to `STEADY_M`, that have the other rail of a track on its left and right."""
        points = even_points(way, STEADY_M)
        if len(points) * STEP_M < STAIRS_LENGTH_M or not self.spacings_m:
            return 0.0, 0.0
        along = np.arange(len(points))
        powers = np.vander(along, 3)
        arc = np.linalg.lstsq(powers, points, rcond=None)[0]  # the stairs would turn the direction to the partner
        ahead = 2 * np.outer(along, arc[0]) + arc[1]
        left = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.hypot(*ahead.T)[:, None]
        beside = np.multiply.outer([1.0, -1.0], np.multiply.outer(self.spacings_m, left))
        at_gauge = self.tree.query(powers @ arc + beside)[0] < AT_GAUGE_M
        left_share, right_share = at_gauge.mean(axis=2).max(axis=1).tolist()
        return left_share, right_share
