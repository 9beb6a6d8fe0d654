"""The points along a line: everything about the head of the line is measured from them.

See docs/method.md sections 6.1 and 6.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Union

import numpy as np
from scipy.ndimage import gaussian_filter1d, uniform_filter1d
from scipy.spatial import cKDTree

from ..clouds.points import RailPoints
from ..polyline import Polyline, interpolate, project
from ..progress import SILENT, Progress
from .level import AXIS_SHARE, MIN_NOISE_M, OFF_TOP_SIGMAS, cross_slope, robust_sigma, rough_level

STATION_STEP_M = 0.25
"""Spacing of the stations along a line, the centres of the windows: a third of the smoothing's sigma."""

WINDOWS = (5, 9, 17, 33)
"""Lengths of the windows in stations, 1.25 to 8.25 m: the shortest one with enough points is used."""

ENOUGH_POINTS = 80
"""Points on top that a window should contain: they give the middle to 2 mm before smoothing."""

HALF_HEAD_BINS, HALF_RANGE_BINS = 18, 47
"""Bins across half a head, about 2 mm each, finer than the noise of any cloud; and on either side of a line, for a head
that is 15 bins off, and what is next to its edge."""

BLUR_BINS = 1.5
"""Sigma of the blur across the line: without it the best position would jump where there are fewer points than bins.
The edges stay sharp to 3 mm."""

BESIDE_HEADS = 1.5
"""Distance of two axes, in head widths, from which the ground between the heads is wide enough to show their edges."""

BESIDE_BLUNT_HEADS = 3.0
"""The same where heads are blunt: ridges of two heads that are blurred by 6 cm are one up to 0.2 m, higher than either
alone."""

CROSSED_M = 0.01
"""Offset on both sides of a line from which another line crosses it; less may be the error of the lines."""

MIN_RUN = 0.5
"""Cosine of the crossing angle below which each line hides the other for less than one window."""

MIN_ON_HEAD = 80
"""Points needed on a head to find its top; fewer do not determine a slope."""

MAX_DEPTH_M, MAX_DEPTH_SIGMAS = 0.006, 1.5
"""Depth below the top, in metres and in standard deviations of the noise, beyond which a point may be on a side face or
a corner. Tighter than the noise requires: points on top are lost evenly across the head, so the estimate stays
unbiased."""

MAX_ABOVE_SIGMAS = 3.0
"""Height above the top, in standard deviations of the noise, beyond which a point is a weed."""

SECTION_M = WINDOWS[-1] * STATION_STEP_M
"""Length of the sections of a line in which it is measured how far heads fall to both sides, that of the longest
window: over it, the distance of a line from its head hardly changes, and tripods see the faces on one side only.
Sections are longer where they would have fewer than `MIN_ON_HEAD` points on the head."""

MIN_ON_SECTION = 5
"""Least points on the crown and on either rim of a section: with noise of 15 mm, medians of so few are 8 mm off, and
the median of ten sections is 3 mm off."""

BLENDED_FALL_M = 0.0045
"""Fall of rims or shoulders of a head below its crown from which beams or images blend the head and the ballast. In 44
random clouds, narrow beams see them fall by 1 to 3.7 mm (median of the sections), because corners are round and tripods
see faces; blended by images and by beams more than 0.3 times as wide as the head, they fall by 5.5 to 40 mm."""

CROWN_HEADS, RIM_HEADS, SHOULDER_HEADS = 0.2, (0.3, 0.45), (0.55, 0.75)
"""Parts of the head width on either side of the axis: the crown, the rims short of the faces, and what is beyond a
head that is not blurred."""

CREST_SHARE = 0.2
"""Points within `CROWN_HEADS` of a place, as a share of those at the fullest one, from which it may be the crest; and
points per width on either shoulder, by those on the crown, from which a blurred head goes on there."""

ASIDE_HEADS, ASIDE_PLACES = 0.6, 25
"""Distance from a line, in head widths, within which the crest of a section is looked for, 4 cm by which surveys may be
registered apart; and places at which it is, 4 mm from each other."""

NO_EDGES = np.ones((2, 0), dtype=bool)
"""Edges of a line before it is known how far other heads disturb them."""

Widths = Union[float, np.ndarray]
"""Width of the heads of all lines, or of each line, (n,) metres."""


def widest(head_width_m: Widths) -> float:
    """Return the width of the widest head."""
    return float(np.max(head_width_m, initial=0.0))


def stations_along(length_m: float) -> np.ndarray:
    """Return the chainages of the stations along a line, (s,) metres."""
    return (np.arange(int(length_m / STATION_STEP_M) + 1) + 0.5) * STATION_STEP_M


