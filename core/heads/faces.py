"""Heads of which a scanner shows one side: where their axis is beside the band of points.

A far scanner, or one beside a polished crown, sees one face or its corner and a little of the crown, half a head off
the axis. Few points or many, offset and height together show which side of the head they are on. See docs/method.md
section 6.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter, percentile_filter
from scipy.special import softmax

from ..lines.smoothing import smooth_profile
from .edges import VIEW_STATIONS
from .head_points import MIN_ON_HEAD, HeadPoints
from .level import MIN_NOISE_M
from .outline import CORNER_RADIUS_M, FACE_DEPTH_M, WEB_TO_M, Grid, Outline, fit_section, log_likelihood
from .sections import COURSE_STATIONS, MIN_SECTION_POINTS, borders

MAX_BAND_SHARE, BAND_PERCENTILES = 0.4, (5.0, 95.0)
"""Width of a band, in head widths and between these percentiles, that may be a face: noise of 8 mm makes it 26 mm."""

MIN_HEIGHT_M = 0.010
"""Height of such a band, between the same percentiles and beyond its width: half of what a face has, 20 mm. Where the
crown is seen as well, the outline of the head shows its axis."""

OFF_AXIS = 0.25
"""Distance of the axis from the middle of a band, in head widths, from which the band is a face, wherever the fit
began: half of what it is on a face."""

TOP_ABOVE_M = 0.022
"""Height of the top above the middle of a face and its corner."""

MIN_GAIN = 6.0
"""Gain of the log-likelihood from which a face is preferred to a crown, and sections together prefer a side: odds of
400."""

COUNTED = 0.5
"""Part of the log-likelihood that counts for the side of a head, because the points share errors of the model. Of 33
sections in random worlds from tripods in which the two sides differ by 2 to 9, 25 prefer the right one."""

FLANK_SIGMA_M = 0.0012
"""Standard error of the axis from one face: half of what head widths differ by, and a millimetre because the slope
across of the head is not seen."""

FLANK_TOP_SIGMA_M = 0.0012
"""Standard error of the top from one face: where the face ends below depends on the rail and on the view."""

LEAST_POINTS, SECTION_POINTS = 30, 60
"""Points from which a head is looked for, and points of a section. On far rails of random worlds, the logarithms of the
likelihoods of the two sides differ by 4 to 27 with 30 points, by 5 to 100 with 60."""

WEB_DEPTH_M, USED_DEPTH_M, ABOVE_M = 0.045, 0.08, 0.03
"""Depths below the highest points of a line from which points are on the web below the head, whose faces end 40 mm
below the top, and down to which those on the web are used: the highest points are up to 20 mm below the top. Height
above them from which points are of weeds."""

PROFILE_M = 5.0
"""Sigma of PAEK for the mean height along a line, above which the highest points around each are found."""

HIGHEST_PERCENT = 90.0
"""Percentile of the heights of successive points that is the highest of a head: a tenth may be weeds."""

BAND_POINTS = 41
"""Successive points whose median is the band of a line. A line that was drawn from few points wanders about it by 3 cm
in 20 m, so that a section about the line would be smeared."""

MIN_SIDE_SHARE = 0.5
"""Least share of the points that are on one side of a head, from its upper corner on down: a class of heads may leave
out what is below this corner. Road beside a head, which is as high, is wider than a corner."""

MAX_STRAY_SHARE, MAX_NOISE_M = 0.4, 0.008
"""Largest share of points on no part of a head, and largest noise: what spreads further is ballast, or no rail."""

NEAR_HEAD_M = 0.01
"""Distance from the outline up to which a point is on the head: three times the noise of most scanners."""


@dataclass(frozen=True)
class Flank:
    """A head that shows one face: offset of the axis to the left of the line, and top above the level of the points.

    `sigma_m` is the standard error of the axis: about half a head where the points may be on either face, and the axis
    is then stated to be near them.
    """

    left_m: float
    top_m: float
    sigma_m: float


@dataclass(frozen=True)
class Beside:
    """The axis at s stations, by the side of a head that sections show; NaN where they show none.

    `offset`, (s,), is in metres to the left of the line, `information` the inverse of its variance that the points next
    to a station alone contribute, 1/m², and `common` the standard error that a section shares, metres.
    """

    offset: np.ndarray
    information: np.ndarray
    common: np.ndarray


@dataclass(frozen=True)
class _Fit:
    """The outline of a head, fitted to points: its axis to the left of their middle, its top above it, metres.

    `side` is 1 where the axis is on the left of the points, -1 on their right, and 0 where they are about it. `stray`
    and `beside` are the shares of points on no part of the head, and on that side of it.
    """

    likelihood: float
    left_m: float
    top_m: float
    side: int
    stray: float
    beside: float
    noise_m: float

    @property
    def shows_side(self) -> bool:
        """Whether these are the points of a head of which one side is seen."""
        return self.stray <= MAX_STRAY_SHARE and self.beside >= MIN_SIDE_SHARE and self.noise_m <= MAX_NOISE_M


def find_flank(points: HeadPoints) -> Flank | None:
    """Find the head of a line whose points are on one face; None if they are not."""
    across, head_width_m = points.across, points.width_m
    if len(across) < MIN_ON_HEAD:
        return None
    low, high = np.percentile(across, BAND_PERCENTILES)
    if high - low > MAX_BAND_SHARE * head_width_m:
        return None
    up = above_course(points)
    bottom, top = np.percentile(up, BAND_PERCENTILES)
    if top - bottom < high - low + MIN_HEIGHT_M or top - bottom > 2 * FACE_DEPTH_M:
        return None
    middle = float(np.median(across))
    fits = _fits(across - middle, up, head_width_m)
    if any(fit.side == 0 for fit in fits if fit.likelihood > fits[0].likelihood - MIN_GAIN):
        return None
    left_m, sigma_m = _axis(fits)
    return Flank(middle + left_m, fits[0].top_m, sigma_m)


def beside_faces(points: HeadPoints, wanted: np.ndarray, fewer_than: float = MIN_SECTION_POINTS) -> Beside:
    """Find the axis by the points of each section of a line that has `wanted` stations, (s,) bool.

    A section with as many points as `fewer_than` is left out: it shows its outline, or something that is not a head
    alone. A scanner passes a rail on one side for a while: each section and its neighbours together show which one it
    is.
    """
    found = Beside(*np.full((3, len(wanted)), np.nan))
    if len(points.t) < LEAST_POINTS:
        return found
    points, up = _of_rail(points)
    high = up > -WEB_DEPTH_M
    head = points[high]
    if not high.any():
        return found
    off_band = points.across - np.interp(points.t, head.t, band_of(head))
    up -= np.median(up[high])
    per_view = len(head.t) * VIEW_STATIONS / (np.ptp(head.station) + 1)
    usual = COURSE_STATIONS if per_view >= MIN_SECTION_POINTS else VIEW_STATIONS
    parts, own = [], []
    for first, last in borders(head.station, len(wanted), SECTION_POINTS, usual):
        start, end = np.searchsorted(points.station, [first, last])
        if wanted[first:last].any() and np.count_nonzero(high[start:end]) < fewer_than:
            parts.append(slice(first, last))
            own.append(np.arange(start, end))
    fits = [_fits(off_band[mine], up[mine], points.width_m) for mine in own]
    for part, mine, tried, side in zip(parts, own, fits, _sides(fits)):
        tried = [fit for fit in tried if not side or fit.side != -side]
        if not tried or not tried[0].shows_side:
            continue
        left_m, found.common[part] = _axis(tried)
        on_head = np.abs(off_band[mine] - left_m) < 0.5 * points.width_m + NEAR_HEAD_M
        on_head &= np.abs(up[mine] - tried[0].top_m + 0.5 * FACE_DEPTH_M) < 0.5 * FACE_DEPTH_M + NEAR_HEAD_M
        mean_m, found.information[part] = _by_station(points[mine[on_head]], part, off_band[mine][on_head])
        found.offset[part] = mean_m + left_m
    return found


def above_course(points: HeadPoints) -> np.ndarray:
    """Return the heights of points above the mean height along their line, (n,) metres."""
    return points.z - smooth_profile(points.t, points.z, PROFILE_M, points.t)


def band_of(points: HeadPoints) -> np.ndarray:
    """Return the offset of the band of a line around each of its points, (n,) metres."""
    return median_filter(points.across, min(BAND_POINTS, len(points.t)), mode="nearest")


def _by_station(points: HeadPoints, part: slice, off_band: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the offset of the band at the stations of a section, by the points next to each, and its information.

    Points, (n,), that are off the band on average, as on a corner, do not move it.
    """
    count, sums = (points.per_station(values)[part] for values in (None, points.across))
    mean_m = np.where(count > 0, sums / np.maximum(count, 1), np.nan)
    return mean_m - np.mean(off_band), count / max(np.var(off_band), MIN_NOISE_M**2)


