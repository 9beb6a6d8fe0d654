"""The cross-section of a window: where in it a railhead may be.

A head is a band of its own width at one height with nothing as high right beside it: on both sides, or, where two
heads touch in a switch and where a pavement reaches the head, on one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..classify.bed import QUANTILE
from ..polyline import runs
from .settings import Beam, GrowSettings

STEP_M = 0.003
"""Distance between the places that are tried across: a third of the accuracy of a window."""

MIN_POINTS = 3
"""Fewest points of a head."""

MIN_CONTRAST = 0.5
"""Least share of a head's points that remains after those of an equal band beside it are subtracted."""

CROWN_SHARE = 0.7
"""Middle part of the head whose points give the height: its edges are rounded."""

BED_M = 0.30
"""Width beside a head in which the bed is looked for: a sleeper's bay, short of the next rail."""

BED_DEPTH_M = 1.0
"""Points further below the top are not of the bed: what is under a bridge."""

GROOVE_M = 0.16
"""A groove ends within this distance of the head's side."""

PLATEAU = 0.9
"""Places with this share of the best contrast count: all of them hold the head."""

LEVEL_M, LEVEL_SHARE, NEAR_TOP_M = 0.008, 0.55, 0.02
"""Beside a head is a pavement if this share of the points there is this close to their median height, and the median
this close to the top; see `classify.flush`. Ballast scatters by 12 mm and more."""

MIN_PAVEMENT_POINTS = 20
"""Fewest points by which a pavement is known."""

CAVITY_M, CAVITY_SHARE = 0.012, 0.05
"""Depth of the points in a groove, three times a good scanner's noise, and their least number as a share of those on
the head. Between the profiles of a scanner a pavement shows gaps, but nothing in them."""

HIGH_M, HIGH_SHARE = (0.06, 0.6), 1.0
"""Heights above the top in which a wall, a fence or a wheel has points, and how many of them hide a head, as a share of
those on the head."""


@dataclass(frozen=True)
class Head:
    """A place where a head may be.

    Attributes
    ----------
    across_m : float
        Place of its axis, to the left.
    top_m : float
        Height of its top.
    clear : tuple of bool
        Whether its right and its left side are free.
    count : int
        Points on it.
    flush : bool
        Whether a pavement beside it is as high.
    bed_m : float
        Height of the bed relative to the top, the lower one of the free sides; infinite where it is not seen.
    """

    across_m: float
    top_m: float
    clear: tuple[bool, bool]
    count: int
    flush: bool
    bed_m: float

    @property
    def is_free(self) -> bool:
        """Whether both sides are free."""
        return all(self.clear)


