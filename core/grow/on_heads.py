"""Rails followed on what the classification finds, where windows alone show too little.

A window of a thin cloud holds a dozen points of a head, and one of a cloud that blurs heads to round ridges shows no
edges. There the classification, which looks at tens of metres, takes the place of the windows' own judgement: a head is
where it has found one, and the one of the seed is followed.
"""

from __future__ import annotations

import numpy as np

from ..classify.settings import BLUNT as BLUNT_TOLERANCES
from ..classify.settings import MARGIN_M, Settings
from ..classify.square import classify_square
from .points import Buckets, Points
from .profile import CROWN_SHARE, MIN_POINTS, Head, Section
from .settings import Beam, GrowSettings

GAP_M = 0.10
"""Distance across between points of two heads; those of one are closer."""

TOUCHING = 1.7
"""Half the width of a group of points, in those of the band that the classification labels, up to which it is on one
head: the sides of the band follow cells. Two heads that touch are wider."""


class OnHeads:
    """The points on heads by the classification, a `Points`; squares are classified when they are reached.

    Parameters
    ----------
    points : Points
    settings : GrowSettings
    """

    def __init__(self, points: Points, settings: GrowSettings) -> None:
        self._points = points
        self._settings = Settings((settings.gauge_m,), settings.head_width_m)
        self._squares: dict[tuple[int, int], tuple[Buckets, bool]] = {}

    def around(self, xy: np.ndarray, reach_m: float) -> np.ndarray:
        """See `Points`."""
        return np.concatenate([found.around(xy, reach_m) for found, _ in self._near(xy, reach_m)])

    def are_blunt(self, xy: np.ndarray, reach_m: float) -> bool:
        """Return whether heads are blunt in a square within `reach_m` of a place, (2,)."""
        return any(blunt for _, blunt in self._near(xy, reach_m))

    def _near(self, xy: np.ndarray, reach_m: float) -> list[tuple[Buckets, bool]]:
        """Return the squares within `reach_m` of a place, (2,)."""
        low, high = (np.floor((xy + step) / self._settings.side_m).astype(int).tolist() for step in (-reach_m, reach_m))
        return [self._square((c, r)) for c in range(low[0], high[0] + 1) for r in range(low[1], high[1] + 1)]

    def _square(self, key: tuple[int, int]) -> tuple[Buckets, bool]:
        """Return the points on heads of the square in this column and row, and whether the heads are blunt."""
        if key not in self._squares:
            side_m = self._settings.side_m
            corner = np.append(np.multiply(key, side_m), 0.0)
            points = self._points.around(corner[:2] + side_m / 2, side_m / 2 + MARGIN_M) - corner
            points = points[((points[:, :2] >= -MARGIN_M) & (points[:, :2] < side_m + MARGIN_M)).all(axis=1)]
            found = classify_square(points, self._settings)
            self._squares[key] = Buckets(points[found.rail] + corner), found.figures.blunt_m > 0
        return self._squares[key]


class OfHeads(Section):
    """A window of points on heads, by their places across and heights."""

    def heads(
        self, reach_m: float, top_m: float = 0.0, min_points: float = MIN_POINTS, around_m: float = 0.0
    ) -> list[Head]:
        """List the heads within `reach_m` of a place across, whatever their height; see `Section`."""
        groups = np.split(np.arange(len(self.across_m)), np.flatnonzero(np.diff(self.across_m) > GAP_M) + 1)
        found = [self._head_of(group, around_m) for group in groups if len(group) >= min_points]
        return [one for one in found if abs(one.across_m - around_m) <= reach_m and one.count >= min_points]

    def _head_of(self, group: np.ndarray, around_m: float) -> Head:
        """Measure the head that a group of points is on; of two that touch, the one nearer to a place."""
        half_m = self._settings.head_width_m / 2 + BLUNT_TOLERANCES.beside_m
        across = self.across_m[group]
        middle = float(across.mean())
        spare_m = max((across[-1] - across[0]) / 2 - TOUCHING * half_m, 0.0)
        place_m = float(np.clip(around_m, middle - spare_m, middle + spare_m))
        off_m = np.abs(across - place_m)
        on = off_m <= self._settings.head_width_m / 2
        crown = self.height_m[group][off_m <= CROWN_SHARE * self._settings.head_width_m / 2]
        top_m = float(np.median(crown)) if len(crown) else 0.0
        return Head(place_m, top_m, (True, True), int(on.sum()), False, -self._settings.parameters.min_height_m)


def cut(across_m: np.ndarray, height_m: np.ndarray, settings: GrowSettings, beam: Beam) -> Section:
    """Make the cross-section of a window, (n,) places across and heights, that suits a beam."""
    return (OfHeads if beam.classified else Section)(across_m, height_m, settings, beam)