def _of_rail(points: HeadPoints) -> tuple[HeadPoints, np.ndarray]:
    """Return the points of a line that are on its head or on the web below, and their heights above the highest, (n,).

    A class of whole rails shows the web as well: it is 3 cm beside the face that the scanner sees, below the axis.
    """
    up = above_course(points)
    highest = percentile_filter(up, HIGHEST_PERCENT, min(BAND_POINTS, len(up)), mode="nearest")
    up -= smooth_profile(points.t, highest, PROFILE_M, points.t)
    rail = (up > -USED_DEPTH_M) & (up < ABOVE_M)
    return points[rail], up[rail]


def _fits(across: np.ndarray, up: np.ndarray, head_width_m: float) -> list[_Fit]:
    """Fit a head to points, by offsets from their middle and heights, (n,), as a crown and as either face.

    The likeliest fit comes first. So few points do not distinguish a line of sight behind an edge from a face.
    """
    half_m = 0.5 * head_width_m
    grid, outline = Grid.of(head_width_m, WEB_TO_M), Outline.of(head_width_m, rays_deg=(), web=True)
    fits = []
    for left_m, top_m in ((0.0, 0.0), (-half_m, TOP_ABOVE_M), (half_m, TOP_ABOVE_M)):
        bins = grid.number(across - left_m, up - top_m)
        counts = np.bincount(bins[bins >= 0], minlength=grid.size).astype(float)
        section = fit_section(counts, outline, grid)
        outside, stray = len(up) - counts.sum(), float(section.shares[-1])
        likelihood = log_likelihood(counts, section, outline, grid) + outside * np.log(stray / grid.size)
        axis_m = left_m + float(section.place[0])
        side = int(np.sign(axis_m)) if abs(axis_m) > OFF_AXIS * head_width_m else 0
        head = up > top_m + section.place[1] - FACE_DEPTH_M - NEAR_HEAD_M
        beside = np.mean(-side * (across[head] - axis_m) >= half_m - CORNER_RADIUS_M) if side and head.any() else 0.0
        shares = (outside + stray * counts.sum()) / len(up), float(beside)
        noise_m = float(section.noise_m.max())
        fits.append(_Fit(likelihood, axis_m, top_m + float(section.place[1]), side, *shares, noise_m))
    best = {fit.side: fit for fit in sorted(fits, key=lambda fit: fit.likelihood)}
    return sorted(best.values(), key=lambda fit: -fit.likelihood)


