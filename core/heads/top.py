"""The top of one railhead: points found by a rolling disc, and their smoothed height on the axis.

See docs/method.md section 6.4.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Union

import numpy as np
from scipy.ndimage import grey_closing, uniform_filter1d

from ..lines.smoothing import VARIANCE_FACTOR, smooth_profile
from ..rails import Support
from .head_points import RIM_HEADS, HeadPoints
from .level import AXIS_SHARE, OFF_TOP_SIGMAS, SLOPE_ROUNDS, cross_slope, robust_sigma, rough_level
from .outline import CROWN_RADIUS_M
from .sections import COURSE_STATIONS, Middles
from .smoother import SHARP, Prior, Spline, bridge_error, smooth

MIN_POINTS = 10
"""A line with fewer points is not a rail: 1 m of the sparsest rail has more."""

MIN_BAND_M, BAND_SIGMAS = 0.01, 3.0
"""Half height of the band around the top: its minimum, because the disc sags 6 mm into a gap of 1 m, and in standard
deviations of the noise."""

DISC_BIN_M = 0.02
"""Of points this close together only the highest is given to the disc, which is 1 mm too low then on a slope of 5 %."""

BAND_ROUNDS = 3
"""Rounds of smoothing and selection; a fourth moves the top by less than 0.1 mm."""

UNSEEN_TURN = 1e-5
"""Change of the vertical curvature per metre that a rail may have where no point shows it, 1/m²: settled track has
waves of 10 mm that are 60 m long."""

SUNK_M = 0.02
"""Depth below the course of the head on both sides from which a section does not show its top: the web begins 40 mm
below it, and no rail dips by half of this within the longest of `SUNK_LENGTHS_M`."""

SUNK_LENGTHS_M = (4.0, 6.0, 8.0, 12.0, 16.0)
"""Lengths of the windows in which such sections are looked for; each finds those of half to three quarters of it."""

BESIDE_SUNK_M, MIN_BESIDE = 8.0, 16
"""Length of the course on either side of a window, and least number of stations there: half of them."""

SUNK_ROUGH_M, RAISED_ROUGH_M = 0.005, 0.012
"""Largest scatter of the stations there about the course (RMS), of sharp heads and of ridges: beyond it, some of them
may be sunk, or raised, as well."""

RAISED_STATIONS = 5
"""Number of stations over which the heights of a ridge are averaged before raised ones are looked for."""

PROFILE_BIN_M = 0.25
"""Bins along the line in which points are averaged: half the distance between the knots of the spline."""

TAIL_M = 1.0
"""Length over which a profile is extrapolated with the slope at its end; beyond it is level."""

LOWERED_SHARE, LOWERED_ERROR_SHARE = 0.25, 0.3
"""The mean amount by which a beam lowers the crest of a blunt head, and its standard error, as shares of the fall of
the head at the edge of the part that gives the height. Gaussian beams of 0.8, 1 and 1.2 head widths lower its crest by
0.13, 0.4 and 0.85 of this fall, which is a tenth of the depth of the bed below all of them."""

BLENDED_ERROR_M, BLENDED_SHARE = 0.002, 0.5
"""Least standard error of the height of any blunt head, metres, and its share of this fall where images may blur it:
what they show is not raised, because their blur may be of any size."""

SHARED_ERROR_M = 0.015
"""Standard error of the height of a ridge that is not alone, or is in a pavement, metres: alike over all of the run,
because a second head beside it raises it by some centimetres at the most."""

LEAST_INFORMATION = 1e-6
"""Information about level, slope and fall of a crown that is always there, so that few points are enough."""


@dataclass(frozen=True)
class Crown:
    """How the top of a head falls beside its axis: in proportion to the square of the distance, up to the rims.

    `bend` and `sigma` are the fall per square of the distance and its standard error, 1/m, and `rim_m` is the distance
    from the axis up to which the top falls. All of it seems `lowered_m` lower than it is, and `level_m` is the standard
    error of its level that more points would not reduce.
    """

    bend: float
    sigma: float
    rim_m: float
    level_m: float = 0.0
    lowered_m: float = 0.0

    def fall(self, across: np.ndarray) -> np.ndarray:
        """Return how far points beside the axis of their head are lower than the head is on it, (n,) metres."""
        return self.lowered_m + self.bend * np.minimum(np.abs(across), self.rim_m) ** 2

    def error(self, head_width_m: float) -> float:
        """Return the standard error of the height on the axis, metres, from points up to `AXIS_SHARE` beside it."""
        return float(np.hypot(self.sigma * (AXIS_SHARE * head_width_m) ** 2 / 3, self.level_m))


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
    """The top of a head: its height on the axis, the points on it, and the rise per metre to the left at each of them.

    `crown_m` is the standard error of the height on the axis that more points would not reduce, at all stations or at
    each.
    """

    course: Course
    points: HeadPoints
    slope: np.ndarray
    crown_m: Union[float, np.ndarray] = 0.0

    @property
    def level(self) -> np.ndarray:
        """Heights of the points without the slope across, (n,) metres."""
        return self.points.z - self.slope * self.points.across

    def height_error(self, support: Support) -> np.ndarray:
        """Return the standard error of the height at the stations of a support, (s,) metres.

        The error across is one of height where the top is not level.
        """
        leaning = np.interp(support.t, self.points.t, self.slope) * support.sigma_m
        bridge = bridge_error(self.points.t, support.t, UNSEEN_TURN)
        return np.sqrt(self.course.sigma(support.t) ** 2 + self.crown_m**2 + leaning**2 + bridge**2)


def by_outline(top: Top, outline: Middles) -> Top:
    """Take the height that the outline of the head shows at each station, and that of the points on the axis elsewhere.

    Both have their information, and one spline smooths them.
    """
    chosen = top.points.within(AXIS_SHARE)
    points, stations = top.points[chosen], top.points.stations
    flat = top.level[chosen]
    count = points.per_station()
    mean_m = points.per_station(flat) / np.maximum(count, 1)
    outlined = np.isfinite(outline.top) & (outline.top_information > 0)
    outlined &= ~_are_below(np.where(outlined & (count > 0), outline.top - mean_m, np.nan))
    by_points = count / robust_sigma(flat - top.course.at(points.t)) ** 2
    information = np.where(outlined, outline.top_information, by_points)
    values = np.where(outlined, outline.top, mean_m)
    known = np.flatnonzero(information > 0)
    known = known[~are_sunk(stations[known], values[known])]
    if not len(known):
        return top
    t, values = stations[known], values[known]
    course = smooth(t, values, information[known], -TAIL_M, points.length_m + TAIL_M)
    common_m = np.where(outlined, outline.top_common, top.crown_m)[known]
    return replace(top, course=course, crown_m=np.interp(stations, t, course.followed(t, common_m, information[known])))


def _are_below(above_m: np.ndarray) -> np.ndarray:
    """Return at which stations the top of the outline, `above_m` the points on the head, (s,), is below these, bool.

    Far from the scanner, most points of a section may be of one face and of the web, and its outline is fitted to both.
    """
    total_m = uniform_filter1d(np.nan_to_num(above_m), COURSE_STATIONS, mode="constant")
    return total_m < -SUNK_M / 2 * uniform_filter1d(np.isfinite(above_m) * 1.0, COURSE_STATIONS, mode="constant")


def are_sunk(t: np.ndarray, z: np.ndarray, rough_m: float = SUNK_ROUGH_M) -> np.ndarray:
    """Return which heights at increasing chainages, (n,) metres, are not those of the top: both sides are higher.

    Far from the scanner, hardly any points are on the crown of a head, and those on the web take its place. Where the
    heights beside scatter by more than `rough_m` about their course, nothing is known.
    """
    sunk = np.zeros(len(t), dtype=bool)
    first_m, last_m = (t[0] + BESIDE_SUNK_M, t[-1] - BESIDE_SUNK_M) if len(t) else (0.0, 0.0)
    for length_m in SUNK_LENGTHS_M:
        for start_m in np.arange(first_m, last_m - length_m, length_m / 4):
            borders_m = start_m + np.array([-BESIDE_SUNK_M, 0.0, length_m, length_m + BESIDE_SUNK_M])
            first, begin, end, last = np.searchsorted(t, borders_m)
            if min(begin - first, last - end) < MIN_BESIDE or begin == end:
                continue
            inside, beside = slice(begin - first, end - first), np.r_[: begin - first, end - first : last - first]
            here, powers = z[first:last], np.vander(t[first:last] - start_m, 3)
            off_m = here - powers @ np.linalg.lstsq(powers[beside], here[beside], rcond=None)[0]
            if np.median(off_m[inside]) < -SUNK_M and np.std(off_m[beside]) < rough_m:
                sunk[begin:end] |= off_m[inside] < -SUNK_M / 2
    return sunk


def by_lone_ridge(top: Top, smoothing_m: float | None, prior: Prior) -> Top:
    """Take the height that a ridge shows where it is alone and out of its bed.

    Next to another head both are one ridge, which is higher, and in a pavement no blur lowers the head. What a ridge
    shows there counts for little, and decides where it is far to where it is alone.
    """
    points = top.points
    chosen = points.alone & ~_raised_stations(top)[points.station]
    if chosen.all():
        return top
    central = points.within(AXIS_SHARE)
    if (chosen & central).sum() < MIN_POINTS:
        return top
    used = central if smoothing_m is None else chosen & central
    t, level, lone = points.t[used], top.level[used], chosen[used]
    noise_m = robust_sigma((level - top.course.at(t))[lone])
    return replace(top, course=smoothed(t, level, smoothing_m, prior, _kept(lone, noise_m)))


def _kept(lone: np.ndarray, noise_m: float) -> np.ndarray:
    """Return the share of its information that each point of a ridge keeps, (n,): all of it where the ridge is alone.

    The points of a run that is not have one error in common, so that together they tell as much as one measurement.
    """
    run = np.cumsum(np.diff(lone, prepend=lone[0]))
    return np.where(lone, 1.0, np.minimum((noise_m / SHARED_ERROR_M) ** 2 / np.bincount(run)[run], 1.0))


def _raised_stations(top: Top) -> np.ndarray:
    """Return at which stations a ridge is higher than on both sides, (s,) bool: it stands in a pavement there."""
    count = top.points.per_station()
    known = np.flatnonzero(count)
    heights = top.points.per_station(top.level)[known] / count[known]
    raised = np.zeros(len(count), dtype=bool)
    steady = uniform_filter1d(heights, RAISED_STATIONS)
    raised[known] = are_sunk(top.points.stations[known], -steady, RAISED_ROUGH_M)
    return raised


def fit_crown(points: HeadPoints) -> Crown:
    """Fit a parabola to the crown of a head.

    New crowns have a radius, and worn ones are flatter. Where beams blend the head and the ballast, the share of the
    ballast grows with the distance from the axis, and the fall may be of any size.
    """
    usual, rim_m = 0.5 / CROWN_RADIUS_M, RIM_HEADS[0] * points.width_m
    near = points[points.within(RIM_HEADS[0])]
    if not len(near.t):
        return Crown(usual, usual, rim_m)
    expected = np.array([0.0, 0.0, 0.0 if points.is_blunt else usual**-2])
    above, powers = near.z - rough_level(near.t, near.z), np.vander(near.across, 3, increasing=True)
    used, off = np.ones(len(above), dtype=bool), above
    for _ in range(SLOPE_ROUNDS):
        noise_m = robust_sigma(off[used])
        information = powers[used].T @ powers[used] / noise_m**2 + np.diag(expected + LEAST_INFORMATION)
        covariance = np.linalg.inv(information)
        found = covariance @ (powers[used].T @ above[used] / noise_m**2 - expected * usual)
        off = above - powers @ found
        used = np.abs(off) <= OFF_TOP_SIGMAS * robust_sigma(off)
    bend = max(-found[2], 0.0)
    crown = Crown(bend, float(np.sqrt(covariance[2, 2])), rim_m)
    return _raised(crown, points) if points.is_blunt else crown


def _raised(crown: Crown, points: HeadPoints) -> Crown:
    """Return the crown of a blunt head with the mean amount by which a beam lowers it, and with the error of that."""
    fall_m = crown.bend * (AXIS_SHARE * points.width_m) ** 2
    share = LOWERED_ERROR_SHARE if points.scanned else BLENDED_SHARE
    lowered_m = LOWERED_SHARE * fall_m if points.scanned else 0.0
    return replace(crown, level_m=max(share * fall_m, BLENDED_ERROR_M), lowered_m=lowered_m)


def smoothed(
    t: np.ndarray,
    z: np.ndarray,
    smoothing_m: float | None,
    prior: Prior = SHARP,
    kept: np.ndarray | float = 1.0,
) -> Course:
    """Smooth heights of points at increasing chainages by PAEK or, with None, by a spline as much as points show.

    Points of a bin are averaged, so that no single point marks the edge of a gap. `kept`, (n,) or one for all,
    is the share of its information that each point keeps.
    """
    rough = rough_level(t, z)
    noise_m = robust_sigma(z - rough)
    _, number = np.unique(np.floor(t / PROFILE_BIN_M), return_inverse=True)
    kept = np.broadcast_to(kept, t.shape)
    count = np.bincount(number, kept)
    middle, height = np.bincount(number, kept * t) / count, np.bincount(number, kept * z) / count
    if smoothing_m is None:
        return smooth(middle, height, count / noise_m**2, middle[0] - TAIL_M, middle[-1] + TAIL_M, None, prior)
    reach_m = 0.5 * smoothing_m / VARIANCE_FACTOR
    averaged = np.diff(np.searchsorted(t, [middle - reach_m, middle + reach_m]), axis=0)[0]
    return Profile(
        middle, smooth_profile(middle, height, smoothing_m, middle), noise_m / np.sqrt(np.maximum(averaged, 1))
    )


def find_top(
    points: HeadPoints, crown_radius_m: float, tolerance_m: float, smoothing_m: float | None, prior: Prior = SHARP
) -> Top | None:
    """Find the height of the top on the head's axis and the points on it; None if too few points agree.

    The slope across is removed first. The disc then separates the top from the side faces, but it rests on the highest
    points, about three standard deviations above the top. Selecting the points in a band around their own smoothed
    height, down to `tolerance_m`, a few times over, removes that bias.
    """
    t, z = points.t, points.z
    slope = cross_slope(t, points.across, z - rough_level(t, z), points.width_m)
    flat = z - slope * points.across
    top = rolling_disc(t, flat, crown_radius_m, tolerance_m) - flat <= tolerance_m
    central = points.within(AXIS_SHARE)
    noise_m = robust_sigma((flat - rough_level(t, flat))[top])
    band = min(tolerance_m, max(MIN_BAND_M, BAND_SIGMAS * noise_m))
    for _ in range(BAND_ROUNDS):
        chosen = top & central if (top & central).sum() >= MIN_POINTS else top
        course = smoothed(t[chosen], flat[chosen], smoothing_m, prior)
        top = np.abs(flat - course.at(t)) <= band
        if top.sum() < MIN_POINTS:
            return None
    return Top(course, points[top], slope[top])


def rolling_disc(t: np.ndarray, z: np.ndarray, radius_m: float, tolerance_m: float) -> np.ndarray:
    """Return the height of the lower side of a disc that rolls along points from above, at each point, (n,) metres.

    That is the closing of their heights by the disc. Where it sinks by more than the tolerance between two points, it
    may sink further.
    """
    reach = int(np.sqrt(2 * radius_m * tolerance_m) / DISC_BIN_M) + 1
    beside_m = DISC_BIN_M * np.arange(-reach, reach + 1)
    disc = np.sqrt(np.maximum(radius_m**2 - beside_m**2, 0.0)) - radius_m
    number = np.floor((t - t[0]) / DISC_BIN_M).astype(int) + 2 * reach
    highest = np.full(number[-1] + 2 * reach + 1, -np.inf)
    np.maximum.at(highest, number, z)
    return grey_closing(highest, structure=disc)[number]
