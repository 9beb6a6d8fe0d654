"""The signed distance of points to the outline of a profile: positive inside."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.ndimage import binary_dilation, map_coordinates

from ..clouds.mask import Mask
from .profiles import Profile

CELL_M = 0.02
"""Side of the cells of the table of distances: the bend of the distance within one is below a centimetre."""

NEAR_M = 0.25
"""Points deeper than this outside get their distance from the table; nearer ones exactly."""

ROOM_M = 2.0
"""Room of the table around the profile: more than points are kept beyond its half width."""

SAME_M = 1e-9
"""Heights closer than this are the same."""


class Outline:
    """The boundary of a profile above the lowest height that counts.

    Edges that lie wholly below `floor_m`, and the closing edge at the foot, do not count: nothing rises from the bed
    through them.
    """

    def __init__(self, profile: Profile, floor_m: float) -> None:
        ring = np.array(profile.points)
        start, end = ring, np.roll(ring, -1, axis=0)
        below = np.maximum(start[:, 1], end[:, 1]) <= floor_m
        kept = ~(below | _is_foot(start, end))
        self.start, self.step = start[kept], (end - start)[kept]
        self.floor_m = max(floor_m, float(ring[:, 1].min()))
        self._mask = Mask.of([np.vstack([ring, ring[:1]])])
        self._middle = np.array([0.0, ring[:, 1].mean()])
        self._low, self._high = ring.min(axis=0) - ROOM_M, ring.max(axis=0) + ROOM_M

    def distance(self, vw: np.ndarray) -> np.ndarray:
        """Return the distance of points, (n, 2), to the outline, (n,), positive inside; exact above -`NEAR_M`."""
        away, may_be_inside = self._from_table(vw)
        near = may_be_inside | (away < NEAR_M)
        found = -away
        found[near] = self.exact(vw[near])
        return found

    def exact(self, vw: np.ndarray) -> np.ndarray:
        """Return the exact signed distance of points, (n, 2)."""
        away = self._to_edges(vw)[0]
        return np.where(self._mask.holds(vw), away, -away)

    def inward(self, vw: np.ndarray) -> np.ndarray:
        """Return the unit vector, (2,), that leads inwards, across the edge nearest to a point, (2,)."""
        along = self.step[self._to_edges(vw[None])[1][0]]
        found = np.array([along[1], -along[0]]) / np.hypot(*along)
        return found if found @ (self._middle - vw) > 0 else -found

    def _to_edges(self, vw: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distance of points, (n,), to the nearest edge, and its number."""
        best, number = np.full(len(vw), np.inf), np.zeros(len(vw), dtype=np.int64)
        for at, (start, step) in enumerate(zip(self.start, self.step)):
            off = vw - start
            share = np.clip(off @ step / max(float(step @ step), SAME_M**2), 0.0, 1.0)
            away = np.hypot(off[:, 0] - share * step[0], off[:, 1] - share * step[1])
            closer = away < best
            best[closer], number[closer] = away[closer], at
        return best, number

    @cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        """Distances at the nodes of a grid, (rows, columns), and whether places around a node may be inside."""
        v = np.arange(self._low[0], self._high[0] + CELL_M, CELL_M)
        w = np.arange(self._low[1], self._high[1] + CELL_M, CELL_M)
        nodes = np.stack(np.meshgrid(v, w), axis=-1).reshape(-1, 2)
        inside = self._mask.holds(nodes).reshape(len(w), len(v))
        return self._to_edges(nodes)[0].reshape(inside.shape), binary_dilation(inside, np.ones((3, 3)))

    def _from_table(self, vw: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return distances interpolated in the table, and which points may be inside, (n,) each."""
        away, inside = self._table
        place = ((vw - self._low) / CELL_M).T[::-1]
        row, column = (np.clip(np.rint(one), 0, size - 1).astype(int) for one, size in zip(place, away.shape))
        return map_coordinates(away, place, order=1, mode="nearest"), inside[row, column]


def _is_foot(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return which edges, (n,), cross the middle of the track at the lowest height: where the outline closes."""
    spans = (np.minimum(start[:, 0], end[:, 0]) <= 0) & (np.maximum(start[:, 0], end[:, 0]) >= 0)
    across = end[:, 0] - start[:, 0]
    share = np.divide(-start[:, 0], across, out=np.zeros(len(start)), where=np.abs(across) > SAME_M)
    height = np.where(spans, start[:, 1] + share * (end[:, 1] - start[:, 1]), np.inf)
    return spans & (height <= height.min() + SAME_M)
