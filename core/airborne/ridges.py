"""Two ridges on a bed: what rails look like after the footprint of an airborne scanner, and how well points show them.

The height across a track is that of a bed that is level but for cant and a slight bow, and of two ridges of the same
height at the distance of the rails. A place is compared with a bed without them, with a bed with one of them only, and
with a bed that ends in an edge where the other should stand: each rail must earn its half (docs/airborne.md). The whole
profile of a line shows its ridges, and every section of it the middle of the track.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..polyline import Polyline
from ..spread import sigma_by_median
from .guide_line import STATION_M, Corridor

HALF_M = 1.25
"""Half the width of the bed that is looked at: a platform may begin 0.25 m farther out."""

AREA_M2, HEIGHT_SPREAD = 0.022, 0.35
"""Cross-section of a rail above its bed, seen from above, between that of a bare rail and one with ballast piled at it,
and the standard deviation of the ridge's height as a share of it."""

NORMAL_AREA = np.sqrt(2 * np.pi)

MIN_WIDTH_M, HEAD_M = 0.09, 0.04
"""Least standard deviation of a ridge that is looked for, and what rail and registration add to that of the beam."""

TILT, BOW = 0.12, 0.02
"""Standard deviations of the bed's tilt, which covers 180 mm of cant, and of its bow, 1/m."""

BEND = 0.35
"""Standard deviation of the slope of an edge that stands in for a rail."""

TRENCH = 0.1
"""The same for a bend in the middle of the bed, or a bow of it, that stands in for both rails."""

EDGE_INSIDE_M = 0.15
"""Distance inside of the rail at which such an edge begins."""

OUTLIER = 3.0
"""Residual, in standard deviations, at which a bin, or a section of a curve, has lost 3/4 of its weight."""

FLAT_LOSS = 0.45
"""Loss per bin of a bed that is flat but for noise; what is beyond counts against a place."""

UNSEEN_VARIANCE = 1e9
"""Variance of a bin without points."""

BIN_M, PROFILE_BIN_M = 0.025, 0.02
"""Width of the bins across in the fit of a section, and in the profile of a whole line. A middle that lies within a bin
of the end of the search lies beyond it."""

WIDTHS_M = np.arange(0.04, 0.24, 0.01)
SPACINGS_M = np.arange(-0.12, 0.121, 0.02)
"""Widths of a ridge that are tried, and deviations of the rails' distance, up to those between neighbouring gauges."""

OTHER_GAIN, OTHER_M = 40.0, 0.045
"""Log-likelihood of another distance of the rails above that of the expected one, and the deviation, from which it is
said: ballast piled at the rails shifts the ridges by up to 20 mm."""

PROFILE_ROUGH_M, FREE = 0.004, 3.0
"""Roughness of a profile, and the spread of the ridge's height while it is measured."""

LOWEST, HIGHEST = 0.3, 2.2
"""Heights of a ridge, as shares of the expected one, between which a measured one is believed."""

SECTION_ROUGH_M, SECTION_SPREAD = 0.018, 0.15
"""What averaging does not remove in a bin of a section, and the spread of the ridge's height along a line."""

PARABOLA = 4
"""Steps on either side of the best place through which a parabola states middle and standard error."""

LEAST_SIGMA_M = 0.004
"""Standard error of a section below which the scanner itself is not good enough."""

ENOUGH_GAIN = 6.0
"""A section shows a track if three of them gain more than this."""


@dataclass(frozen=True)
class RidgeShape:
    """Ridges as they are expected, metres.

    `spacing_m` is the distance between the middles of the railheads, `width_m` the standard deviation of a ridge, and
    `height_m` its height, with the standard deviation `height_spread` as a share of it. A point's height has the
    standard deviation `noise_m`; `rough_m` is what averaging does not remove in a bin: sleepers and stones.
    """

    spacing_m: float
    width_m: float
    height_m: float
    noise_m: float = 0.045
    rough_m: float = 0.03
    height_spread: float = HEIGHT_SPREAD

    @property
    def stiffness(self) -> float:
        """Weight of the expected height: 1 / variance."""
        return (self.height_spread * self.height_m) ** -2

    @classmethod
    def expected(cls, spacing_m: float, footprint_m: float) -> RidgeShape:
        """Return what a footprint makes of rails, before the cloud has been looked at."""
        width_m = max(MIN_WIDTH_M, footprint_m / 4 + HEAD_M)
        return cls(spacing_m, width_m, AREA_M2 / (NORMAL_AREA * width_m))

    def ridge(self, u: np.ndarray, side: int) -> np.ndarray:
        """Return the left (1) or right (-1) ridge of height 1 at distances from the middle of the track."""
        return np.exp(-0.5 * ((u - side * self.spacing_m / 2) / self.width_m) ** 2)

    def edge(self, u: np.ndarray, side: int) -> np.ndarray:
        """Return a bed that falls by 1 per metre outside of a rail."""
        return -np.maximum(side * u - (self.spacing_m / 2 - EDGE_INSIDE_M), 0.0)


