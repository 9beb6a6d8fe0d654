"""The smooth line through a guide, and the points along it: chainage, distance to the left, height above the bed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from ..polyline import Polyline

STEP_M = 1.0
"""Distance between the vertices of an axis: a chord of a curve of 300 m radius is then 0.4 mm off."""

MIN_VERTEX_M = 8.0
"""Distance below which vertices of a guide are left out: their errors would bend the curve between them."""

LONG_RUN = 2.0
"""A run this many times as long as the one next to it is straight up to it."""

SMOOTHED_M = 4.0
"""Standard deviation of the smoothing of a guide, which rounds its kinks; a curve of 300 m radius moves by 3 cm."""

SECTION_M = 5.0
"""Length over which the level of the bed is taken."""

STATION_M = 2 * SECTION_M
"""Length of a section of the fit, and the distance of stations."""

BED_M, BED_SHARE = 2.5, 0.4
"""Distance from the axis within which points state the level of the bed, and their quantile: the bed is the larger
part of what lies there, and rails and plants are above it."""

LEVEL_JUMP_M, MEDIAN_SECTIONS = 0.4, 9
"""A level that differs by more from the median of as many sections belongs to something on the track, or under it."""

BELOW_M, ABOVE_M = 1.6, 1.1
"""Heights about the level outside of which points tell nothing about the track: wires, roofs, slopes."""

CELL_ACROSS_M, TRIM_M = 0.25, 0.25
"""Width of the cells, `STATION_M` long, from whose median no point lies farther: rails stand less above their bed."""

OWN_LEVEL_M, MIN_SHARED = 2.0, 5
"""Distance from the axis within which strips are compared, and the number of sections that must show both."""


@dataclass(frozen=True)
class GuidePoints:
    """Points around a guide: places, (n, 3) metres, the number of each one's strip, and its chainage on the guide."""

    xyz: np.ndarray
    strip: np.ndarray
    t: np.ndarray

    @classmethod
    def near(cls, line: Polyline, xyz: np.ndarray, strip: np.ndarray, reach_m: float) -> GuidePoints:
        """Return the points, (n, 3) of strips (n,), within reach of a line."""
        feet = line.feet(xyz[:, :2], reach_m)
        return cls(xyz[feet.point], strip[feet.point], feet.t)


def axis_of_guide(vertices: np.ndarray) -> Polyline:
    """Draw a smooth curve through the vertices of a guide, (n, 2) metres; straight runs stay straight.

    The curve removes the error of chords, which is 0.67 m where the vertices of a curve of 300 m radius are 40 m apart.
    """
    kept = Polyline(_without_bulges(_apart(vertices)))
    fine = np.arange(0.0, kept.length_m, STEP_M / 4)
    curve = Polyline(Akima1DInterpolator(kept.t, kept.xy)(fine) if len(kept.t) > 2 else kept.at(fine))
    t = np.arange(0.0, curve.length_m, STEP_M)
    return Polyline(_smoothed(curve.at(t)), t)


def _apart(vertices: np.ndarray) -> np.ndarray:
    """Return the vertices at a distance from each other, with both ends."""
    kept = [0]
    for number in range(1, len(vertices) - 1):
        if np.hypot(*(vertices[number] - vertices[kept[-1]])) >= MIN_VERTEX_M:
            kept.append(number)
    if len(kept) > 1 and np.hypot(*(vertices[-1] - vertices[kept[-1]])) < MIN_VERTEX_M:
        kept.pop()
    return vertices[[*kept, len(vertices) - 1]]


def _without_bulges(vertices: np.ndarray) -> np.ndarray:
    """Add a vertex to a straight run where it meets a much shorter one: the curve beyond would bend it."""
    steps = np.hypot(*np.diff(vertices, axis=0).T)
    added = [vertices[:1]]
    for number in range(len(steps)):
        start, end, length_m = vertices[number], vertices[number + 1], steps[number]
        before_m = steps[number - 1] if number else np.inf
        after_m = steps[number + 1] if number + 1 < len(steps) else np.inf
        if length_m > LONG_RUN * before_m:
            added.append((start + before_m / length_m * (end - start))[None])
        if length_m > LONG_RUN * after_m:
            added.append((end - after_m / length_m * (end - start))[None])
        added.append(end[None])
    return np.concatenate(added)


def _smoothed(xy: np.ndarray) -> np.ndarray:
    """Smooth a line with vertices every `STEP_M`; beyond its ends it goes on straight."""
    half = int(3 * SMOOTHED_M / STEP_M)
    if len(xy) <= half + 1:
        return xy
    kernel = np.exp(-0.5 * (np.arange(-half, half + 1) * STEP_M / SMOOTHED_M) ** 2)
    padded = np.concatenate([2 * xy[0] - xy[half:0:-1], xy, 2 * xy[-1] - xy[-2 : -half - 2 : -1]])
    return np.column_stack([np.convolve(column, kernel / kernel.sum(), "valid") for column in padded.T])


