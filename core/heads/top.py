"""The top of one railhead: the points that a disc rolling along it meets, and their smoothed height on the axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lines.smoothing import smooth_profile
from .envelope import extremal_boundary
from .level import cross_slope, rough_level, spread

LEAST_POINTS = 10
"""A line that fewer points support is none of a rail: 1 m of the sparsest rail has more."""

OUTLIER_M = 0.03
"""Points this far above the level of most, such as weeds, would lift the disc; a head's slope makes 5 mm at most."""

LEAST_DEPTH_M = 0.01
"""Depth below the disc that is searched even in the cleanest cloud: the disc sags 6 mm into a gap of 1 m."""

DEPTH_SIGMAS = 6.0
"""Depth in standard deviations of the noise: the disc lies about three above the top, the points reach as far below."""

DISC_BIN_M = 0.02
"""Of points this close together only the highest meets the disc, which on a slope of 5 % lies 1 mm too low then."""

TOP_SIGMAS = 3.0
"""Half height of the band around the top, in standard deviations of the noise."""

TOP_ROUNDS = 3
"""Rounds of smoothing and choosing anew; the fourth moves the top by less than 0.1 mm."""

AXIS_SHARE = 0.25
"""Part of the head width, to either side of the axis, that gives the height: its crown is 0.5 mm lower at most."""

BIN_M = 0.25
"""Points this close together along the line count as one of mean height: a twelfth of the smoothing's length."""

END_M = 1.0
"""A profile goes on as it slopes at its end for this length, and level from there."""


@dataclass(frozen=True)
class Profile:
    """A smoothed height profile: heights `z` at chainages `t`, (n,) each."""

    t: np.ndarray
    z: np.ndarray

    @classmethod
    def through(cls, t: np.ndarray, z: np.ndarray, sigma_m: float) -> Profile:
        """Smooth the heights of points; those of one bin count as one, so that none alone marks the edge of a gap."""
        _, number, count = np.unique(np.floor(t / BIN_M), return_inverse=True, return_counts=True)
        t, z = np.bincount(number, t) / count, np.bincount(number, z) / count
        return cls(t, smooth_profile(t, z, sigma_m, t))

    def at(self, stations: np.ndarray) -> np.ndarray:
        """Height at any chainage, (m,)."""
        height = np.interp(stations, self.t, self.z)
        if self.t[-1] - self.t[0] < END_M:
            return height
        before = np.clip(self.t[0] - stations, 0.0, END_M)
        after = np.clip(stations - self.t[-1], 0.0, END_M)
        inner_start, inner_end = np.interp([self.t[0] + END_M, self.t[-1] - END_M], self.t, self.z)
        return height + (self.z[0] - inner_start) / END_M * before + (self.z[-1] - inner_end) / END_M * after


def find_top(
    t: np.ndarray,
    across: np.ndarray,
    z: np.ndarray,
    head_width_m: float,
    crown_radius_m: float,
    tolerance_m: float,
    smoothing_m: float,
) -> tuple[Profile, np.ndarray] | None:
    """Find the height of a head's top on its axis, and the points on top; None where too few agree on one.

    The points are laid flat first, as if the head stood upright. The disc then tells the top from the faces, but it
    rests on the highest points, three standard deviations above it; a band around their own smoothed height,
    chosen anew a few times, takes that lift away.

    Parameters
    ----------
    t, across, z : (n,) arrays
        Points on the head: chainage, increasing, offset to the left of the axis, and height; metres.
    head_width_m : float
    crown_radius_m : float
        Radius of the disc.
    tolerance_m : float
        Greatest depth of a point below the top.
    smoothing_m : float
        Sigma of PAEK along the line.

    Returns
    -------
    profile : Profile
    top : (n,) bool array
        Points that lie on the top.
    """
    flat = z - cross_slope(t, across, z - rough_level(t, z), head_width_m) * across
    top, noise = _under_disc(t, flat, crown_radius_m, tolerance_m)
    central = np.abs(across) <= AXIS_SHARE * head_width_m
    band = min(tolerance_m, max(LEAST_DEPTH_M, TOP_SIGMAS * noise))
    for _ in range(TOP_ROUNDS):
        chosen = top & central if (top & central).sum() >= LEAST_POINTS else top
        profile = Profile.through(t[chosen], flat[chosen], smoothing_m)
        top = np.abs(flat - profile.at(t)) <= band
        if top.sum() < LEAST_POINTS:
            return None
    return profile, top


def _under_disc(t: np.ndarray, z: np.ndarray, crown_radius_m: float, tolerance_m: float) -> tuple[np.ndarray, float]:
    """Tell which points lie just under the disc that rolls along the top, (n,) bool, and how noisy these are."""
    above = z - rough_level(t, z)
    ordinary = above <= OUTLIER_M
    highest = _highest(t[ordinary], z[ordinary])
    surface = extremal_boundary(t[ordinary][highest], z[ordinary][highest], crown_radius_m)
    depth = np.where(ordinary, surface.closing(np.clip(t, surface.x[0], surface.x[-1])) - z, np.inf)
    noise = spread(above[depth <= tolerance_m])
    return depth <= min(tolerance_m, max(LEAST_DEPTH_M, DEPTH_SIGMAS * noise)), noise


def _highest(t: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Pick the highest point of each short bin, (k,) numbers, for the disc to roll on; t is increasing."""
    number = np.floor(t / DISC_BIN_M).astype(int)
    order = np.lexsort((z, number))
    return order[np.flatnonzero(np.diff(number[order], append=number[-1] + 1))]
