"""The top of one railhead: points found by a rolling disc, and their smoothed height on the axis.

See docs/method.md section 6.4.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Union

import numpy as np

from ..lines.paek import VARIANCE_FACTOR
from ..lines.smoothing import smooth_profile
from ..rails import Support
from .edges import STATION_STEP_M, stations_along
from .envelope import extremal_boundary
from .level import AXIS_SHARE, cross_slope, robust_sigma, rough_level
from .sections import Middles
from .smoother import Spline, bridge_error, smooth

MIN_POINTS = 10
"""A line with fewer points is not a rail: 1 m of the sparsest rail has more."""

MAX_ABOVE_M = 0.03
"""Height above the rough level beyond which points, such as weeds, are kept from lifting the disc; the slope of a head
accounts for at most 5 mm."""

MIN_BAND_M = 0.01
"""Minimum of the depth below the disc and of the half height of the band: the disc sags 6 mm into a gap of 1 m."""

DISC_DEPTH_SIGMAS = 6.0
"""Depth below the disc in standard deviations of the noise: the disc is about three above the top, and points scatter
as far below it."""

DISC_BIN_M = 0.02
"""Of points this close together only the highest is given to the disc, which is 1 mm too low then on a slope of 5 %."""

BAND_SIGMAS = 3.0
"""Half height of the band around the top, in standard deviations of the noise."""

BAND_ROUNDS = 3
"""Rounds of smoothing and selection; a fourth moves the top by less than 0.1 mm."""

UNSEEN_TURN = 1e-5
"""Change of the vertical curvature per metre that a rail may have where no point shows it, 1/m²: settled track has
waves of 10 mm that are 60 m long."""

PROFILE_BIN_M = 0.25
"""Bins along the line in which points are averaged: half the distance between the knots of the spline."""

TAIL_M = 1.0
"""Length over which a profile is extrapolated with the slope at its end; beyond it is level."""


@dataclass(frozen=True)
class Profile:
    """A height profile smoothed by PAEK: heights `z` and standard errors at chainages `t`, (n,) each, metres."""

    t: np.ndarray
    z: np.ndarray
    error_m: np.ndarray

    def at(self, stations: np.ndarray) -> np.ndarray:
        """Return the heights at chainages, (m,), which may be beyond the ends."""
        height = np.interp(stations, self.t, self.z)
        if self.t[-1] - self.t[0] < TAIL_M:
            return height
        before = np.clip(self.t[0] - stations, 0.0, TAIL_M)
        after = np.clip(stations - self.t[-1], 0.0, TAIL_M)
        inner_start, inner_end = np.interp([self.t[0] + TAIL_M, self.t[-1] - TAIL_M], self.t, self.z)
        return height + (self.z[0] - inner_start) / TAIL_M * before + (self.z[-1] - inner_end) / TAIL_M * after

    def sigma(self, stations: np.ndarray) -> np.ndarray:
        """Return the standard errors at chainages, (m,)."""
        return np.interp(stations, self.t, self.error_m)


Course = Union[Profile, Spline]
"""Heights along a line, and their standard errors by chance."""


@dataclass(frozen=True)
class Top:
    """The top of a head.

    Attributes
    ----------
    course : Profile or Spline
        Its height on the axis.
    points : (n,) bool array
        Points on it.
    slope : (n,) array
        Rise per metre to the left, at each point.
    crown_m : float or (s,) array
        Standard error of the height on the axis that all points share; (s,) at the stations of a support.
    """

    course: Course
    points: np.ndarray
    slope: np.ndarray
    crown_m: Union[float, np.ndarray] = 0.0

    def height_error(self, t: np.ndarray, support: Support) -> np.ndarray:
        """Return the standard error of the height at the stations of a support, (s,) metres.

        Parameters
        ----------
        t : (n,) array
            Chainages of the points on the top, increasing.
        support : Support
            Its error across is one of height where the top is not level.
        """
        leaning = np.interp(support.t, t, self.slope[self.points]) * support.sigma_m
        bridge = bridge_error(t, support.t, UNSEEN_TURN)
        return np.sqrt(self.course.sigma(support.t) ** 2 + self.crown_m**2 + leaning**2 + bridge**2)


def by_outline(
    top: Top, t: np.ndarray, z: np.ndarray, near_axis: np.ndarray, outline: Middles, length_m: float
) -> Top:
    """Measure the height by the outline of the head where that is known, and by the points on the axis elsewhere.

    Parameters
    ----------
    top : Top
        From `find_top`.
    t, z : (n,) arrays
        Chainage (increasing) and height of its points, less the slope across and the fall of the crown.
    near_axis : (n,) bool array
        Points that give the height.
    outline : Middles
        At the stations along the line.
    length_m : float
    """
    chosen, stations = top.points & near_axis, stations_along(length_m)
    noise_m = robust_sigma(z[chosen] - top.course.at(t[chosen]))
    number = np.minimum((t[chosen] / STATION_STEP_M).astype(int), len(stations) - 1)
    points = np.bincount(number, minlength=len(stations))
    mean_m = np.bincount(number, z[chosen], len(stations)) / np.maximum(points, 1)
    which = [np.isfinite(outline.top), points > 0]
    values = np.select(which, [outline.top, mean_m], top.course.at(stations))
    information = np.select(which, [outline.top_information, points / noise_m**2])
    course = smooth(stations, values, information, -TAIL_M, length_m + TAIL_M)
    return replace(top, course=course, crown_m=course.followed(stations, np.where(which[0], outline.top_common, top.crown_m), information))


def smoothed(t: np.ndarray, z: np.ndarray, smoothing_m: float | None) -> Course:
    """Smooth the heights of points.

    Points of a bin are averaged, so that no single point marks the edge of a gap.

    Parameters
    ----------
    t, z : (n,) arrays
        Chainage (increasing) and height, metres.
    smoothing_m : float or None
        Sigma of PAEK; None smooths by a spline as much as the points show.
    """
    rough = rough_level(t, z)
    noise_m = robust_sigma(z - rough)
    _, number, count = np.unique(np.floor(t / PROFILE_BIN_M), return_inverse=True, return_counts=True)
    middle, height = np.bincount(number, t) / count, np.bincount(number, z) / count
    if smoothing_m is None:
        return smooth(middle, height, count / noise_m**2, middle[0] - TAIL_M, middle[-1] + TAIL_M)
    reach_m = 0.5 * smoothing_m / VARIANCE_FACTOR
    averaged = np.diff(np.searchsorted(t, [middle - reach_m, middle + reach_m]), axis=0)[0]
    return Profile(
        middle, smooth_profile(middle, height, smoothing_m, middle), noise_m / np.sqrt(np.maximum(averaged, 1))
    )


def find_top(
    t: np.ndarray,
    across: np.ndarray,
    z: np.ndarray,
    head_width_m: float,
    crown_radius_m: float,
    tolerance_m: float,
    smoothing_m: float | None,
) -> Top | None:
    """Find the height of the top on the head's axis and the points on it; None if too few points agree.

    The slope across is removed first. The disc then separates the top from the side faces, but it rests on the highest
    points, about three standard deviations above the top. Selecting the points in a band around their own smoothed
    height, a few times over, removes that bias.

    Parameters
    ----------
    t, across, z : (n,) arrays
        Chainage (increasing), offset to the left of the axis and height of points on the head, metres.
    head_width_m : float
    crown_radius_m : float
        Radius of the disc.
    tolerance_m : float
        Maximum depth of a point below the top.
    smoothing_m : float or None
        See `smoothed`.
    """
    slope = cross_slope(t, across, z - rough_level(t, z), head_width_m)
    flat = z - slope * across
    top, noise = _under_disc(t, flat, crown_radius_m, tolerance_m)
    central = np.abs(across) <= AXIS_SHARE * head_width_m
    band = min(tolerance_m, max(MIN_BAND_M, BAND_SIGMAS * noise))
    for _ in range(BAND_ROUNDS):
        chosen = top & central if (top & central).sum() >= MIN_POINTS else top
        course = smoothed(t[chosen], flat[chosen], smoothing_m)
        top = np.abs(flat - course.at(t)) <= band
        if top.sum() < MIN_POINTS:
            return None
    return Top(course, top, slope)


def _under_disc(t: np.ndarray, z: np.ndarray, crown_radius_m: float, tolerance_m: float) -> tuple[np.ndarray, float]:
    """Return the points just below the disc that rolls along the top, (n,) bool, and their noise."""
    above = z - rough_level(t, z)
    ordinary = above <= MAX_ABOVE_M
    highest = _highest(t[ordinary], z[ordinary])
    surface = extremal_boundary(t[ordinary][highest], z[ordinary][highest], crown_radius_m)
    depth = np.where(ordinary, surface.closing(np.clip(t, surface.x[0], surface.x[-1])) - z, np.inf)
    noise = robust_sigma(above[depth <= tolerance_m])
    return depth <= min(tolerance_m, max(MIN_BAND_M, DISC_DEPTH_SIGMAS * noise)), noise


def _highest(t: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the indices, (k,), of the highest point in each short bin; `t` is increasing."""
    number = np.floor(t / DISC_BIN_M).astype(int)
    order = np.lexsort((z, number))
    return order[np.flatnonzero(np.diff(number[order], append=number[-1] + 1))]