@dataclass(frozen=True)
class HeadPoints:
    """A line, and the points near it in order along the line.

    Attributes
    ----------
    t, across, z : (n,) arrays
        Chainage (increasing), offset to the left of the line and height, metres.
    width_m : float
        Width of the head.
    line : (k, 2) array
    free : (2, s) bool array
        Where the right and the left edge of the head are free of other heads; see `free_edges`.
    strips, apart, scanned : arrays or None, bool
        See `RailPoints`.
    is_blunt : bool
        Whether the cloud blunts heads: all or none, for one line alone, a centimetre off its head, may look otherwise.
    """

    t: np.ndarray
    across: np.ndarray
    z: np.ndarray
    width_m: float
    line: np.ndarray
    free: np.ndarray
    strips: np.ndarray | None = None
    is_blunt: bool = False
    apart: np.ndarray | None = None
    scanned: bool = False

    def __getitem__(self, which: np.ndarray) -> HeadPoints:
        strips = None if self.strips is None else self.strips[which]
        return replace(self, t=self.t[which], across=self.across[which], z=self.z[which], strips=strips)

    @cached_property
    def along(self) -> np.ndarray:
        """Chainage of the vertices of the line, (k,)."""
        return Polyline(self.line).t

    @property
    def length_m(self) -> float:
        """Length of the line."""
        return float(self.along[-1])

    @cached_property
    def stations(self) -> np.ndarray:
        """Chainage of the stations, (s,)."""
        return stations_along(self.length_m)

    @cached_property
    def station(self) -> np.ndarray:
        """Number of the station next to each point, (n,)."""
        return np.minimum((self.t / STATION_STEP_M).astype(int), len(self.stations) - 1)

    def per_station(self, values: np.ndarray | None = None) -> np.ndarray:
        """Count the points next to each station, or sum up values of theirs, (n,): (s,)."""
        return np.bincount(self.station, values, len(self.stations))

    @property
    def alone(self) -> np.ndarray:
        """Which points are where no other head disturbs either edge, (n,) bool."""
        return (self.free[0] & self.free[1])[self.station]

    def within(self, share: float) -> np.ndarray:
        """Return which points are this close to the line, in head widths, (n,) bool."""
        return np.abs(self.across) <= share * self.width_m

    @cached_property
    def top(self) -> tuple[np.ndarray, float]:
        """Points on the top of the head, (n,) bool, allowing for its slope across, and the noise of their heights."""
        head = self.within(0.5)
        if head.sum() < MIN_ON_HEAD:
            return np.zeros(len(self.t), dtype=bool), MIN_NOISE_M
        _, flat = self._flat(head)
        noise = robust_sigma(flat[head & (np.abs(flat) < 2 * MAX_DEPTH_M)])
        noise = robust_sigma(flat[head & (np.abs(flat) < max(2 * MAX_DEPTH_M, OFF_TOP_SIGMAS * noise))])
        lowest, highest = -max(MAX_DEPTH_M, MAX_DEPTH_SIGMAS * noise), max(MAX_DEPTH_M, MAX_ABOVE_SIGMAS * noise)
        return (flat >= lowest) & (flat <= highest), noise

    @cached_property
    def histograms(self) -> tuple[np.ndarray, np.ndarray]:
        """Counts of the points on top by their offset from the line, (s, 2 HALF_RANGE_BINS), in windows along it.

        The first are those in the shortest window with enough points, the second in the longest window. The first half
        of the bins is to the right of the line.
        """
        top, bins = self[self.top[0]], 2 * HALF_RANGE_BINS
        column = np.floor(top.across * (2 * HALF_HEAD_BINS / self.width_m)).astype(int) + HALF_RANGE_BINS
        inside = (column >= 0) & (column < bins)
        counts = np.bincount(top.station[inside] * bins + column[inside], minlength=len(self.stations) * bins)
        counts = counts.reshape(-1, bins).astype(np.float32)
        counts = gaussian_filter1d(counts, BLUR_BINS, axis=1, mode="constant")
        windows = [uniform_filter1d(counts, size, axis=0, mode="constant") * size for size in WINDOWS]
        chosen = windows[-1].copy()
        for window in windows[-2::-1]:
            enough = window.sum(axis=1) >= ENOUGH_POINTS
            chosen[enough] = window[enough]
        return chosen, windows[-1]

    def in_frame(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the points in the frame of their head: offset to the left and height, (n,), from the top on the line.

        The third array is the height of this top, (n,). All are NaN if the crown has too few points.
        """
        crown = self.within(AXIS_SHARE)
        if crown.sum() < MIN_ON_HEAD:
            nothing = np.full(len(self.t), np.nan)
            return nothing, nothing, nothing
        slope, flat = self._flat(crown)
        return self.across + slope * flat, flat, self.z - slope * self.across - flat

    def _flat(self, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the slope across and the height without it, (n,) each, above the points that show the `level`."""
        t, head = self.t, self.within(0.5)
        above = self.z - np.interp(t, t[level], rough_level(t[level], self.z[level]))
        slope = np.interp(t, t[head], cross_slope(t[head], self.across[head], above[head], self.width_m))
        flat = above - slope * self.across
        return slope, flat - np.interp(t, t[level], rough_level(t[level], flat[level]))


def near_lines(
    lines: Sequence[np.ndarray], points: RailPoints, widths: Widths, progress: Progress = SILENT
) -> list[HeadPoints]:
    """Find the points of each line, (k, 2); `widths`, metres, are those of all heads or of each.

    If it is not known whether the cloud blunts heads, these lines show it.
    """
    feet = project(lines, points.xyz[:, :2], HALF_RANGE_BINS / (2 * HALF_HEAD_BINS) * widest(widths), progress)
    z, own = points.xyz[feet.point, 2], None if points.strips is None else points.strips[feet.point]
    heads = []
    for number, width_m in enumerate(np.broadcast_to(widths, len(lines)).tolist()):
        mine = slice(*np.searchsorted(feet.line, [number, number + 1]))
        strip = None if own is None else own[mine]
        places = feet.t[mine], feet.across[mine], z[mine], width_m, lines[number]
        heads.append(HeadPoints(*places, NO_EDGES, strip, apart=points.apart, scanned=points.scanned))
    is_blunt = _are_blunt(heads) if points.blunt is None else points.blunt
    free = free_edges(lines, widest(widths), BESIDE_BLUNT_HEADS if is_blunt else BESIDE_HEADS)
    return [replace(head, is_blunt=is_blunt, free=own) for head, own in zip(heads, free)]


def judged(points: RailPoints, lines: Sequence[np.ndarray], widths: Widths) -> RailPoints:
    """Return points that know whether their cloud blunts heads, by lines, (k, 2) each, if it is not known yet."""
    if points.blunt is not None or not lines:
        return points
    return replace(points, blunt=near_lines(lines, points, widths)[0].is_blunt)


def _about_crest(points: HeadPoints) -> HeadPoints:
    """Return points about the place across at which they are highest.

    The line may be aside of the head. A sharp head is level: seen from any place on it, heights do not fall to both
    sides.
    """
    if not len(points.t):
        return points
    up, half_m = points.z - rough_level(points.t, points.z), CROWN_HEADS * points.width_m
    order = np.argsort(points.across)
    across, sums = points.across[order], np.append(0.0, np.cumsum(up[order]))
    places = np.linspace(-ASIDE_HEADS, ASIDE_HEADS, ASIDE_PLACES) * points.width_m
    first, last = (np.searchsorted(across, places + step) for step in (-half_m, half_m))
    count = last - first
    mean = np.where(count >= CREST_SHARE * count.max(), (sums[last] - sums[first]) / np.maximum(count, 1), -np.inf)
    return replace(points, across=points.across - places[np.argmax(mean)])


def lengths_by_kind(heads: Sequence[HeadPoints]) -> np.ndarray:
    """Return the lengths of lines that show sharp heads and blunt ones, (2,) metres."""
    shown_m = np.zeros(2)
    for points in heads:
        falls_m = _falls(points)
        if len(falls_m):
            shown_m[int(np.median(falls_m) > BLENDED_FALL_M)] += np.ptp(points.t)
    return shown_m


def _are_blunt(heads: Sequence[HeadPoints]) -> bool:
    """Return whether most sections of all lines show blunt heads."""
    falls_m = np.concatenate([np.empty(0), *(_falls(points) for points in heads)])
    return bool(len(falls_m) and np.median(falls_m) > BLENDED_FALL_M)


def _falls(points: HeadPoints) -> np.ndarray:
    """Return by how much a head falls to both sides in each section that has enough points, (k,) metres.

    Each strip shows a head of its own. Two of a sharp head that are 30 mm apart, one higher, look like a blunt one.
    """
    if points.strips is not None:
        own = (points[points.strips == strip] for strip in np.unique(points.strips))
        return np.concatenate([np.empty(0), *(_falls(replace(strip, strips=None)) for strip in own)])
    enough = int(points.within(0.5).sum() / MIN_ON_HEAD)
    count = max(min(int(points.length_m / SECTION_M), enough), 1)
    section = np.minimum((points.t / points.length_m * count).astype(int), count - 1)
    falls_m = (_fall(_about_crest(points[section == number])) for number in range(count))
    return np.array([fall_m for fall_m in falls_m if np.isfinite(fall_m)])


def _fall(about: HeadPoints) -> float:
    """Return by how much the rims or, if more, the shoulders of a head are below its crown, metres; NaN if unknown.

    Of both sides, the higher one counts: sharp heads fall to one side, if their faces or the line aside of them do.
    """
    if len(about.t) < MIN_ON_SECTION:
        return np.nan
    heads, up = about.across / about.width_m, about.z - rough_level(about.t, about.z)
    crown = up[np.abs(heads) < CROWN_HEADS]
    falls_m = []
    for (low, high), share in ((RIM_HEADS, 0.0), (SHOULDER_HEADS, CREST_SHARE)):
        sides = [up[(side * heads > low) & (side * heads <= high)] for side in (1, -1)]
        least = max(share * (high - low) / (2 * CROWN_HEADS) * len(crown), MIN_ON_SECTION)
        enough = min(len(crown), *map(len, sides)) >= least
        falls_m.append(float(np.median(crown) - max(map(np.median, sides))) if enough else np.nan)
    return falls_m[0] if np.isnan(falls_m).any() else max(falls_m)


def free_edges(
    lines: Sequence[np.ndarray], head_width_m: float, beside_heads: float = BESIDE_HEADS
) -> list[np.ndarray]:
    """Return where the right and the left edge of each head are free of other heads, (2, s) at the line's stations.

    Axes that are `beside_heads` apart, in head widths, do not disturb each other.

    Where a branch leaves its stock rail the heads overlap, and only the outer edge of each is free.
    """
    free = [np.ones((2, len(stations_along(Polyline(line).length_m))), dtype=bool) for line in lines]
    for line, station, across in _close_runs(lines, beside_heads * head_width_m):
        crossing = across.min() < -CROSSED_M and across.max() > CROSSED_M
        side = across if crossing else np.full(len(across), across.sum())
        overlap = crossing & (np.abs(across) < 0.5 * head_width_m)
        free[line][0, station[(side < 0) | overlap]] = False
        free[line][1, station[(side >= 0) | overlap]] = False
    return free


def _close_runs(lines: Sequence[np.ndarray], reach_m: float) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """List where another line is close: line, its stations, and the offsets of the other line to the left, (k,)."""
    number, station, places, normals = _stations(lines)
    if not len(number):
        return []
    pairs = cKDTree(places).query_pairs(np.hypot(reach_m, 0.5 * STATION_STEP_M), output_type="ndarray")
    pairs = pairs[number[pairs[:, 0]] != number[pairs[:, 1]]]
    own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    across = _offset(places[other] - places[own], normals[own], normals[other])
    close = np.abs(across) <= reach_m
    own, other, across = own[close], number[other[close]], across[close]
    order = np.lexsort((own, other, number[own]))
    own, other, across = own[order], other[order], across[order]
    breaks = np.flatnonzero((np.diff(other) != 0) | (np.diff(own) > 1) | (np.diff(number[own]) != 0)) + 1
    runs = np.split(np.arange(len(own)), breaks) if len(own) else []
    return [(int(number[own[run[0]]]), station[own[run]], across[run]) for run in runs]


def _offset(step: np.ndarray, normal: np.ndarray, other_normal: np.ndarray) -> np.ndarray:
    """Return the offsets to the left of straight lines, (k,), given the `step` to a place on each and the normals."""
    tangent, other_tangent = (values @ np.array([[0.0, -1.0], [1.0, 0.0]]) for values in (normal, other_normal))
    ahead, across = (np.einsum("ij,ij->i", step, axis) for axis in (tangent, normal))
    run, rise = (np.einsum("ij,ij->i", other_tangent, axis) for axis in (tangent, normal))
    return across - ahead * rise / np.where(np.abs(run) > MIN_RUN, run, np.inf)


def _stations(lines: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return line and station numbers, (k,), places and unit vectors to the left, (k, 2), of all stations."""
    columns = [(np.empty(0, int), np.empty(0, int), np.empty((0, 2)), np.empty((0, 2)))]
    for number, line in enumerate(lines):
        own = Polyline(line)
        at = np.minimum(stations_along(own.length_m), own.length_m)
        columns.append((np.full(len(at), number), np.arange(len(at)), own.at(at), interpolate(own.normals, own.t, at)))
    numbers, stations, places, normals = (np.concatenate(column) for column in zip(*columns))
    return numbers, stations, places, normals