class Section:
    """Points of a window, by their places across and heights.

    Parameters
    ----------
    across_m, height_m : (n,) arrays
        Height relative to the expected top.
    settings : GrowSettings
    beam : Beam
    """

    def __init__(self, across_m: np.ndarray, height_m: np.ndarray, settings: GrowSettings, beam: Beam) -> None:
        order = np.argsort(across_m, kind="stable")
        self.across_m, self.height_m = across_m[order], height_m[order]
        self._settings, self._beam = settings, beam

    def heads(
        self, reach_m: float, top_m: float = 0.0, min_points: float = MIN_POINTS, around_m: float = 0.0
    ) -> list[Head]:
        """List the places within `reach_m` of one across where a head with this top may be."""
        band_m = self._settings.parameters.tolerance_z_m + self._beam.level_m
        level = self.across_m[np.abs(self.height_m - top_m) <= band_m]
        if len(level) < min_points:
            return []
        u = around_m + np.arange(-reach_m, reach_m + STEP_M, STEP_M)
        inside, beside = self._counts(level, u)
        scale = self._settings.head_width_m / self._beam.fringe_m
        clear = scale * beside <= self._beam.clear * inside
        enough = inside >= max(min_points, MIN_POINTS)
        free = enough & clear.all(axis=0)
        contrast = inside - scale * beside.mean(axis=0)
        found = [self._head(level, _centre(u, contrast, *run), (True, True), top_m) for run in runs(free)]
        for side in (0, 1):
            contrast = inside - scale * beside[side]
            alone = enough & clear[side] & ~clear[1 - side] & (contrast >= MIN_CONTRAST * inside)
            for run in runs(alone):
                place_m = _centre(u, contrast, *run)
                if all(abs(place_m - one.across_m) > self._settings.head_width_m / 2 for one in found if one.is_free):
                    found.append(self._head(level, place_m, (side == 0, side == 1), top_m))
        return [one for one in found if self._stands(one)]

    def is_empty(self) -> bool:
        """Return whether there are no points at all."""
        return not len(self.across_m)

    def _counts(self, level: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Count level points on heads with axes at `u`, (k,), and in the fringes to their right and left, (2, k)."""
        half_m, blur_m, fringe_m = self._settings.head_width_m / 2, self._beam.blur_m, self._beam.fringe_m

        def between(low: np.ndarray, high: np.ndarray) -> np.ndarray:
            return np.searchsorted(level, high) - np.searchsorted(level, low)

        right, left = u - half_m - blur_m, u + half_m + blur_m
        beside = np.stack([between(right - fringe_m, right), between(left, left + fringe_m)])
        return between(u - half_m, u + half_m), beside

    def _head(self, level: np.ndarray, place_m: float, clear: tuple[bool, bool], top_m: float) -> Head:
        """Measure the head with its axis at a place."""
        half_m, band_m = self._settings.head_width_m / 2, self._settings.parameters.tolerance_z_m + self._beam.level_m
        across = np.abs(self.across_m - place_m)
        crown = self.height_m[(across <= CROWN_SHARE * half_m) & (np.abs(self.height_m - top_m) <= band_m)]
        if len(crown):
            top_m = float(np.median(crown))
        count = int(np.count_nonzero(np.abs(level - place_m) <= half_m))
        flush = any(self._is_paved(side * (self.across_m - place_m), top_m) for side in (-1, 1))
        beds = [self._bed(side * (self.across_m - place_m), top_m) for side, free in zip((-1, 1), clear) if free]
        return Head(place_m, top_m, clear, count, flush, min(beds))

    def _is_paved(self, off: np.ndarray, top_m: float) -> bool:
        """Return whether there is a pavement as high as the head on one side."""
        beside = (off > self._settings.head_width_m / 2) & (off <= self._settings.head_width_m / 2 + BED_M)
        above = self.height_m[beside] - top_m
        above = above[np.abs(above) < 5 * NEAR_TOP_M]
        if len(above) < MIN_PAVEMENT_POINTS:
            return False
        middle = np.median(above)
        level = np.mean(np.abs(above - middle) <= LEVEL_M)
        return bool(abs(middle) <= NEAR_TOP_M and level >= LEVEL_SHARE)

    def _stands(self, head: Head) -> bool:
        """Return whether a head is not hidden, and stands above its bed or beside a groove."""
        half_m = self._settings.head_width_m / 2
        off, above = self.across_m - head.across_m, self.height_m - head.top_m
        high = np.count_nonzero((np.abs(off) <= half_m) & (above > HIGH_M[0]) & (above < HIGH_M[1]))
        if high > HIGH_SHARE * head.count:
            return False
        if np.isinf(head.bed_m):
            return head.is_free
        if head.bed_m <= -self._settings.parameters.min_height_m:
            return True
        return head.flush and any(
            np.count_nonzero((side * off > half_m) & (side * off <= half_m + GROOVE_M) & (above < -CAVITY_M))
            >= max(CAVITY_SHARE * head.count, 2)
            for side, clear in zip((-1, 1), head.clear)
            if clear
        )

    def _bed(self, off: np.ndarray, top_m: float) -> float:
        """Height of the bed on one side relative to the top, metres; infinite where nothing is seen."""
        half_m = self._settings.head_width_m / 2 + self._beam.blur_m
        above = self.height_m - top_m
        beside = (off > half_m) & (off <= half_m + BED_M) & (np.abs(above) < BED_DEPTH_M)
        return float(np.quantile(above[beside], QUANTILE)) if beside.any() else np.inf


def _centre(u: np.ndarray, contrast: np.ndarray, first: int, last: int) -> float:
    """Return the middle of the places of a run whose contrast is near the best."""
    own = contrast[first : last + 1]
    weight = np.maximum(own - PLATEAU * own.max(), 0) + 1e-9
    return float(np.average(u[first : last + 1], weights=weight))
