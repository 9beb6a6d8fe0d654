"""Heads of which the points show one side face alone: a polished crown may return nothing, and a low scanner sees none.

The points then form a band as narrow as their noise, and as high as a face. A line on it is half a head off. See
docs/method.md section 6.8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .head_points import MIN_ON_HEAD, HeadPoints
from .level import rough_level
from .outline import FACE_DEPTH_M, Blurred, Grid, Outline, Section, fit_section

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


@dataclass(frozen=True)
class Flank:
    """A head that shows one face.

    Attributes
    ----------
    left_m : float
        Offset of the axis to the left of the line.
    top_m : float
        Height of the top above the level of the points.
    sigma_m : float
        Standard error of the axis; half a head where the points may be on either face. The axis is then
        stated to be on them.
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
        found.append((_log_likelihood(counts, section, outline, grid, len(up)), left_m, top_m, section))
    crown, *faces = found
    other, best = sorted(faces, key=lambda one: one[0])
    if best[0] - crown[0] < MIN_GAIN:
        return None
    _, left_m, top_m, section = best
    top_m += float(section.place[1])
    if best[0] - other[0] < MIN_GAIN:
        return Flank(middle, top_m, half)
    return Flank(left_m + float(section.place[0]), top_m, FLANK_SIGMA_M)


def _log_likelihood(counts: np.ndarray, section: Section, outline: Outline, grid: Grid, count: int) -> float:
    """Return the log-likelihood of all points; those outside the bins are strays."""
    density = Blurred.at(section.place, outline, grid).density(section.shares)
    outside = (count - counts.sum()) * np.log(section.shares[-1] / grid.size)
    return float(counts @ np.log(density) + outside)