@dataclass(frozen=True)
class Corridor:
    """Points along an axis, (n,) arrays: chainage, distance to the left, height above the level, metres, and strip.

    The first section begins at `start_m`; `level`, (k,), is the height of the bed in the middle of each section of
    `SECTION_M`.
    """

    t: np.ndarray
    across: np.ndarray
    height: np.ndarray
    strip: np.ndarray
    start_m: float
    level: np.ndarray

    @property
    def sections(self) -> int:
        """Number of sections."""
        return len(self.level)

    @property
    def middles(self) -> np.ndarray:
        """Chainage of the middle of each section, (k,)."""
        return self.start_m + (np.arange(self.sections) + 0.5) * SECTION_M

    def section_of(self, length_m: float) -> np.ndarray:
        """Return the section of a length in which each point lies, (n,); the first holds those before it as well."""
        return ((self.t - self.start_m) / length_m).astype(np.int64)

    def level_at(self, t: np.ndarray) -> np.ndarray:
        """Return the level of the bed at chainages."""
        return np.interp(t, self.middles, self.level)

    def kept(self, which: np.ndarray) -> Corridor:
        """Return some of the points, by a mask or by their numbers."""
        t, across, height, strip = (one[which] for one in (self.t, self.across, self.height, self.strip))
        return Corridor(t, across, height, strip, self.start_m, self.level)


def gather(points: GuidePoints, axis: Polyline, reach_m: float) -> Corridor | None:
    """See points along an axis, up to a distance from it; None if there is no level to see."""
    t, across = axis.feet_near(points.xyz[:, :2], points.t)
    near = np.abs(across) <= reach_m
    t, across, z = t[near], across[near], points.xyz[near, 2]
    start_m = float(axis.t[0])
    count = max(int(np.ceil((axis.t[-1] - start_m) / SECTION_M)), 1)
    section = np.clip(((t - start_m) / SECTION_M).astype(np.int64), 0, count - 1)
    level = _level(section, across, z, count)
    if level is None:
        return None
    corridor = Corridor(t, across, z, points.strip[near], start_m, level)
    corridor = _relative(corridor, corridor.height - corridor.level_at(t))
    corridor = corridor.kept((corridor.height > -BELOW_M) & (corridor.height < ABOVE_M))
    corridor = corridor.kept(_near_the_median(corridor))
    return _levelled_strips(corridor)


def _relative(corridor: Corridor, height: np.ndarray) -> Corridor:
    return Corridor(corridor.t, corridor.across, height, corridor.strip, corridor.start_m, corridor.level)


def _level(section: np.ndarray, across: np.ndarray, z: np.ndarray, count: int) -> np.ndarray | None:
    """Return the level of the bed by section, (count,); None if no section has points."""
    near = np.abs(across) < BED_M
    order = np.lexsort((z[near], section[near]))
    heights, numbers = z[near][order], np.bincount(section[near], minlength=count)
    first = np.concatenate([[0], np.cumsum(numbers)[:-1]])
    known = numbers > 0
    if not known.any():
        return None
    level = np.full(count, np.nan)
    level[known] = heights[(first + (numbers * BED_SHARE).astype(np.int64))[known]]
    at = np.arange(count)
    level = np.interp(at, at[known], level[known])
    padded = np.pad(level, MEDIAN_SECTIONS // 2, mode="reflect", reflect_type="odd") if count > 4 else level
    if count > 4:
        median = np.median(np.lib.stride_tricks.sliding_window_view(padded, MEDIAN_SECTIONS), axis=1)
        level = np.where(np.abs(level - median) < LEVEL_JUMP_M, level, median)
    return np.convolve(np.pad(level, 2, mode="edge"), np.ones(5) / 5, "valid")


def _near_the_median(corridor: Corridor) -> np.ndarray:
    """Return which points lie near the median of their cell, (n,) bool."""
    row = corridor.section_of(STATION_M)
    column = np.floor(corridor.across / CELL_ACROSS_M).astype(np.int64)
    cell = (row - row.min(initial=0)) * 4096 + column + 2048
    order = np.lexsort((corridor.height, cell))
    _, first, inverse, count = np.unique(cell[order], return_index=True, return_inverse=True, return_counts=True)
    median = corridor.height[order][first + count // 2]
    near = np.empty(len(cell), dtype=bool)
    near[order] = np.abs(corridor.height[order] - median[inverse]) < TRIM_M
    return near


def _levelled_strips(corridor: Corridor) -> Corridor:
    """Remove the height of each strip above the mean of all, as their sections show it."""
    strips = np.unique(corridor.strip)
    if len(strips) < 2:
        return corridor
    near = np.abs(corridor.across) < OWN_LEVEL_M
    section = np.clip(corridor.section_of(SECTION_M), 0, corridor.sections - 1)
    means = np.array([_means(section, corridor.height, near & (corridor.strip == one), corridor) for one in strips])
    shared = np.isfinite(means).sum(axis=0) > 1
    if shared.sum() < MIN_SHARED:
        return corridor
    steps = np.zeros(len(strips))
    for _ in range(3):  # each strip against the mean of those that show the section
        middle = np.nanmean(means[:, shared] - steps[:, None], axis=0)
        steps += np.nan_to_num(np.nanmedian(means[:, shared] - steps[:, None] - middle, axis=1))
    steps -= steps.mean()
    return _relative(corridor, corridor.height - steps[np.searchsorted(strips, corridor.strip)])


def _means(section: np.ndarray, height: np.ndarray, which: np.ndarray, corridor: Corridor) -> np.ndarray:
    """Return the mean height of some points by section, NaN without points."""
    count = np.bincount(section[which], minlength=corridor.sections)
    total = np.bincount(section[which], height[which], minlength=corridor.sections)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