def _axis(fits: Sequence[_Fit]) -> tuple[float, float]:
    """Return the mean of the axis to the left of the points, and its standard error, metres, by how likely fits are.

    The likeliest fit of each side counts. Where the points may be on either face, the mean is near them.
    """
    left_m, likelihood = np.array([[fit.left_m, fit.likelihood] for fit in fits]).T
    weight = softmax(COUNTED * likelihood)
    mean_m = weight @ left_m
    return float(mean_m), float(np.sqrt(FLANK_SIGMA_M**2 + weight @ (left_m - mean_m) ** 2))


def _sides(sections: Sequence[Sequence[_Fit]]) -> np.ndarray:
    """Return on which side of the points the axis is in each section, (n,), 1 for the left; 0 if that is not decided.

    A section counts in full, and its neighbours by half, up to `MIN_GAIN`: at places of a tripod, the side may change.
    """
    gains = np.zeros(len(sections))
    for number, fits in enumerate(sections):
        by_side = {fit.side: fit.likelihood for fit in fits}
        gains[number] = by_side[1] - by_side[-1] if {-1, 1} <= by_side.keys() else 0.0
    beside = np.clip(gains / 2, -MIN_GAIN, MIN_GAIN)
    together = gains.copy()
    together[1:] += beside[:-1]
    together[:-1] += beside[1:]
    return np.where(np.abs(together) > MIN_GAIN, np.sign(together), 0).astype(int)
