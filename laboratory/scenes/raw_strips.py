"""Strips of track made of random points, straight or in a curve, for tests of what follows rails."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .raw_shapes import TOP_M

GAUGE_M, WIDTH_M = 1.435, 0.072
SPACING_M = GAUGE_M + WIDTH_M

GROOVE_M = (0.045, 0.04)
"""Width and depth of the grooves in a pavement."""

Lefts = Callable[[np.ndarray], np.ndarray]
"""Place of a rail to the left of the middle, by the place along; NaN where it is missing."""


@dataclass(frozen=True)
class Strip:
    """Points of a bed, (n, 3), and which of them are on heads."""

    xyz: np.ndarray
    head: np.ndarray
    curvature: float

    def at(self, along: float, left: float) -> np.ndarray:
        """Return the place, (2,), of a place along and to the left of the middle."""
        return _bent(np.asarray(along, float), np.asarray(left, float), self.curvature)


def pair(along: np.ndarray) -> list[np.ndarray]:
    """Return the places of the two rails of a straight track."""
    return [np.full_like(along, SPACING_M / 2), np.full_like(along, -SPACING_M / 2)]


def strip(
    length_m: float,
    curvature: float = 0.0,
    rails: Sequence[Lefts] | None = None,
    hidden: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
    paved: Callable[[np.ndarray], np.ndarray] | None = None,
    per_m2: float = 1500.0,
    noise_m: float = 0.002,
    half_width_m: float = 1.5,
) -> Strip:
    """Lay a strip of ballast with rails, a track by default, along an arc that starts at the origin to the east.

    `hidden` says, from places along and the rail's places to the left, which heads are missing; `paved`, from places
    along, where the bed is filled to the tops, with grooves inside.
    """
    rng = np.random.RandomState(7)
    count = int(per_m2 * length_m * 2 * half_width_m)
    along, left = rng.uniform(0, length_m, count), rng.uniform(-half_width_m, half_width_m, count)
    z, on = rng.normal(0, 0.012, count), np.zeros(count, dtype=bool)
    road = np.zeros(count, dtype=bool) if paved is None else paved(along)
    z[road] = TOP_M + rng.normal(0, 0.002, road.sum())
    for places in pair(along) if rails is None else [rail(along) for rail in rails]:
        inward = -np.sign(places) * (left - places)
        z[road & (inward > WIDTH_M / 2) & (inward <= WIDTH_M / 2 + GROOVE_M[0])] = TOP_M - GROOVE_M[1]
        head = np.abs(inward) <= WIDTH_M / 2
        head &= True if hidden is None else ~hidden(along, places)
        z[head] = TOP_M + rng.normal(0, noise_m, head.sum())
        on |= head
    return Strip(np.column_stack([_bent(along, left, curvature), z]), on, curvature)


def _bent(along: np.ndarray, left: np.ndarray, curvature: float) -> np.ndarray:
    """Return the places, (..., 2), of places along and to the left of an arc."""
    if not curvature:
        return np.stack([along, left], axis=-1)
    radius = 1 / curvature - left
    return np.stack([radius * np.sin(along * curvature), 1 / curvature - radius * np.cos(along * curvature)], axis=-1)
