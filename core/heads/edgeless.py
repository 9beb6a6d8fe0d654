"""Heads without two edges: those that show one side face alone, and those that are blurred to a round ridge.

A polished crown may return nothing, and a low scanner sees none: the points then form a band as narrow as their noise,
and as high as a face, half a head off the axis. Beams from the air and dense matching of photographs blur a head to a
ridge, which is a parabola across; its crest is the axis. See docs/method.md sections 6.7 and 6.10.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from .head_points import MIN_ON_HEAD, HeadPoints
from .level import OFF_TOP_SIGMAS, SLOPE_ROUNDS, robust_sigma, rough_level
from .outline import FACE_DEPTH_M, Grid, Outline, fit_section, log_likelihood

MAX_BAND_SHARE, BAND_PERCENTILES = 0.4, (5.0, 95.0)
"""Width of a band, in head widths and between these percentiles, that may be a face: noise of 8 mm makes it 26 mm."""

MIN_HEIGHT_M = 0.012
"""Height of such a band, between the same percentiles and beyond its width: a face is 22 mm high."""

TOP_ABOVE_M = 0.022
"""Height of the top above the middle of a face and its corner."""

MIN_GAIN = 6.0
"""Gain of the log-likelihood from which a face is preferred to a crown, and one side to the other: odds of 400."""

FLANK_SIGMA_M = 0.0012
"""Standard error of the axis from one face: half of what head widths differ by, and a millimetre because the slope
across of the head is not seen."""

FLANK_TOP_SIGMA_M = 0.0012
"""Standard error of the top from one face: where the face ends below depends on the rail and on the view."""

REACH_HEADS = 1.0
"""Distance from the line, in head widths, within which the ridge is a parabola: a Gaussian of 7 cm is, to a tenth."""

WINDOW = 33
"""Stations that share one crest, 8.25 m: 16 mm of noise moves the crest by 3 mm over this length, and by 6 mm over 2 m.
The line itself follows curves; only its offsets are averaged."""

MIN_BEND = 0.5
"""Least bend of the parabola, 1/m: a radius of 2 m. A flatter top has no crest."""

CREST_SIGMA_M = 0.003
"""Standard error of a crest that more points would not reduce: a blur of 4 cm blends a head with ballast that is higher
by 2 or 3 cm on one side, and an oblique beam with what it sees on its own side of the rail."""

TILT = 0.035
"""Standard deviation of the slope across of tracks, whose cant is up to 90 mm. A blurred head does not show it, and its
crest moves to the higher side, by slope over bend."""

LEANING_M = 0.008
"""Standard deviation of the mean of the points about the crest: labels lean to the side on which the bed is higher.
Where noise hides the crest, the mean says more."""


@dataclass(frozen=True)
class Flank:
    """A head that shows one face: offset of the axis to the left of the line, and top above the level of the points.

    `sigma_m` is the standard error of the axis; half a head where the points may be on either face, and the axis is
    then stated to be on them.
    """

    left_m: float
    top_m: float
    sigma_m: float


def find_flank(points: HeadPoints) -> Flank | None:
    """Find the head of a line whose points are on one face; None if they are not."""
    across, head_width_m = points.across, points.width_m
    if len(across) < MIN_ON_HEAD:
        return None
    low, high = np.percentile(across, BAND_PERCENTILES)
    if high - low > MAX_BAND_SHARE * head_width_m:
        return None
    up = points.z - rough_level(points.t, points.z)
    bottom, top = np.percentile(up, BAND_PERCENTILES)
    if top - bottom < high - low + MIN_HEIGHT_M or top - bottom > 2 * FACE_DEPTH_M:
        return None
    middle, half = float(np.median(across)), 0.5 * head_width_m
    grid, outline = Grid.of(head_width_m), Outline.of(head_width_m)
    found = []
    for left_m, top_m in ((middle, 0.0), (middle - half, TOP_ABOVE_M), (middle + half, TOP_ABOVE_M)):
        bins = grid.number(across - left_m, up - top_m)
        counts = np.bincount(bins[bins >= 0], minlength=grid.size).astype(float)
        section = fit_section(counts, outline, grid)
        strays = (len(up) - counts.sum()) * np.log(section.shares[-1] / grid.size)
        found.append((log_likelihood(counts, section, outline, grid) + strays, left_m, top_m, section))
    crown, *faces = found
    other, best = sorted(faces, key=lambda one: one[0])
    if best[0] - crown[0] < MIN_GAIN:
        return None
    _, left_m, top_m, section = best
    top_m += float(section.place[1])
    if best[0] - other[0] < MIN_GAIN:
        return Flank(middle, top_m, half)
    return Flank(left_m + float(section.place[0]), top_m, FLANK_SIGMA_M)


@dataclass(frozen=True)
class Ridge:
    """The crest of a blunt head along its line, at equidistant chainages as in `HeadPoints.stations`, (s,) each.

    `offset_m` is the offset of the crest to the left of the line that the points next to a station alone show, and
    `information` the inverse of its variance by the noise of single points, 1/m², 0 where no points are near.
    `common_m` is the standard error that more points would not reduce.
    """

    t: np.ndarray
    offset_m: np.ndarray
    information: np.ndarray
    common_m: np.ndarray

    @classmethod
    def find(cls, points: HeadPoints) -> Ridge | None:
        """Fit one parabola, and a crest for each window, to the points of a line; None without any, or if not blunt."""
        near = points[points.within(REACH_HEADS)]
        if not points.is_blunt or not len(near.t):
            return None
        row, rows = near.station, len(near.stations)
        x, up = near.across, near.z - rough_level(near.t, near.z)
        used = np.ones(len(x), dtype=bool)
        for _ in range(SLOPE_ROUNDS):
            bend = max(-2 * float(np.polynomial.polynomial.polyfit(x[used], up[used], 2)[2]), MIN_BEND)
            flat = up + 0.5 * bend * x**2
            noise_m = robust_sigma(flat[used])
            level, slope, crest, information = _crests(row[used], rows, x[used], flat[used], bend, noise_m)
            used = np.abs(flat - level[row] - slope[row] * x) <= OFF_TOP_SIGMAS * noise_m
        return cls(near.stations, crest, information, np.full(rows, np.hypot(CREST_SIGMA_M, TILT / bend)))


def _crests(
    row: np.ndarray, rows: int, x: np.ndarray, flat: np.ndarray, bend: float, noise_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Fit level and slope across to the points of each window, and the crest to those of each station, (rows,) each.

    The fourth array is the information about the crest, 1/m²: from the offsets of the points about their mean, and from
    the prior of the window, by which the crest is at this mean.
    """
    sums = np.array([np.bincount(row, one, rows) for one in (np.ones_like(x), x, flat, x * x, x * flat)])
    count, sx, sy, xx, xy = uniform_filter1d(sums, WINDOW, axis=1, mode="constant") * WINDOW
    count = np.where(count > 0.5, count, np.inf)
    mean, level = sx / count, sy / count
    prior_m2 = (noise_m / bend / LEANING_M) ** 2
    slope = (xy - mean * sy + prior_m2 * bend * mean) / (xx - mean * sx + prior_m2)
    points, sx, sy, xx, xy = sums
    own_prior = prior_m2 / WINDOW * (count < np.inf)
    spread = xx - 2 * mean * sx + points * mean**2 + own_prior
    product = xy - mean * sy - level * sx + points * mean * level + own_prior * bend * mean
    crest = product / (bend * np.maximum(spread, 1e-12))
    return level - slope * mean, slope, crest, spread * (bend / noise_m) ** 2
