"""From a seed to the rail under it: its direction, its height, and on which side the other rail of the track is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..classify.bed import Bed
from ..classify.lines import REACH_M, reach_at
from ..classify.settings import Settings
from ..classify.square import THIN_PER_M2, classify_square
from ..classify.tops import TOP_M
from .course import Ahead
from .on_heads import OnHeads, cut
from .points import Points
from .profile import GROOVE_M, HIGH_M, MIN_CONTRAST, Head
from .settings import BLUNT, DENSE, THIN, Beam, GrowSettings

ANGLES = 90
"""Directions that are tried, over half a turn: at 1 m, a head is 17 mm off at most."""

PATCH_M, PATCH_POINTS = (6.0, 20.0), 500_000
"""Reach of the points around a seed that are classified, within limits, and their number: rails without a partner are
known from 5 m on, and the blur of a cloud from tens of metres of ridges."""

SQUARES_PER_M2 = 500.0
"""Points per square metre below which the squares around a seed are classified instead, a million points each: where
the rail is followed on what the classification finds, they are needed anyway."""

BIN_M, LEVEL_BIN_M = 0.006, 0.010
"""Bins across and in height."""

CLICK_M = 0.15
"""Accuracy of a click: of two rails, the nearer one is meant."""

SLICES, MIN_COVER = 10, 0.6
"""Parts of the line of a rail, and the least share of them that must hold points."""

MIN_WINDOWS = 3
"""Windows of five along the line that must show the head."""

BEST = 8
"""Directions and heights that are looked at more closely."""

CANT_M = 0.20
"""Largest difference in height between the rails of a track: cant of 180 mm, and a deviation from it."""

LEAST_COUNT = 0.4
"""Of the heads that may be the other rail, the highest is taken that has this share of the points of the best seen: the
foot of a rail looks like a lower one."""

GAUGE_OFF_M = (-0.02, 0.045)
"""Smallest and largest deviation from the gauge: gauge widening of 35 mm, wear, and the accuracy of a window."""

TARGET_POINTS, LONGEST_WINDOW_M = 12, 2.0
"""Points of a head that a window should have, and the longest window: a thin cloud needs more length."""


@dataclass(frozen=True)
class Start:
    """A rail found at a seed.

    Attributes
    ----------
    xyz : (k, 3) array
        Places on its axis, in order.
    heading : (2,) array
        Unit vector along it.
    beam : Beam
    per_m : float
        Points on the head per metre.
    flush : bool
        Whether the head is in a pavement.
    side : int
        1 if the other rail of the track is to the left, -1 to the right, 0 if none was found.
    level_m : float
        Height of the other rail above this one.
    free : float
        Share of the windows in which both sides of the head are free.
    points : Points
        Where its heads are looked for.
    """

    xyz: np.ndarray
    heading: np.ndarray
    beam: Beam
    per_m: float
    flush: bool
    side: int
    level_m: float
    free: float
    points: Points


def window_m(per_m: float, settings: GrowSettings) -> float:
    """Return the length of a window on a rail with this number of points per metre."""
    return float(np.clip(TARGET_POINTS / max(per_m, 1e-9), settings.parameters.window_m, LONGEST_WINDOW_M))


def find_start(points: Points, seed: np.ndarray, settings: GrowSettings, heads: OnHeads | None = None) -> Start | None:
    """Find the rail at a seed, (2,); None if there is none within the search distance.

    The points that the classification takes for rails are looked at first, then all. In thin clouds, windows show less
    than the classification of whole squares, and in clouds that blur heads nothing: these rails are followed on it.
    """
    near = _near(points, seed, settings)
    if not len(near):
        return None
    per_m2 = _density(near, seed)
    patch_m = float(np.clip(np.sqrt(PATCH_POINTS / per_m2) / 2, *PATCH_M))
    beam = THIN if per_m2 < THIN_PER_M2 else DENSE
    reach_m = reach_at(per_m2)
    heads = heads or OnHeads(points, settings)
    if per_m2 < SQUARES_PER_M2:
        rail, is_blunt = _near(heads, seed, settings), heads.are_blunt(seed, REACH_M[1])
    else:
        rail, is_blunt = _classified(points.around(seed, patch_m), seed, settings)
    if is_blunt or beam is THIN:
        near_heads = _near(heads, seed, settings)
        found = (BLUNT if is_blunt else THIN).on_heads()
        start = _found(heads, near_heads, near_heads, seed, reach_m, found, settings)
        if start is not None or is_blunt:
            return start
    sure = _found(points, near, rail, seed, reach_m, beam, settings)
    if sure is not None:
        return sure
    standing = _standing(points.around(seed, patch_m), settings)
    start = _found(points, near, standing, seed, reach_m, beam, settings)
    return start if start is not None and start.free >= MIN_COVER else None


def _near(points: Points, seed: np.ndarray, settings: GrowSettings) -> np.ndarray:
    """Return the points, (k, 3), that can be on the line through a seed."""
    reach_m = REACH_M[1] + settings.parameters.search_m
    near = points.around(seed, reach_m)
    return near[np.hypot(*(near[:, :2] - seed).T) <= reach_m]


def _classified(patch: np.ndarray, seed: np.ndarray, settings: GrowSettings) -> tuple[np.ndarray, bool]:
    """Return the points of a patch, (k, 3), that the classification finds on rails, and whether heads are blunt."""
    own = Settings((settings.gauge_m,), settings.head_width_m)
    corner = np.append(seed - own.side_m / 2, 0.0)
    found = classify_square(patch - corner, own)
    return patch[found.rail], found.figures.blunt_m > 0


def _standing(patch: np.ndarray, settings: GrowSettings) -> np.ndarray:
    """Return the points, (k, 3), that stand above the bed as rails do."""
    _, height, _ = Bed.under(patch)
    return patch[(height >= settings.parameters.min_height_m) & (height <= TOP_M)]


def _found(
    points: Points,
    near: np.ndarray,
    searched: np.ndarray,
    seed: np.ndarray,
    reach_m: float,
    beam: Beam,
    settings: GrowSettings,
) -> Start | None:
    """Find the rail at a seed among the points that are searched; None if there is none."""
    found = sorted(
        (_best(searched, seed, angle, reach_m, beam, settings) for angle in np.arange(ANGLES) * np.pi / ANGLES),
        key=lambda one: -one[0],
    )
    for score, ahead in found[:BEST]:
        start = _start(points, near, ahead, reach_m, beam, settings) if score > 0 else None
        if start is not None:
            return start
    return None


def _density(near: np.ndarray, seed: np.ndarray) -> float:
    """Return the points per square metre around a seed."""
    inside = np.hypot(*(near[:, :2] - seed).T) <= REACH_M[0]
    return max(float(np.count_nonzero(inside)), 1.0) / (np.pi * REACH_M[0] ** 2)


def _best(
    near: np.ndarray, seed: np.ndarray, angle: float, reach_m: float, beam: Beam, settings: GrowSettings
) -> tuple[float, Ahead]:
    """Return the score of the best head in a direction, and where it is."""
    ahead = Ahead(seed, 0.0, np.array([np.cos(angle), np.sin(angle)]), 0.0, 0.0)
    along, across, z = ahead.coordinates(near)
    search_m, half_m = settings.parameters.search_m, settings.head_width_m / 2
    own = (np.abs(along) <= reach_m) & (np.abs(across) <= search_m + GROOVE_M + half_m)
    nothing = 0.0, ahead
    if not own.any():
        return nothing
    along, across, z = along[own], across[own], z[own]
    score, u, top = _peak(across, z, beam, settings)
    band_m = settings.parameters.tolerance_z_m + beam.level_m
    head = (np.abs(across - u) <= half_m) & (np.abs(z - top) <= band_m)
    cover = len(np.unique((along[head] + reach_m) // (2 * reach_m / SLICES))) / SLICES
    if cover < MIN_COVER:
        return nothing
    return score * cover, Ahead(seed + u * ahead.left, top, ahead.heading, 0.0, 0.0)


def _peak(across: np.ndarray, z: np.ndarray, beam: Beam, settings: GrowSettings) -> tuple[float, float, float]:
    """Return score, place and height of the best head among points."""
    search_m, half_m = settings.parameters.search_m, settings.head_width_m / 2
    low_m = -(search_m + GROOVE_M + half_m)
    columns = int(np.ceil(-2 * low_m / BIN_M)) + 1
    base = z.min()
    rows = int((z.max() - base) / LEVEL_BIN_M) + 1
    cell = ((across - low_m) / BIN_M).astype(np.int64) * rows + ((z - base) / LEVEL_BIN_M).astype(np.int64)
    image = np.bincount(cell, minlength=columns * rows).reshape(columns, rows)
    sums = np.zeros((columns + 1, rows + 1))
    sums[1:, 1:] = image.cumsum(axis=0).cumsum(axis=1)
    level = np.arange(rows)

    def band(first: float, last: float) -> np.ndarray:
        """Sum each column, and all before, over heights relative to each level."""
        start = np.clip(level + round(first / LEVEL_BIN_M), 0, rows)
        end = np.clip(level + round(last / LEVEL_BIN_M) + 1, 0, rows)
        return sums[:, end] - sums[:, start]

    u = np.arange(-search_m, search_m + BIN_M, BIN_M)

    def between(values: np.ndarray, low: float, high: float) -> np.ndarray:
        first, last = (np.clip(np.round((u + edge - low_m) / BIN_M).astype(int), 0, columns) for edge in (low, high))
        return values[last] - values[first]

    band_m = settings.parameters.tolerance_z_m + beam.level_m
    flat, high = band(-band_m, band_m), band(*HIGH_M)
    inside = between(flat, -half_m, half_m)
    inner, outer = half_m + beam.blur_m, half_m + beam.blur_m + beam.fringe_m
    sides = np.stack([between(flat, -outer, -inner), between(flat, inner, outer)]) * (2 * half_m / beam.fringe_m)
    # Where a pavement reaches the head, one side is free; this counts half, so that free heads come first.
    contrast = np.maximum(inside - sides.mean(axis=0), (inside - sides.min(axis=0)) / 2)
    contrast = np.where(contrast >= MIN_CONTRAST / 2 * inside, contrast, 0.0) - between(high, -half_m, half_m)
    score = contrast * np.exp(-((u / CLICK_M) ** 2))[:, None]
    place, row = np.unravel_index(int(np.argmax(score)), score.shape)
    return float(score[place, row]), float(u[place]), float(base + (row + 0.5) * LEVEL_BIN_M)


def _start(
    points: Points, near: np.ndarray, ahead: Ahead, reach_m: float, beam: Beam, settings: GrowSettings
) -> Start | None:
    """Look closely at a place where a head seems to be; None if there is no rail."""
    for _ in range(2):
        stations, heads = _windows(near, ahead, reach_m, beam, settings)
        if len(heads) < MIN_WINDOWS:
            return None
        ahead = _aligned(ahead, stations, heads)
    stations, heads = _windows(near, ahead, reach_m, beam, settings)
    if len(heads) < MIN_WINDOWS:
        return None
    across = np.array([head.across_m for head in heads])
    z = ahead.z + ahead.grade * stations + np.array([head.top_m for head in heads])
    xy = ahead.xy + stations[:, None] * ahead.heading + across[:, None] * ahead.left
    flush = float(np.mean([head.flush for head in heads])) > 0.5
    side, level_m = _other_rail(points, ahead, reach_m, beam, settings)
    free = float(np.mean([head.is_free for head in heads]))
    known = [np.isfinite(head.bed_m) for head in heads]
    if np.mean(known) < MIN_COVER or (not side and free < MIN_COVER):
        return None
    along, offset, above = ahead.coordinates(near)
    band_m = settings.parameters.tolerance_z_m + beam.level_m
    on = (np.abs(along) <= reach_m) & (np.abs(offset) <= settings.head_width_m / 2) & (np.abs(above) <= band_m)
    per_m = float(np.count_nonzero(on)) / (2 * reach_m)
    return Start(np.column_stack([xy, z]), ahead.heading, beam, per_m, flush, side, level_m, free, points)


def _windows(
    near: np.ndarray, ahead: Ahead, reach_m: float, beam: Beam, settings: GrowSettings
) -> tuple[np.ndarray, list[Head]]:
    """Measure the head in five windows along a line; returns the places along and the heads of those that show it."""
    along, across, height = ahead.coordinates(near)
    stations, heads = [], []
    per_m = len(near) / (np.pi * (REACH_M[1] + settings.parameters.search_m) ** 2) * settings.head_width_m
    half_m = max(window_m(per_m, settings), 0.4 * reach_m) / 2
    for place_m in np.linspace(-0.8, 0.8, 5) * reach_m:
        own = np.abs(along - place_m) <= half_m
        section = cut(across[own], height[own], settings, beam)
        found = section.heads(settings.head_width_m / 2)
        if found:
            stations.append(place_m)
            heads.append(min(found, key=lambda head: (not head.is_free, abs(head.across_m))))
    return np.array(stations), heads


def _aligned(ahead: Ahead, stations: np.ndarray, heads: list[Head]) -> Ahead:
    """Lay a line through heads."""
    slope, offset = np.polyfit(stations, [head.across_m for head in heads], 1)
    grade, top = np.polyfit(stations, [head.top_m for head in heads], 1)
    heading = ahead.heading + slope * ahead.left
    xy = ahead.xy + offset * ahead.left
    return Ahead(xy, ahead.z + top, heading / np.hypot(*heading), 0.0, ahead.grade + grade)


def _other_rail(points: Points, ahead: Ahead, reach_m: float, beam: Beam, settings: GrowSettings) -> tuple[int, float]:
    """Find the other rail of the track; returns its side and how much higher it is, 0 and 0 without any."""
    found = []
    for side in (1, -1):
        beside = ahead.beside(side * settings.spacing_m, 0.0)
        near = points.around(beside.xy, reach_m + CANT_M)
        along, across, height = beside.coordinates(near)
        own = (np.abs(along) <= reach_m) & (np.abs(height) <= 4 * CANT_M)
        section = cut(across[own], height[own], settings, beam)
        step_m = settings.parameters.tolerance_z_m + beam.level_m
        for top_m in np.arange(-CANT_M, CANT_M + step_m, step_m):
            for head in section.heads(GAUGE_OFF_M[1], float(top_m)):
                if GAUGE_OFF_M[0] <= side * head.across_m <= GAUGE_OFF_M[1] and np.isfinite(head.bed_m):
                    found.append((head.count, head.top_m, side))
    most = max((one[0] for one in found), default=0)
    for _, level_m, side in sorted((one for one in found if one[0] >= LEAST_COUNT * most), key=lambda one: -one[1]):
        beside = ahead.beside(side * settings.spacing_m, level_m)
        _, heads = _windows(points.around(beside.xy, reach_m + CANT_M), beside, reach_m, beam, settings)
        if len(heads) >= MIN_WINDOWS:
            return side, level_m
    return 0, 0.0
