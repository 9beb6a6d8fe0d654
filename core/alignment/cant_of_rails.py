"""Cant along a centerline from the two rails beside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..polyline import Polyline, distance_to

STEP_M = 1.0
"""Distance between the places at which the cant is taken, metres."""

NEAREST_M, FARTHEST_M = 0.25, 1.0
"""Distances of a rail from the middle of its track, metres: half of all gauges in use, with canted and wide track."""

LONGEST_GAP_M = 2.0
"""Distance from a station of a rail beyond which its height is unknown, metres."""


def cant_of_rails(line: np.ndarray, rails: Sequence[np.ndarray]) -> np.ndarray:
    """Return the cant along a line: height of the rail on its left minus that of the rail on its right.

    Parameters
    ----------
    line : (n, 3) array
        Centerline, metres.
    rails : sequence of (k, 3) arrays
        Rails of this track and of others.

    Returns
    -------
    (m, 2) array
        Plan distance from the first vertex, and cant, metres.
    """
    places = np.concatenate([Polyline(rail).resampled(STEP_M).xyz for rail in rails]) if rails else np.zeros((0, 3))
    places = places[np.isfinite(places[:, 2])]
    if not len(places):
        return np.zeros((0, 2))
    own = Polyline(line)
    feet = own.feet(places[:, :2], FARTHEST_M)
    t = np.arange(0.0, own.length_m, STEP_M)
    sides = []
    for side in (1.0, -1.0):
        across = side * feet.across
        mine = (across > NEAREST_M) & (across < FARTHEST_M)
        order = np.argsort(feet.t[mine], kind="stable")
        along, z = feet.t[mine][order], places[feet.point[mine][order], 2]
        if not len(along):
            return np.zeros((0, 2))
        sides.append(np.where(distance_to(along, t) < LONGEST_GAP_M, np.interp(t, along, z), np.nan))
    cant = sides[0] - sides[1]
    known = np.isfinite(cant)
    return np.column_stack([t[known], cant[known]])
