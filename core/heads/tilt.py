"""The slope across of the track on which a line lies, from the heights of the rails beside it.

A blurred head has no top whose slope could be seen, but its crest moves to the higher side of a track with cant. See
docs/method.md section 6.10.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.spatial import cKDTree

PARTNER_M = (0.6, 1.8)
"""Distance of the other rail of a track: narrower and wider gauges are not in the standards."""

MAX_TILT = 0.2
"""Largest slope across of a track: cant of 300 mm on standard gauge."""

WINDOW = 121
"""Stations over which the slope is averaged, 30 m: errors of dense matching are alike over 1 to 10 m, and turn a track
by 0.02. Where a ramp of cant of 1 in 400 begins, the mean is off by 0.006."""


def tilts(line: np.ndarray, places: np.ndarray, normals: np.ndarray, level: np.ndarray, step_m: float) -> np.ndarray:
    """Return the rise per metre to the left at stations on lines, (s,); NaN where no other rail is beside it.

    Where rails are on both sides, as between two tracks, the mean counts.

    Parameters
    ----------
    line : (s,) int array
        Line of each station, ascending.
    places, normals : (s, 2) arrays
        Stations in plan, and unit vectors to the left.
    level : (s,) array
        Height of the rail, NaN where it is not known.
    step_m : float
        Distance of the stations.
    """
    pairs = cKDTree(places).query_pairs(PARTNER_M[1], output_type="ndarray")
    pairs = pairs[line[pairs[:, 0]] != line[pairs[:, 1]]]
    own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    step = places[other] - places[own]
    across_m = np.einsum("ij,ij->i", step, normals[own])
    ahead_m = step[:, 0] * normals[own, 1] - step[:, 1] * normals[own, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (level[other] - level[own]) / across_m
        used = np.abs(slope) <= MAX_TILT
    used &= (np.abs(ahead_m) <= 0.5 * step_m) & (np.abs(across_m) >= PARTNER_M[0])
    count, total = (np.bincount(own[used], one, len(line)).astype(float) for one in (None, slope[used]))
    averaged = np.full(len(line), np.nan)
    for mine in np.split(np.arange(len(line)), np.flatnonzero(np.diff(line)) + 1):
        here, all_m = (uniform_filter1d(one[mine], WINDOW, mode="constant") for one in (count, total))
        known = here > 0.5 / WINDOW
        averaged[mine[known]] = all_m[known] / here[known]
    return averaged
