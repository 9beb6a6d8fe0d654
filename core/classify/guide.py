"""Lines that show where rails are to be searched: those of a map, or drawn along the tracks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import Polyline, runs
from .lines import Lines
from .partner import MAJORITY, MIN_STATIONS, SPACING_M, partners
from .pieces import pieces_of

STEP_M = 0.25
"""Distance between the places of a guide: distances of 4 m from it are 2 mm too long at most."""

CONTEXT_M = 3.0
"""Points this far beyond the distance are searched as well: the other rail of a track, and what is beside it."""

MIDDLE_M = 0.5
"""Distance from the middle of a track within which a guide runs along this track."""

ACROSS_RAD = 0.5
"""Angle to the guide from which a rail runs across it: more than that of any turnout."""


@dataclass(frozen=True)
class Guide:
    """Places along the guide, `xy` (n, 2) metres, and unit vectors along it there.

    Tracks whose middle, and single rails that, are further away than `distance_m` are left out; with `only`, only the
    tracks along whose middle the guide runs are kept.
    """

    xy: np.ndarray
    along: np.ndarray
    distance_m: float
    only: bool = False

    @classmethod
    def through(
        cls, lines: Sequence[np.ndarray], distance_m: float, only: bool, box: tuple[float, float, float, float]
    ) -> Guide:
        """Place a guide along lines, (k, 2) metres each, in and around a box: west, south, east and north limits."""
        near_m = distance_m + CONTEXT_M
        low, high = np.array(box[:2]) - near_m, np.array(box[2:]) + near_m
        parts = [np.empty((0, 4))]
        for line in lines:
            ends = np.stack([line[:-1], line[1:]])
            near = ((ends.max(axis=0) >= low) & (ends.min(axis=0) <= high)).all(axis=1)
            for first, last in runs(near):
                stations = Polyline(line[first : last + 2]).resampled(STEP_M)
                parts.append(np.column_stack([stations.xyz, stations.tangents]))
        found = np.concatenate(parts)
        found = found[((found[:, :2] >= low) & (found[:, :2] <= high)).all(axis=1)]
        return cls(found[:, :2], found[:, 2:], distance_m, only)

    def around(self, corner: np.ndarray, side_m: float) -> Guide:
        """Return the part around a square, with the square's corner, (2,) metres, as its origin."""
        xy = self.xy - corner
        margin_m = self.distance_m + 2 * CONTEXT_M
        near = ((xy > -margin_m) & (xy < side_m + margin_m)).all(axis=1)
        return replace(self, xy=xy[near], along=self.along[near])

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.xy)

    def holds(self, xy: np.ndarray) -> np.ndarray:
        """Return which places, (n, 2), are to be searched, (n,) bool."""
        reach_m = self.distance_m + CONTEXT_M
        return np.isfinite(self._tree.query(xy, distance_upper_bound=reach_m)[0])

    def reaches(self, low: np.ndarray, high: np.ndarray) -> bool:
        """Return whether places in a box, (2,) metres each, may have to be searched."""
        reach_m = self.distance_m + CONTEXT_M
        return bool(((self.xy >= low - reach_m) & (self.xy <= high + reach_m)).all(axis=1).any())

    def crosses(self, lines: Lines) -> tuple[np.ndarray, np.ndarray]:
        """Return which cells of rails run along the guide, and which run across it, (n,) bool each."""
        distance, place = self._tree.query(lines.axis, distance_upper_bound=self.distance_m)
        near = np.isfinite(distance)
        cosine = np.zeros(len(near))
        cosine[near] = np.abs(np.einsum("ij,ij->i", self.along[place[near]], lines.along[near]))
        along = cosine > np.cos(ACROSS_RAD)
        return near & along, near & ~along

    def keeps(self, lines: Lines, pairs: np.ndarray, spacings_m: Sequence[float], height_m: float) -> np.ndarray:
        """Return which cells belong to pieces of rail that are kept, (n,) bool.

        `pairs`, (m, 2), are cells that continue each other, `spacings_m` the distances of the two heads of a track, and
        `height_m` is the largest difference in height above the bed between its rails.
        """
        if not len(lines.axis):
            return np.zeros(0, dtype=bool)
        fits = np.zeros(len(lines.axis), dtype=bool)
        single = np.ones(len(fits), dtype=bool)
        for spacing_m in spacings_m:
            stations, side, apart_m = partners(lines, spacing_m, SPACING_M, height_m)
            paired = stations >= MIN_STATIONS
            middle = lines.axis[paired] + (side * apart_m / 2)[paired, None] * lines.across[paired]
            fits[paired] |= self._distance(middle) <= (MIDDLE_M if self.only else self.distance_m)
            single &= ~paired
        if not self.only:
            fits[single] = self._distance(lines.axis[single]) <= self.distance_m
        piece = pieces_of(len(fits), pairs)
        return (np.bincount(piece, fits) > MAJORITY * np.bincount(piece))[piece]

    def _distance(self, xy: np.ndarray) -> np.ndarray:
        return self._tree.query(xy)[0] if len(self.xy) else np.full(len(xy), np.inf)
