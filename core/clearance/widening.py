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
    REFERENCE: np.array(
        [
            [250, 0.020, 0.033],
            [225, 0.055, 0.060],
            [200, 0.085, 0.095],
            [190, 0.095, 0.110],
            [180, 0.110, 0.130],
            [170, 0.130, 0.145],
            [150, 0.165, 0.195],
            [120, 0.365, 0.395],
            [100, 0.560, 0.600],
        ]
    ),
    SPACE: np.array(
        [
            [250, 0.000, 0.000],
            [225, 0.025, 0.030],
            [200, 0.050, 0.065],
            [190, 0.065, 0.080],
            [180, 0.080, 0.100],
            [150, 0.135, 0.170],
            [120, 0.335, 0.365],
            [100, 0.530, 0.570],
        ]
    ),
}
"""Radius, and widening on the inside and the outside, metres, of tight curves (annex 2, 2.1, and annex 1 table 2).
Between rows linearly."""


def widening(curvature: np.ndarray, gauge_m: float | np.ndarray, rule: str, step_m: float) -> np.ndarray:
    """Return the widening on the left and on the right at stations, (n, 2) metres.

    Parameters
    ----------
    curvature : (n,) array
        1/m, positive in left-hand curves.
    gauge_m : float or (n,) array
        Measured gauge.
    rule : str
        Of the profile, see `profiles.REFERENCE`.
    step_m : float
        Distance of the stations.
    """
    radius_m = 1.0 / np.maximum(np.abs(curvature), 1e-9)
    inside, outside = _of_radius(radius_m, np.broadcast_to(gauge_m, radius_m.shape), rule)
    is_left = curvature > 0
    sides = np.column_stack([np.where(is_left, inside, outside), np.where(is_left, outside, inside)])
    return maximum_filter1d(sides, 2 * int(round(REACH_M / step_m)) + 1, axis=0, mode="nearest")


def _of_radius(radius_m: np.ndarray, gauge_m: np.ndarray, rule: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the widening on the inside and on the outside of curves, (n,) each, metres."""
    table = TIGHT[SPACE if rule == SPACE else REFERENCE]
    inside, outside = (np.interp(radius_m, table[::-1, 0], table[::-1, column]) for column in (1, 2))
    is_wide = radius_m >= FREE_RADIUS_M
    if rule == REFERENCE:
        nominal, least, most = GAUGES_M
        known = np.where(np.isfinite(gauge_m), gauge_m, least)
        loose = (np.clip(known, least, most) - nominal) / 2
        law = OVERHANG_M2 / radius_m + loose
        return np.where(is_wide, law, inside), np.where(is_wide, law, outside)
    less = LIMIT_LESS_M if rule == LIMIT else 0.0
    return tuple(np.where(is_wide, 0.0, np.maximum(one - less, 0.0)) for one in (inside, outside))  # type: ignore[return-value]
