"""Passes of the scanner, moved onto one level: their heights differ by up to some centimetres.

A pavement is level to millimetres: two passes of it together are rough, and hide the grooves in it. They differ as the
pavement does that both show. On ballast they are left as they are: of its stones, a scanner that is further away shows
the tops, which are up to a centimetre higher. Places across stay as well.
"""

from __future__ import annotations

import numpy as np

from .bed import Coarse
from .tops import TENTHS_OF_MM

MIN_POINTS = 5
"""Points of a pass in a coarse cell that show its height there."""

SMOOTH_M = 0.010
"""Largest standard deviation of their heights: noise of a good scanner, and a slope of 1:25 over a coarse cell. Ballast
scatters by 12 mm and more."""

APART_M = 0.10
"""Largest difference in height of two passes: what is further apart is not the same surface."""

MIN_CELLS = 40
"""Coarse cells, of 10 m², that several passes have to show: few may hold walls and vehicles only."""

ROUNDS = 3
"""Rounds of comparing each pass with the mean of those that show the same cell: passes need not show the same ones."""


def on_one_level(xyz: np.ndarray, passes: np.ndarray) -> np.ndarray:
    """Move the points of a square, (n, 3) metres, onto the mean height of its passes, (n,) numbers."""
    kinds, own = np.unique(passes, return_inverse=True)
    if len(kinds) < 2:
        return xyz
    up_m = _apart(_heights(xyz, own.ravel(), len(kinds)))
    return xyz - up_m[own.ravel(), None] * [0.0, 0.0, 1.0]


def _heights(xyz: np.ndarray, own: np.ndarray, count: int) -> np.ndarray:
    """Mean heights of a `count` of passes in the coarse cells, (count, cells) metres.

    NaN where a pass shows too little, or what is not smooth.
    """
    coarse = Coarse.around(xyz[:, 0], xyz[:, 1])
    number, shape = own * len(coarse.count) + coarse.cell, (count, len(coarse.count))
    # Whole numbers add up to the same sum in any order of the points.
    tenths = np.round(xyz[:, 2] * TENTHS_OF_MM)
    points = np.maximum(np.bincount(number, minlength=np.prod(shape)), 1)
    mean = np.bincount(number, tenths, len(points)) / points
    variance = np.bincount(number, (tenths - mean[number]) ** 2, len(points)) / points
    smooth = (points >= MIN_POINTS) & (variance < (SMOOTH_M * TENTHS_OF_MM) ** 2)
    return (np.where(smooth, mean, np.nan) / TENTHS_OF_MM).reshape(shape)


def _apart(z: np.ndarray) -> np.ndarray:
    """Return how far passes are above their mean, (passes,) metres, by their heights in cells, (passes, cells)."""
    up_m, z = np.zeros(len(z)), _compared(z)
    shown = np.isfinite(z).sum(axis=1) >= MIN_CELLS
    z = _compared(z[shown])
    for _ in range(ROUNDS if z.size else 0):
        level_m = z - up_m[shown, None]
        up_m[shown] += np.nanmedian(level_m - np.nanmean(level_m, axis=0), axis=1)
    return up_m


def _compared(z: np.ndarray) -> np.ndarray:
    """Choose the cells in which several passes show the same surface, (passes, cells) metres."""
    z = z[:, np.isfinite(z).sum(axis=0) >= 2]
    return z[:, np.nanmax(z, axis=0) - np.nanmin(z, axis=0) < APART_M] if z.size else z
