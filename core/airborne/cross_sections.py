"""Sections of a line: the ridges that its whole profile shows, and the middle of the track in every section."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..polyline import Polyline
from .guide_line import Corridor
from .ridges import HALF_M, Fit, Shape, binned, fit, windows

STATION_M = 10.0
"""Length of a section of the fit, and the distance of stations."""

BIN_M, PROFILE_BIN_M = 0.025, 0.02
"""Width of the bins across in the fit of a section, and in the profile of a whole line."""

WIDTHS_M = np.arange(0.04, 0.24, 0.01)
SPACINGS_M = np.arange(-0.12, 0.121, 0.02)
"""Widths of a ridge that are tried, and deviations of the rails' distance, up to those between neighbouring gauges."""

OTHER_GAIN, OTHER_SHARE, OTHER_M = 40.0, 0.1, 0.045
"""Log-likelihood of another distance of the rails above that of the expected one, also as a share of its own, and the
deviation, from which it is said: ballast piled at the rails shifts the ridges by up to 20 mm."""

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

EDGE_M = 0.01
"""A middle this close to the end of the search lies beyond it."""


@dataclass(frozen=True)
class Sections:
    """What each section of `STATION_M` shows, (n,) arrays, and the fit there.

    `offset` is the middle of the track to the left of the axis and `sigma` its standard error, metres; `points` are
    those on the bed, and `shows` holds where there are two rails.
    """

    offset: np.ndarray
    sigma: np.ndarray
    found: Fit
    points: np.ndarray
    shows: np.ndarray

    def stations_on(self, line: Polyline) -> np.ndarray:
        """Return the chainages of the middles of the sections, (n,), on the line along which they were seen."""
        return float(line.t[0]) + (np.arange(len(self.shows)) + 0.5) * STATION_M


def measure(corridor: Corridor, shape: Shape, shows: np.ndarray | None) -> tuple[Shape, float]:
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
    noise_m = 1.4826 * float(np.median(np.abs(residual - np.median(residual)))) if len(residual) else shape.noise_m
    found = Shape(shape.spacing_m, tried[best].width_m, height_m, max(noise_m, 0.01), SECTION_ROUGH_M, SECTION_SPREAD)
    return found, _other_spacing(count, mean, u, tried[best])


def _other_spacing(count: np.ndarray, mean: np.ndarray, u: np.ndarray, shape: Shape) -> float:
    """Return the distance of the rails that a profile shows where it is clearly not the expected one, else NaN."""
    gains = [
        float(fit(count, mean, u, replace(shape, spacing_m=shape.spacing_m + more)).both[0]) for more in SPACINGS_M
    ]
    best, expected = int(np.argmax(gains)), gains[len(gains) // 2]
    clearly = gains[best] - expected > max(OTHER_GAIN, OTHER_SHARE * gains[best])
    return float(shape.spacing_m + SPACINGS_M[best]) if clearly and abs(SPACINGS_M[best]) > OTHER_M else np.nan


def fit_sections(corridor: Corridor, shape: Shape, reach_m: float, length_m: float = STATION_M) -> Sections:
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
    here = Fit(
        *(getattr(found, name)[rows, at] for name in ("gain", "both", "flaw", "most", "height", "level", "tilt"))
    )
    together = np.convolve(here.both, np.ones(3))[1:-1]
    shows = (together > ENOUGH_GAIN) & (here.both > 0) & (np.abs(offset) < reach_m - EDGE_M)
    return Sections(offset, np.maximum(1 / np.sqrt(sharp), LEAST_SIGMA_M), here, points, shows)


LITTLE_SHARP = 1.0
"""Sharpness of a maximum, 1/m², that states nothing about the middle: a standard error of 1 m."""