@dataclass(frozen=True)
class RidgeFit:
    """Fits of two ridges at many places, arrays of one shape.

    `gain` is the log-likelihood of two rails above that of a bed without them, in which the smaller rail counts twice,
    and `both` the same without a check of the single rails: smooth along the places. `flaw` is the loss of the bed
    beyond that of a flat one, `most` the gain of rails of the expected height, which no noise disturbs. `height` is
    that of the ridges, `level` that of the bed in the middle, and `tilt` its rise per metre to the left.
    """

    gain: np.ndarray
    both: np.ndarray
    flaw: np.ndarray
    most: np.ndarray
    height: np.ndarray
    level: np.ndarray
    tilt: np.ndarray


LEVEL, TILTED, BOWED, BOTH, LEFT, RIGHT, LEFT_EDGE, RIGHT_EDGE, BOWED_FREELY, BENT = range(10)
"""Columns of the models: the bed, two ridges, each of them alone, and what stands in for them."""

PLAIN = [(one, other) for one in range(BOTH + 1) for other in range(one, BOTH + 1)]
CHECKED = [
    *((bed, other) for bed in range(BOTH) for other in range(bed, BENT + 1)),
    *((column, column) for column in range(BOTH, BENT + 1)),
    *((LEFT, RIGHT_EDGE), (RIGHT, LEFT_EDGE), (LEFT_EDGE, RIGHT_EDGE)),
]
"""Pairs of columns whose products the models need, without and with the checks."""


def fit(count: np.ndarray, height: np.ndarray, u: np.ndarray, shape: RidgeShape, passes: int = 2) -> RidgeFit:
    """Fit bed and ridges to bins at distances `u`, (k,), from a place: number and mean height of the points, (..., k).

    Of the robust weightings, `passes`, the first is that of clean bins.
    """
    columns = _columns(u, shape).astype(height.dtype)
    variance = np.where(count > 0, shape.noise_m**2 / np.maximum(count, 1) + shape.rough_m**2, UNSEEN_VARIANCE)
    variance = variance.astype(height.dtype)
    weight = 1 / variance
    for _ in range(passes - 1):
        bed = _Normal(weight, height, columns, PLAIN).bed(shape)
        squares = (height - bed @ columns[: BOTH + 1]) ** 2 / variance
        weight = 1 / (variance * (1 + squares / OUTLIER**2) ** 2)
    normal = _Normal(weight, height, columns, CHECKED)
    bed = normal.bed(shape)
    squares = (height - bed @ columns[: BOTH + 1]) ** 2 / variance
    loss = (0.5 * squares / (1 + squares / OUTLIER**2) * (count > 0)).sum(axis=-1)
    flaw = np.maximum(loss - FLAT_LOSS * (count > 0).sum(axis=-1), 0.0)
    both, gain = normal.gains(shape)
    most = 0.5 * shape.height_m**2 * np.maximum(normal.product[BOTH, BOTH], 0.0)
    return RidgeFit(gain, both, flaw, most, bed[..., BOTH], bed[..., LEVEL] - 0.5 * bed[..., BOWED], bed[..., TILTED])


def _columns(u: np.ndarray, shape: RidgeShape) -> np.ndarray:
    """Return the columns of the models at distances from the middle, (10, k)."""
    left, right = shape.ridge(u, 1), shape.ridge(u, -1)
    bow = u * u - 0.5
    edges = shape.edge(u, 1), shape.edge(u, -1)
    return np.stack([np.ones_like(u), u, bow, left + right, left, right, *edges, bow, np.abs(u)])


