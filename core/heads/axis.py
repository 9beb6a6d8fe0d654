"""The axis of a head along its line: what points show of it at each station, smoothed, and its standard error.

A line is moved onto this axis, and once it is there, the same measurement states how well points support it. See
docs/method.md sections 6.2 and 6.5.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d

from ..rails import Support
from .edges import EDGE_SIGMA_M, VIEW_STATIONS, Ridge, edge_middles
from .faces import FLANK_TOP_SIGMA_M, Beside, Flank, band_of, beside_faces, find_flank
from .head_points import MIN_ON_HEAD, STATION_STEP_M, HeadPoints
from .level import robust_sigma
from .roads import MIN_WIDER_M, bands, hidden_edges
from .sections import Middles, outline_middles
from .smoother import BLUNT, SHARP, Spline, bridge_error, smooth

UNSHOWN_M = 0.3
"""Standard error of a metre of line that no point shows: raster lines follow what covers a head, a decimetre off."""

UNSEEN_TURN = 1e-4
"""Change of the curvature per metre that a rail may have where no point shows it, 1/m²: that of a transition."""

NARROW_SHARE, NARROW_PERCENTILES = 0.25, (5.0, 95.0)
"""Width of a band of points, in head widths and between these percentiles, in which no edges are looked for: points
that were drawn or computed on the axis, not scanned, all have one offset."""

STRAY_SIGMAS = 3.0
"""Distance from a band, in standard deviations of its points, from which they are not on it: foot, ballast, weeds."""

CELL_M = 0.04
"""Cell size of the raster of standard gauge."""


def unseen_m(cell_m: float) -> float:
    """Return the standard deviation of a line where points show no edge of its head: it may be anywhere in its cell."""
    return cell_m / float(np.sqrt(12))


@dataclass(frozen=True)
class Shown:
    """What points show of a head at each station of its line, (s,) each; lengths in metres.

    Chainages `t` are those of `HeadPoints.stations`; `points` on top are nearest to the station. They show the offset
    of the axis to the left of the line, and `information` is the inverse of its variance by chance, 1/m², 0 where these
    points show nothing. `common_m` is the part of the standard error that more points would not reduce; along an
    `Axis`, the part of it that its smoothed course keeps.
    """

    t: np.ndarray
    points: np.ndarray
    offset_m: np.ndarray
    information: np.ndarray
    common_m: np.ndarray
    outline: Middles


@dataclass(frozen=True)
class Axis:
    """The axis of a head along its line: its offset to the left, and the standard error of this by chance.

    It has a `flank` where the points show one face of the head alone, and a `ridge`, the crest, where the head is
    blunt.
    """

    course: Spline
    shown: Shown
    flank: Flank | None = None
    ridge: Ridge | None = None

    @classmethod
    def of(cls, points: HeadPoints, unseen_m: float, by_outline: bool = True) -> Axis:
        """Measure the axis, given points at the own level of the line.

        `unseen_m` is the standard deviation of the line where points show no edges of the head; `by_outline` says that
        the line is close enough to its head to compare the points with the outline.
        """
        flank = find_flank(points)
        is_band = flank is not None or _is_narrow(points)
        ridge = None if is_band else Ridge.find(points)
        if ridge is not None:
            shown = _of_ridge(points, ridge)
        elif flank is not None:
            shown = _of_band(points, flank.left_m, flank.sigma_m)
        elif is_band:
            shown = _of_band(points, np.median(points.across), unseen_m)
        else:
            shown = _of_head(points, unseen_m, by_outline)
        known = shown.information > 0
        information = np.where(known, shown.information, STATION_STEP_M / UNSHOWN_M**2)
        offset_m, bent = np.where(known, shown.offset_m, 0.0), points.line if known.any() else None
        prior = BLUNT if ridge else SHARP
        course = smooth(shown.t, offset_m, information, 0.0, points.length_m, bent, prior)
        common_m = course.followed(shown.t, np.where(known, shown.common_m, 0.0), information)
        return cls(course, replace(shown, common_m=common_m), flank, ridge)

    def support(self, marked: bool) -> Support:
        """Return how well points support the line as it is.

        Its error of height is only what passes of the scanner, which are not `marked` in the points, differ by.
        """
        t = self.shown.t
        by_chance = self.course.sigma(t) ** 2
        bridge_m = np.minimum(bridge_error(t[self.shown.information > 0], t, UNSEEN_TURN), UNSHOWN_M)
        remainder = np.maximum(self.course.at(t) ** 2 - by_chance, 0.0)
        sigma_m = np.sqrt(by_chance + remainder + self.shown.common_m**2 + bridge_m**2)
        top_m = np.nan if self.flank is None else FLANK_TOP_SIGMA_M
        support = Support.of_one_strip(t, self.shown.points, sigma_m, top_m)
        if marked or self.flank is not None:
            return support
        return _with_blur(support, self.shown.outline.blur, self.shown.outline.blur_up)


def _means(points: HeadPoints) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of points at each station, and the mean of their offsets; 0 without points."""
    count = points.per_station()
    return count, points.per_station(points.across) / np.maximum(count, 1)


