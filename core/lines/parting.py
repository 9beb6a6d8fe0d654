"""How two rails part: the law by which the distance between their axes grows (docs/method.md sections 4.11 and 6.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..polyline import interpolate, left_normals, length_along

ARC, STRAIGHT = 2, 1
"""Powers of the way by which the distance grows: the branch begins on an arc, or at an angle."""


@dataclass(frozen=True)
class PartingLaw:
    """Distance between two axes over the way along one of them: (slope * way + root)^power, or 0 before they touch.

    Attributes
    ----------
    slope, root : float
        Of the straight line that the power-th root of the distance follows.
    power : int
        `ARC` or `STRAIGHT`.
    """

    slope: float
    root: float
    power: int

    @classmethod
    def fitted(cls, way: np.ndarray, apart: np.ndarray, power: int, weights: np.ndarray | None = None) -> PartingLaw:
        """Fit the law to distances by a straight line through their roots.

        Parameters
        ----------
        way, apart : (n,) arrays
            Way along one rail, and distance of the other one there, metres; negative distances count as 0.
        power : int
            `ARC` or `STRAIGHT`.
        weights : (n,) array, optional
            Factors of the residuals before squaring.
        """
        slope, root = np.polyfit(way, np.maximum(apart, 0.0) ** (1 / power), 1, w=weights)
        return cls(float(slope), float(root), power)

    def way_at(self, apart_m: float) -> float:
        """Return the way at which the axes are `apart_m` apart; -inf if they do not part."""
        return (apart_m ** (1 / self.power) - self.root) / self.slope if self.slope > 0 else -np.inf

    @property
    def touch(self) -> float:
        """Way at which the axes touch; -inf if they do not part."""
        return self.way_at(0.0)

    def __call__(self, way: np.ndarray) -> np.ndarray:
        """Return the distances at (n,) places along the way, metres."""
        return np.maximum(self.slope * way + self.root, 0.0) ** self.power


def left_of(line: np.ndarray, at: np.ndarray, left_m: np.ndarray) -> np.ndarray:
    """Return places next to a line.

    Parameters
    ----------
    line : (n, 2) array
    at, left_m : (k,) arrays
        Chainage of each place, and its distance to the left of the line, metres.

    Returns
    -------
    (k, 2) array
    """
    along = length_along(line)
    return interpolate(line, along, at) + left_m[:, None] * interpolate(left_normals(line), along, at)