class _Normal:
    """Normal equations of weighted bins, from which the bed has been eliminated.

    `product` holds the products of two columns by their numbers, after the elimination what the bed leaves of them;
    `data` those of each column and the heights.
    """

    def __init__(
        self, weight: np.ndarray, height: np.ndarray, columns: np.ndarray, pairs: list[tuple[int, int]]
    ) -> None:
        one, other = np.array(pairs).T
        self.product = dict(zip(pairs, np.moveaxis(weight @ (columns[one] * columns[other]).T, -1, 0)))
        last = max(one) + 1
        self.data = dict(enumerate(np.moveaxis((weight * height) @ columns[:last].T, -1, 0)))
        self._rest = [pair for pair in pairs if pair[0] >= BOTH]
        for number, stiff in enumerate((1e-6, 1 / TILT**2, 1 / BOW**2)):
            self._eliminate(number, stiff)

    def _eliminate(self, pivot: int, stiff: float) -> None:
        """Remove a column of the bed from those behind it."""
        product, data = self.product, self.data
        product[pivot, pivot] = product[pivot, pivot] + stiff
        share = {other: product[pivot, other] / product[pivot, pivot] for other in data if other > pivot}
        for other, part in share.items():
            data[other] = data[other] - part * data[pivot]
            for bed in range(pivot + 1, BOTH):
                if bed <= other:
                    product[bed, other] = product[bed, other] - share[bed] * product[pivot, other]
        for one, other in self._rest:
            product[one, other] = product[one, other] - share[one] * product[pivot, other]

    def bed(self, shape: RidgeShape) -> np.ndarray:
        """Return level, tilt and bow of the bed and the height of the ridges, (..., 4)."""
        stiff = shape.stiffness
        found = {BOTH: (self.data[BOTH] + stiff * shape.height_m) / (self.product[BOTH, BOTH] + stiff)}
        for number in (BOWED, TILTED, LEVEL):
            known = sum(self.product[number, other] * found[other] for other in range(number + 1, BOTH + 1))
            found[number] = (self.data[number] - known) / self.product[number, number]
        return np.stack([found[number] for number in range(BOTH + 1)], axis=-1)

    def gains(self, shape: RidgeShape) -> tuple[np.ndarray, np.ndarray]:
        """Return the gain of two rails, and that which remains after all checks."""
        stiff, height_m = shape.stiffness, shape.height_m
        none = 0.5 * stiff * height_m**2
        both = 0.5 * (self.data[BOTH] + stiff * height_m) ** 2 / (self.product[BOTH, BOTH] + stiff) - none
        single = np.maximum(
            self._pair((LEFT, RIGHT_EDGE), stiff, height_m) - none,
            self._pair((RIGHT, LEFT_EDGE), stiff, height_m) - none,
        )
        bank = np.maximum(self._pair((LEFT_EDGE, RIGHT_EDGE), BEND**-2, 0.0), self._bend(BOWED_FREELY))
        bank = np.maximum(bank, self._bend(BENT))
        return both, np.minimum(np.minimum(both, both - bank), 2 * (both - single))

    def _pair(self, pair: tuple[int, int], stiff: float, mean: float) -> np.ndarray:
        """Return the gain of two columns; the second is an edge, and the first has a prior of its own."""
        one, other = pair
        a, b = self.product[one, one] + stiff, self.product[pair]
        c, p, q = self.product[other, other] + BEND**-2, self.data[one] + stiff * mean, self.data[other]
        return 0.5 * (c * p * p - 2 * b * p * q + a * q * q) / (a * c - b * b)

    def _bend(self, column: int) -> np.ndarray:
        """Return the gain of one column that bends the bed."""
        return 0.5 * self.data[column] ** 2 / (self.product[column, column] + TRENCH**-2)