def _of_ridge(points: HeadPoints, ridge: Ridge) -> Shown:
    """Return what points show of a blunt head: its crest."""
    outline = Middles.unknown(len(ridge.t))
    return Shown(ridge.t, points.per_station(), ridge.offset_m, ridge.information, ridge.common_m, outline)


def _is_narrow(points: HeadPoints) -> bool:
    """Return whether all points near a line, by their offsets from it, form a band in which no edges can be seen."""
    if len(points.across) < MIN_ON_HEAD:
        return False
    low, high = np.percentile(points.across, NARROW_PERCENTILES)
    return bool(high - low < NARROW_SHARE * points.width_m)


def _of_band(points: HeadPoints, left_m: float, sigma_m: float) -> Shown:
    """Return what points show that are all on one face, or on the axis; the axis is at `left_m` on average."""
    stations = points.stations
    off_m = points.across - band_of(points)
    noise_m = robust_sigma(off_m)
    count, mean_m = _means(points[np.abs(off_m) < STRAY_SIGMAS * noise_m])
    offset_m, common_m = mean_m + left_m - np.median(points.across), np.full(len(stations), sigma_m)
    return Shown(stations, count, offset_m, count / noise_m**2, common_m, Middles.unknown(len(stations)))


def _of_head(points: HeadPoints, unseen_m: float, by_outline: bool) -> Shown:
    """Return what points show of a head: its outline, its edges, one of its sides, or the mean of the points on top."""
    stations, top = points.stations, points[points.top[0]]
    on_head, mean_m = _means(top[top.within(0.5)])
    free = points.free & ~hidden_edges(points)
    edge_m, edge_information = edge_middles(points, free)
    # Windows and sections are longer than a station, and show nothing where no points are on the head.
    shown, either_end_m = on_head > 0, _either_end(points)
    by_edges = np.isfinite(edge_m) & shown
    outline = Middles.unknown(len(stations))
    if by_outline:
        outline = outline_middles(points, shown & (by_edges | (either_end_m == 0)) & free.all(axis=0))
    outlined = np.isfinite(outline.offset)
    wanted = ~outlined & free.all(axis=0)
    beside = _beside(points, wanted, outline.aside)
    which = [outlined, wanted & np.isfinite(beside.offset), by_edges, shown]
    unsure_m = np.hypot(unseen_m, either_end_m)
    by_mean = np.full(len(stations), STATION_STEP_M / unseen_m**2)
    return Shown(
        stations,
        top.per_station(),
        np.select(which, [outline.offset, beside.offset, edge_m, mean_m]),
        np.select(which, [outline.information, beside.information, edge_information, by_mean]),
        np.select(which, [outline.common, beside.common, EDGE_SIGMA_M, unsure_m]),
        outline,
    )


def _beside(points: HeadPoints, wanted: np.ndarray, aside: np.ndarray) -> Beside:
    """Find the axis by one side of the head, at the `wanted` stations and those of these that are `aside`, (s,) bool.

    These are off the outline of their section: the line may be off the head there, or the scanner on the other side of
    it, so they are looked at alone, however many points they have.
    """
    of_section = beside_faces(points, wanted & ~aside)
    alone = beside_faces(points[aside[points.station]], wanted & aside, fewer_than=np.inf)
    return Beside(*(np.where(aside, *both) for both in zip(astuple(alone), astuple(of_section))))


def _either_end(points: HeadPoints) -> np.ndarray:
    """Estimate by how much the middle of a band of points that is wider than a head may be off the head, (s,) metres.

    Road next to a grooved rail is as high as its head, which may be at either end of the band.
    """
    right_m, left_m = bands(points)
    wider_m = left_m - right_m - points.width_m
    return np.where(wider_m > MIN_WIDER_M, 0.5 * wider_m, 0.0)


def _with_blur(support: Support, blur_m: np.ndarray, blur_up_m: np.ndarray) -> Support:
    """Add what blurs the head across and in height, (s,) metres, as of passes of the scanner apart by twice that.

    Next to it, where one of the passes may go on alone, the line is as much in doubt.
    """
    largest_m = np.maximum(blur_m, blur_up_m)
    if not largest_m.any():
        return support
    across_m, up_m = (maximum_filter1d(one, 2 * VIEW_STATIONS + 1) for one in (blur_m, blur_up_m))
    strips = np.column_stack([np.ones(len(blur_m)), np.where(largest_m > 0, 2 * largest_m, np.nan), across_m])
    return replace(support, sigma_m=np.hypot(support.sigma_m, across_m), strips=strips, sigmaz_m=up_m)
