"""How much wider a profile is in curves, by the rules of the German regulations (EBO)."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from .profiles import LIMIT, REFERENCE, SPACE

RULES = NONE, EBO = ("NONE", "EBO")
"""Choices of WIDENING."""

REACH_M = 20.0
"""A vehicle's length: in transitions and beside them, the largest widening within it along the track counts."""

FREE_RADIUS_M = 250.0
"""Radius from which the formula of annex 2, 2.1 applies, and limits and structure gauges are not widened."""

OVERHANG_M2 = 3.75
"""Overhang of the vehicles on which the reference line rests, times the radius (annex 2, 2.1)."""

GAUGES_M = 1.435, 1.445, 1.470
"""Nominal gauge, and the least and largest gauge that the formula takes (annex 2, 2.1)."""

LIMIT_LESS_M = 0.033
"""Part of the widening of the reference line that the limit of the free space already holds (annex 2, 2.1 at 250 m)."""

TIGHT = {
    REFERENCE: (
        (100, 120, 150, 170, 180, 190, 200, 225, 250),
        (560, 365, 165, 130, 110, 95, 85, 55, 20),
        (600, 395, 195, 145, 130, 110, 95, 60, 33),
    ),
    SPACE: (
        (100, 120, 150, 180, 190, 200, 225, 250),
        (530, 335, 135, 80, 65, 50, 25, 0),
        (570, 365, 170, 100, 80, 65, 30, 0),
    ),
}
"""Radius in metres, and widening on the inside and on the outside in millimetres, of tight curves (annex 2, 2.1, and
annex 1 table 2). Between columns linearly."""


def widening(curvature: np.ndarray, gauge_m: float | np.ndarray, rule: str, step_m: float) -> np.ndarray:
    """Return the widening on the left and on the right at stations of equal distance, (n, 2) metres.

    `curvature`, (n,), is positive in left-hand curves; the rule is that of the profile, see `profiles.REFERENCE`.
    """
    radius_m = 1.0 / np.maximum(np.abs(curvature), 1e-9)
    at, *sides = TIGHT[SPACE if rule == SPACE else REFERENCE]
    tight = np.array([np.interp(radius_m, at, values) for values in sides]) / 1000
    if rule == LIMIT:
        tight = np.maximum(tight - LIMIT_LESS_M, 0.0)
    nominal, least, most = GAUGES_M
    loose = (np.clip(np.nan_to_num(gauge_m, nan=least), least, most) - nominal) / 2
    wide = OVERHANG_M2 / radius_m + loose if rule == REFERENCE else 0.0
    inside, outside = np.where(radius_m >= FREE_RADIUS_M, wide, tight)
    is_left = curvature > 0
    both = np.column_stack([np.where(is_left, inside, outside), np.where(is_left, outside, inside)])
    return maximum_filter1d(both, 2 * int(round(REACH_M / step_m)) + 1, axis=0, mode="nearest")
