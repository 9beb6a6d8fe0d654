"""How two rails part: the law by which the distance between their axes grows along the way (docs/method.md 4.11)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..polyline import interpolate, left_normals, length_along

ARC, STRAIGHT = 2, 1
"""Powers of the way by which the distance grows: where a branch begins on an arc, and where it begins at an angle."""


@dataclass(frozen=True)
class PartingLaw:
    """Distance between two axes, (slope * way + root)^power metres, from the place where it is 0.

    Attributes
    ----------
    slope, root : float
        Of the straight line that the root of the distance is over the way.
    power : int
        `ARC` or `STRAIGHT`.
    """

    slope: float
    root: float
    power: int

    @classmethod
    def fitted(cls, way: np.ndarray, apart: np.ndarray, power: int, weights: np.ndarray | None = None) -> PartingLaw:
        """Fit the law to distances; the root of the distance grows evenly, so the fit is a straight line.

        Parameters
        ----------
        way, apart : (n,) arrays
            Way along one rail and the distance of the other one there, metres; negative distances count as 0.
        power : int
            `ARC` or `STRAIGHT`.
        weights : (n,) array, optional
            Weights of the roots, not of their squares.
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

    @property
    def curvature(self) -> float:
        """Curvature of one rail relative to the other on an arc, 1/m: the distance is half of it times way squared."""
        return 2 * self.slope**2

    def __call__(self, way: np.ndarray) -> np.ndarray:
        """Return the distances at (n,) places along the way, metres."""
        return np.maximum(self.slope * way + self.root, 0.0) ** self.power


def left_of(line: np.ndarray, at: np.ndarray, left_m: np.ndarray) -> np.ndarray:
    """Return the places at chainages `at` of a line, (n, 2), and `left_m` to its left, (k, 2); both are (k,) metres."""
    along = length_along(line)
    return interpolate(line, along, at) + left_m[:, None] * interpolate(left_normals(line), along, at)