def binned(
    section: np.ndarray, across: np.ndarray, height: np.ndarray, sections: int, low_m: float, bins: int, bin_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return number and mean height of points, (n,) each, by section and bin across, (sections, bins) each."""
    column = np.floor((across - low_m) / bin_m).astype(np.int64)
    inside = (column >= 0) & (column < bins) & (section >= 0) & (section < sections)
    key = section[inside] * bins + column[inside]
    count = np.bincount(key, minlength=sections * bins)
    total = np.bincount(key, height[inside], minlength=sections * bins)
    mean = total / np.maximum(count, 1)
    return count.reshape(sections, bins).astype(np.float32), mean.reshape(sections, bins).astype(np.float32)


def windows(values: np.ndarray, width: int) -> np.ndarray:
    """Return the windows of some width along the last axis."""
    return np.lib.stride_tricks.sliding_window_view(values, width, axis=-1)


@dataclass(frozen=True)
class Sections:
    """What each section of `STATION_M` shows, (n,) arrays, and the fit there.

    `offset` is the middle of the track to the left of the axis and `sigma` its standard error, metres; `points` are
    those on the bed, and `shows` holds where there are two rails.
    """

    offset: np.ndarray
    sigma: np.ndarray
    found: RidgeFit
    points: np.ndarray
    shows: np.ndarray

    def stations_on(self, line: Polyline) -> np.ndarray:
        """Return the chainages of the middles of the sections, (n,), on the line along which they were seen."""
        return float(line.t[0]) + (np.arange(len(self.shows)) + 0.5) * STATION_M


def measure(corridor: Corridor, shape: RidgeShape, shows: np.ndarray | None) -> tuple[RidgeShape, float]:
    """Return the ridges that the profile of a whole line shows, and the distance of the rails if it is another one."""
    near = np.abs(corridor.across) < HALF_M
    if shows is not None and shows.any():
        near &= shows[np.clip(corridor.section_of(STATION_M), 0, len(shows) - 1)]
    bins = int(round(2 * HALF_M / PROFILE_BIN_M))
    across, height = corridor.across[near], corridor.height[near]
    count, mean = binned(np.zeros(len(across), dtype=np.int64), across, height, 1, -HALF_M, bins, PROFILE_BIN_M)
    u = (np.arange(bins) + 0.5) * PROFILE_BIN_M - HALF_M
    free = replace(shape, rough_m=PROFILE_ROUGH_M, height_spread=FREE)
    tried = [replace(free, width_m=float(width)) for width in WIDTHS_M]
    fits = [fit(count, mean, u, one) for one in tried]
    best = int(np.argmax([one.both[0] for one in fits]))
    height_m = float(np.clip(fits[best].height[0], LOWEST * shape.height_m, HIGHEST * shape.height_m))
    residual = height - mean[0][np.clip(np.floor((across + HALF_M) / PROFILE_BIN_M).astype(np.int64), 0, bins - 1)]
    noise_m = sigma_by_median(residual - np.median(residual)) if len(residual) else shape.noise_m
    found = RidgeShape(
        shape.spacing_m, tried[best].width_m, height_m, max(noise_m, 0.01), SECTION_ROUGH_M, SECTION_SPREAD
    )
    return found, _other_spacing(count, mean, u, tried[best])


def _other_spacing(count: np.ndarray, mean: np.ndarray, u: np.ndarray, shape: RidgeShape) -> float:
    """Return the distance of the rails that a profile shows where it is clearly not the expected one, else NaN."""
    gains = [
        float(fit(count, mean, u, replace(shape, spacing_m=shape.spacing_m + more)).both[0]) for more in SPACINGS_M
    ]
    best, expected = int(np.argmax(gains)), gains[len(gains) // 2]
    clearly = gains[best] - expected > OTHER_GAIN
    return float(shape.spacing_m + SPACINGS_M[best]) if clearly and abs(SPACINGS_M[best]) > OTHER_M else np.nan


def fit_sections(corridor: Corridor, shape: RidgeShape, reach_m: float, length_m: float = STATION_M) -> Sections:
    """Fit the middle of the track in every section."""
    half, aside = int(round(HALF_M / BIN_M)), int(round(reach_m / BIN_M))
    width, places = 2 * half + 1, 2 * aside + 1
    total = max(int(np.ceil(corridor.sections * STATION_M / 2 / length_m)), 1)
    bins, low_m = places + width - 1, -(aside + half + 0.5) * BIN_M
    count, height = binned(corridor.section_of(length_m), corridor.across, corridor.height, total, low_m, bins, BIN_M)
    u, place = (np.arange(width) - half) * BIN_M, (np.arange(places) - aside) * BIN_M
    found = fit(windows(count, width), windows(height, width), u, shape, passes=3)
    middle = np.clip(found.both.argmax(axis=1), PARABOLA, places - 1 - PARABOLA)
    rows, steps = np.arange(total), np.arange(-PARABOLA, PARABOLA + 1)
    bent, leant, _ = np.polyfit(steps * BIN_M, found.both[rows[:, None], middle[:, None] + steps].T, 2)
    sharp = np.maximum(-2 * bent, LITTLE_SHARP)
    offset = place[middle] + np.clip(leant / sharp, -PARABOLA * BIN_M, PARABOLA * BIN_M)
    at = np.clip(np.rint(offset / BIN_M).astype(np.int64) + aside, 0, places - 1)
    points = windows(count, width)[rows, at].sum(axis=1)
    here = RidgeFit(
        *(getattr(found, name)[rows, at] for name in ("gain", "both", "flaw", "most", "height", "level", "tilt"))
    )
    together = np.convolve(here.both, np.ones(3))[1:-1]
    shows = (together > ENOUGH_GAIN) & (here.both > 0) & (np.abs(offset) < reach_m - BIN_M)
    return Sections(offset, np.maximum(1 / np.sqrt(sharp), LEAST_SIGMA_M), here, points, shows)


LITTLE_SHARP = 1.0
"""Sharpness of a maximum, 1/m², that states nothing about the middle: a standard error of 1 m."""
