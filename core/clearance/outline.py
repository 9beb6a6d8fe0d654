"""The signed distance of points to the outline of a profile: positive inside."""

from __future__ import annotations

import numpy as np

from ..clouds.mask import Mask
from .profiles import Profile

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

    def distance(self, vw: np.ndarray) -> np.ndarray:
        """Return the distance of points, (n, 2), to the outline, (n,), positive inside."""
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
        for at, ((v, w), (along, up)) in enumerate(zip(self.start, self.step)):
            right, high = vw[:, 0] - v, vw[:, 1] - w
            share = np.clip((right * along + high * up) / (along**2 + up**2), 0.0, 1.0)
            away = (right - share * along) ** 2 + (high - share * up) ** 2
            closer = away < best
            best[closer], number[closer] = away[closer], at
        return np.sqrt(best), number


def _is_foot(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return which edges, (n,), cross the middle of the track at the lowest height: where the outline closes."""
    spans = (np.minimum(start[:, 0], end[:, 0]) <= 0) & (np.maximum(start[:, 0], end[:, 0]) >= 0)
    across = end[:, 0] - start[:, 0]
    share = np.divide(-start[:, 0], across, out=np.zeros(len(start)), where=np.abs(across) > SAME_M)
    height = np.where(spans, start[:, 1] + share * (end[:, 1] - start[:, 1]), np.inf)
    return spans & (height <= height.min() + SAME_M)
