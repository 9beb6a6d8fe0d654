"""Rails in a street next to whose heads the road is classified as rail: the head is where the band is at gauge.

The road lies level with the head, so that their points form one band. With road on one side, the head is at one end of
it and has a single edge, at the groove for the flanges; with road on both sides, it is in the middle. See
docs/method.md section 6.9.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_opening

from ..clouds.points import RailPoints
from ..lines.smoothing import smooth_profile
from ..polyline import Polyline
from .head_points import HALF_HEAD_BINS, HALF_RANGE_BINS, STATION_STEP_M, HeadPoints, near_lines
from .own_level import on_own_level

BAND = (0.02, 0.98)
"""Shares of the points between which a band is measured."""

ROAD_SHARE = 0.25
"""Points per width beside a head, as a share of those on it, from which they are of a band: a road is seen as well as
the head, and beams that meet the edge of a head and what is behind it show a tenth of its points."""

MIN_WIDER_M = 0.02
"""How much wider than a head a band has to be: noise of 8 mm makes heads look 5 mm wider, two passes 15 mm."""

MIN_LENGTH_M, SMOOTHING_M = 8.0, 3.0
"""Length along which the points have to form such a band: heads that cross at 1:26.5 cover each other over 6 m; and
sigma of PAEK for the ends of the band."""

MAX_MISS_M, CLEARLY_M = 0.015, 0.01
"""Largest deviation of two heads from their distance, and by how much the other end of the band and its middle must be
further off."""

AT_EDGE_M = 0.012
"""Largest distance of the end of a band from the edge of the head: lines are within 1 cm of the axis."""

PLACE_M, BESIDE_M = 1.0, 0.2
"""Spacing of the places at which the distance of two rails is measured, and how much further than a track's other rail
it is: bands are as much wider than a head, and nearer places alone would look as if they were at gauge."""


def bands(points: HeadPoints, window: int = -1) -> tuple[np.ndarray, np.ndarray]:
    """Return the right and the left end of the band of points around a line, (s,) metres to the left.

    `window` is the number of the `HeadPoints.histograms`.
    """
    counts = points.histograms[window]
    head = counts[:, HALF_RANGE_BINS - HALF_HEAD_BINS : HALF_RANGE_BINS + HALF_HEAD_BINS]
    sums = np.cumsum(np.where(counts >= ROAD_SHARE * np.median(head, axis=1)[:, None], counts, 0.0), axis=1)
    whole = np.maximum(sums[:, -1:], 1e-9)
    first, last = (np.argmax(sums >= part * whole, axis=1) for part in BAND)
    cut = (last - first + 1) * BAND[0] / (BAND[1] - BAND[0])
    bin_m = points.width_m / (2 * HALF_HEAD_BINS)
    return (first - cut - HALF_RANGE_BINS) * bin_m, (last + 1 + cut - HALF_RANGE_BINS) * bin_m


def _wide_bands(points: HeadPoints) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the ends of bands, (s,) metres, and where they are wider than a head, (s,) bool, in windows of any length.

    Long windows look wide where a line leaves its head, as at a road crossing; short ones may have few points. Heads
    that touch are wide together for some metres.
    """
    right_m, left_m = bands(points)
    is_wide = [left - right > points.width_m + MIN_WIDER_M for right, left in ((right_m, left_m), bands(points, 0))]
    wide = points.free.all(axis=0) & np.all(is_wide, axis=0)
    return right_m, left_m, binary_opening(wide, np.ones(int(MIN_LENGTH_M / STATION_STEP_M)))


def hidden_edges(points: HeadPoints) -> np.ndarray:
    """Find the stations of a line on its head where road hides the right and the left edge, (2, s) bool."""
    right_m, left_m, wide = _wide_bands(points)
    half_m = 0.5 * points.width_m
    at_left, at_right = np.abs(left_m - half_m) <= AT_EDGE_M, np.abs(right_m + half_m) <= AT_EDGE_M
    return np.stack([wide & at_left & ~at_right, wide & at_right & ~at_left])


def onto_heads(
    lines: Sequence[np.ndarray], points: RailPoints, heads_m: np.ndarray, spacings_m: Sequence[float]
) -> tuple[np.ndarray, ...]:
    """Move lines in the middle of road and head onto the heads, where one end of the band is at gauge.

    Other lines, (n, 2), stay as they are. `heads_m` are the widths of their heads, and `spacings_m` the distances
    between the axes of the two rails of a track.
    """
    near = near_lines(lines, replace(points, strips=None), heads_m)
    found = [_band_of(on_own_level(head)) for head in near]
    candidates = [(line,) if band is None else band.lines for line, band in zip(lines, found)]
    return tuple(
        _at_gauge(line, band, candidates[:number] + candidates[number + 1 :], spacings_m)
        for number, (line, band) in enumerate(zip(lines, found))
    )


@dataclass(frozen=True)
class _Band:
    """A band of points that is wider than a head: the line in its middle and on either end, and places on each, (k, 2).

    The head is in the middle where there is road on both sides of it.
    """

    lines: tuple[np.ndarray, ...]
    places: tuple[np.ndarray, ...]


def _band_of(points: HeadPoints) -> _Band | None:
    """Return the band of a line; None where the points form none that is wider than a head."""
    right_m, left_m, wide = _wide_bands(points)
    if not wide.any():
        return None
    line, along, stations, half_m = points.line, points.along, points.stations, 0.5 * points.width_m
    shifts = np.where(wide, left_m - half_m, 0.0), np.where(wide, right_m + half_m, 0.0)
    left, right = (
        line + smooth_profile(stations, shift, SMOOTHING_M, along)[:, None] * Polyline(line).normals for shift in shifts
    )
    at = stations[wide & (stations <= along[-1])][:: int(PLACE_M / STATION_STEP_M)]
    lines = (line, left, right)
    return _Band(lines, tuple(Polyline(one, along).at(at) for one in lines))


def _at_gauge(
    line: np.ndarray, band: _Band | None, others: Sequence[Sequence[np.ndarray]], spacings_m: Sequence[float]
) -> np.ndarray:
    """Return a line on the end of its band that is at gauge from another line; as it is if neither end clearly is.

    Where both rails have road on both sides, their middles are at gauge as well as their ends.
    """
    if band is None:
        return line
    every = [one for lines in others for one in lines]
    misses_m = [_miss(places, every, spacings_m) for places in band.places]
    best, second = np.argsort(misses_m)[:2].tolist()
    if misses_m[best] > MAX_MISS_M or misses_m[second] - misses_m[best] < CLEARLY_M:
        return line
    return band.lines[best]


def _miss(places: np.ndarray, others: Sequence[np.ndarray], spacings_m: Sequence[float]) -> float:
    """Return by how much places on a rail, (k, 2), miss the distance of two rails, from the line that does least."""
    found = [np.inf]
    for other in others:
        away_m = np.abs(Polyline(other).feet(places, max(spacings_m) + BESIDE_M).across)
        if len(away_m):
            found.append(min(abs(float(np.median(away_m)) - spacing_m) for spacing_m in spacings_m))
    return min(found)
