"""The cross-section of the ridge under each piece: how wide it is, and how blunt.

Dense matching of photographs and wide beams blur what they see: a head becomes a round ridge, wider than a head. Its
edges tell the blur, and the blur tells how wide a head may look (docs/classification.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .lines import Lines
from .pieces import lengths
from .tops import MILLIMETRES

REACH_M = 0.30
"""Half the width of a cross-section: a head that is blurred by 8 cm, and the bed beside it."""

SLICE_M = 0.15
"""Distance along the rail within which a point counts to the cross-section of a cell."""

BIN_M = 0.01
"""Width of a bin: a seventh of a head."""

BINS = 2 * round(REACH_M / BIN_M)

BASE_M = 0.20
"""Distance from the axis within which a side is lowest at its base: the shoulder of the ballast may fall further on."""

LEVELS = (0.25, 0.5, 0.75)
"""Parts of the way down from the top to the base at which the width of a side is measured."""

WIDTH_PER_SIGMA, EDGE_PER_SIGMA = 2.355, 0.907
"""Width at half the height of a Gaussian ridge, and distance between its levels of 25 and 75 %, by its standard
deviation."""

BLUR_QUANTILE = 0.25
"""Quantile of the ridges' roundness, by length, that stands for the blur of the square: earth is round in any cloud."""

MAX_WIDTH = 1.1
"""Largest width of a ridge by that of a head with the blur of the square. Measured: rails up to 1.07, mounds of ballast
1.2 and more."""


@dataclass(frozen=True)
class Ridges:
    """The ridges under pieces of line.

    Attributes
    ----------
    width_m : (pieces,) array
        Width at half the height; NaN where a side is not seen as far down as that.
    spread_m : (pieces,) array
        Standard deviation of the Gaussian ridge whose sides are as steep; NaN likewise.
    length_m : (pieces,) array
    """

    width_m: np.ndarray
    spread_m: np.ndarray
    length_m: np.ndarray

    @classmethod
    def measure(cls, xy: np.ndarray, height: np.ndarray, lines: Lines, piece: np.ndarray) -> Ridges:
        """Measure the ridges under pieces.

        Parameters
        ----------
        xy, height : (n, 2) and (n,) arrays
            Of the points; height above the bed.
        lines : Lines
            Lines of the pieces' cells.
        piece : (cells,) int array
            Piece of each cell.
        """
        sections = _sections(xy, height, lines, piece)
        middle = BINS // 2
        sides = sections[:, middle:], sections[:, middle - 1 :: -1]
        with np.errstate(invalid="ignore"):
            top = np.fmax(*(side[:, 0] for side in sides))
            places = np.array([_levels(side, top) for side in sides])
            spread_m = np.mean(places[:, 2] - places[:, 0], axis=0) / EDGE_PER_SIGMA
        return cls(places[:, 1].sum(axis=0), spread_m, lengths(lines.axis, piece))

    @property
    def blur_m(self) -> float:
        """Blur of the square: a standard deviation, metres; 0 where nothing shows it."""
        seen = np.flatnonzero(np.isfinite(self.spread_m))
        if not len(seen):
            return 0.0
        order = seen[np.argsort(self.spread_m[seen])]
        below = np.cumsum(self.length_m[order])
        return float(self.spread_m[order[np.searchsorted(below, BLUR_QUANTILE * below[-1])]])

    def are_blunt(self, head_width_m: float) -> bool:
        """Return whether the blur hides how wide a head is."""
        return self.blur_m > head_width_m / 2

    def may_be_heads(self, head_width_m: float) -> np.ndarray:
        """Return which ridges are not wider than a head with the blur of the square, (pieces,) bool."""
        widest_m = MAX_WIDTH * WIDTH_PER_SIGMA * np.hypot(head_width_m / np.sqrt(12), self.blur_m)
        with np.errstate(invalid="ignore"):
            return self.width_m < widest_m


def _sections(xy: np.ndarray, height: np.ndarray, lines: Lines, piece: np.ndarray) -> np.ndarray:
    """Mean heights of the points beside each piece relative to its line, (pieces, BINS); NaN in bins without points."""
    count = int(piece.max()) + 1
    distance, cell = cKDTree(lines.axis).query(xy, distance_upper_bound=np.hypot(REACH_M, SLICE_M))
    near = np.flatnonzero(np.isfinite(distance))
    cell, step = cell[near], xy[near] - lines.axis[cell[near]]
    bins = np.floor(np.einsum("ij,ij->i", step, lines.across[cell]) / BIN_M).astype(np.int64) + BINS // 2
    inside = np.abs(np.einsum("ij,ij->i", step, lines.along[cell])) < SLICE_M
    inside &= (bins >= 0) & (bins < BINS)
    number = (piece[cell] * BINS + bins)[inside]
    # Whole numbers add up to the same sum in any order of the points.
    rise = np.round((height[near] - lines.height[cell])[inside] * MILLIMETRES)
    points = np.bincount(number, minlength=count * BINS)
    with np.errstate(invalid="ignore"):
        return (np.bincount(number, rise, count * BINS) / points / MILLIMETRES).reshape(count, BINS)


def _levels(side: np.ndarray, top: np.ndarray) -> np.ndarray:
    """Distances from the axis at which one side of each ridge falls below the levels, (levels, pieces) metres.

    Parameters
    ----------
    side : (pieces, bins) array
        Heights outwards from the axis.
    top : (pieces,) array
    """
    base = np.fmin.reduce(side[:, : round(BASE_M / BIN_M)], axis=1)
    unseen = np.isnan(side)
    rows = np.arange(len(side))
    found = []
    for share in LEVELS:
        level = top - share * (top - base)
        below = side < level[:, None]
        after = np.argmax(below, axis=1)
        seen = below.any(axis=1) & (after > 0) & ~_any_before(unseen, after)
        before = np.maximum(after - 1, 0)
        high, low = side[rows, before], side[rows, after]
        place = (before + 0.5 + (high - level) / np.where(seen, high - low, 1.0)) * BIN_M
        found.append(np.where(seen, place, np.nan))
    return np.array(found)


def _any_before(flag: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return in which rows, (k, n) bool, a flag is set before a column, (k,) int."""
    return np.where(flag.any(axis=1), np.argmax(flag, axis=1) < end, False)
