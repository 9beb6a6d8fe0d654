"""The middle of the head at stations along a line, from the outline of the head in sections of the line.

A section shows which parts of the head the scanner sees, and how far the line is off on average; the points around each
station then show how far it is off there. See docs/method.md section 6.7.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..clouds.points import RailPoints
from ..spread import sigma_by_median
from .edges import VIEW_STATIONS
from .head_points import ENOUGH_POINTS, HeadPoints, near_lines
from .outline import (
    CROWN_RADIUS_M,
    FACES,
    MIN_NOISE_M,
    RAYS_DEG,
    START_NOISE_M,
    Grid,
    Outline,
    Scores,
    Section,
    fit_section,
    log_likelihood,
)

MIN_SECTION_POINTS = 250
"""Points that a section needs for its parts to be told apart."""

PULL_M = 0.028
"""Displacement of the middles at both ends of a section where the scanner's view of the head changes along it, metres
per change of the share of points on the left between its halves: 22 to 36 mm on simulated branches that are seen from
above at one end and at 40° at the other."""

PULL_DOUBT = 0.3
"""Standard error of that displacement, as a share of it: the same branches."""

SHAPE_SIGMA_M = 0.0006
"""Standard error of the axis by the shape of a head: it is worn more on one side, and edges that are hardly seen blend
with what is beside them. All places of a rail share it, however many points there are. Measured over 18 random worlds
of mobile scanners: without it, 49 % of the errors were within the standard error and 75 % within twice it, with it 64
and 89 %."""

CHANGE_SIGMAS = 1.0
"""Change of that share, in standard errors, that counts as chance."""

MEDIAN_SIGMA = 1.25
"""Standard error of a median, relative to the standard error of a mean."""

MAX_CHANGE = 0.2
"""Largest change of that share that a change of the view explains: a larger one is the shadow of something."""

OTHER_SIDE = 0.25
"""Change of that share between the halves of a section from which they are seen from other sides, as between two places
of a tripod on either side of a track: half of what the shares of the two sides differ by, 0.5 to 0.8. The section is
divided."""

SHARE_STATIONS = 8
"""Stations, 2 m, in which the share of points on the left is found; their median is that of the half."""

MAX_STRAY_SHARE = 0.3
"""With more points on no part of the outline, something else than a head is seen."""

MAX_BEHIND_SHARE = 0.1
"""Largest share of points on lines of sight behind a head: beams that meet its edge give up to 8 % of those near it.
Lines of sight also explain the flanks of a blunt ridge, by 14 to 33 %; there, the head is fitted without them."""

MAX_SECTION_SHIFT_M = 0.02
"""Largest offset of a section: further off, the other edge of the head is outside the bins."""

COURSE_STATIONS = 33
"""Stations, 8.25 m, in whose windows the course of a line about its head is found."""

WRONG_WIDTH_M = 0.004
"""Error of the width above which another outline is fitted: standards differ by a millimetre."""

MAX_WRONG_WIDTH_M = 0.015
"""Error of the width above which the points show something else than a head, or one beside which the line is: from
there, a fit takes a face for the other one, and the head for a sharp one that is 20 to 36 mm narrower. Passes that are
2 cm apart look as narrow, but blurred."""

MAX_HEAD_WIDTH_M = 0.078
"""Widest head that is fitted: the widest of the standards has 77.8 mm. Heads that are flat to their edges look 10 mm
too wide, and their axis would be wherever the scanner seems to look from."""

SETTLED_WIDTH_M = 0.0005
"""Change of the width at which the search for it ends."""

WIDTH_ROUNDS = 5
"""Most rounds of the search for the width; each finds two thirds of what is left."""

BLURRED_M = 0.0037
"""Blur of the edges, beyond the noise in height, of a head that is blurred: worn corners blur edges by 2 mm."""

BLURRED_RATIO = 1.35
"""Ratio of the noise across to the noise in height of a head that is blurred: those of a scanner differ by a fifth."""

FLAT_SHARE = 0.3
"""Part of the head's width, to either side of its axis, that has no corners."""

TWO_LEVELS = -0.4
"""Excess kurtosis below which heights between the corners are on two levels. Noise has 0 or more, heights rounded to
half of the noise have -0.1, and two passes at a distance of 2 d have -2 (d² / (d² + noise²))²: -0.5 where d is the
noise."""

APART_M = 0.003
"""Half the least distance of two levels."""

FLAT_BLUR_M = 0.009
"""Blur from which a head without a round top is not flat to its edges, but shown by passes 20 mm apart or more."""

ON_HEAD_M = 0.005
"""Distance of a line from its head (RMS) up to which it shows the blur of the head: further off, it was displaced."""

CORE_SIGMAS = 4.0
"""Standard deviations of the heights above which a point is of weeds."""

SURE_SIGMAS = 4.0
"""Standard deviations of the kurtosis, √(24 / n), above which it is sure."""

CROWNED_SHARE = 0.5
"""Curvature of the top of a crowned head, as a share of the curvature of the outline. A head that is flat to its edges
looks 11 mm wider than it is, and blurred, as a head in several passes does."""

CROWN_SHARE = 0.4
"""Distance from the axis, as a share of the head's width, within which points give the curvature of the top."""

CROWN_BAND_M = 0.006
"""Largest height above or below the top of these points."""

FLAT_RING = (0.40, 0.47)
"""Distances from the axis, as shares of the head's width, between which the corners are."""

FLAT_DROP_M = 0.0012
"""Largest depth of the corners below the middle of a head that is flat to its edges: the outline has 2.5 to 5 mm."""

SHARP_NOISE_M = 0.003
"""Noise in height from which the outline tells the axis of a head without corners as well as its edges do."""

BEYOND_RING = (0.53, 0.60)
"""Distances from the axis, as shares of the head's width, between which a flat head has no points."""

MAX_BEYOND = 0.2
"""Density of the points there, as a share of the density on the head, above which several passes show the head: passes
15 mm apart have half."""


@dataclass(frozen=True)
class Middles:
    """Middle of the head at s stations, NaN where the sections do not show it.

    Attributes
    ----------
    offset : (s,) array
        Metres to the left of the line.
    information : (s,) array
        Inverse of its variance, 1/m², that the points next to a station alone contribute.
    common : (s,) array
        Standard error that all stations of a section share, metres.
    blur, blur_up : (s,) arrays
        Standard deviations, across and in height, of the places at which the points of a section show the head, metres;
        0 where they agree. They are half the distance of two passes of the scanner.
    top, top_information, top_common : (s,) arrays
        Height of the top, and the same about it as about the offset.
    aside : (s,) bool array
        Where too many of the points around are off the outline of their section, or the line is beside its head.
    """

    offset: np.ndarray
    information: np.ndarray
    common: np.ndarray
    blur: np.ndarray
    blur_up: np.ndarray
    top: np.ndarray
    top_information: np.ndarray
    top_common: np.ndarray
    aside: np.ndarray

    @classmethod
    def unknown(cls, count: int) -> Middles:
        """Return those of stations of which nothing is known."""
        nothing, zero = np.full((4, count), np.nan), np.zeros((4, count))
        aside = np.zeros(count, dtype=bool)
        return cls(nothing[0], zero[0], nothing[1], zero[1], zero[2], nothing[2], zero[3], nothing[3], aside)


def outline_middles(points: HeadPoints, seen: np.ndarray) -> Middles:
    """Find the middle of the head from its outline where it stands alone, `seen` (s,); the line is on the head."""
    count, head_width_m = len(seen), points.width_m
    middles = Middles.unknown(count)
    left, up, level = points.in_frame()
    level = np.interp(points.stations, points.t, level) if len(level) else middles.top
    head, grid = Head.of(head_width_m), Grid.of(head_width_m)
    bins = grid.number(left, up)
    used = (bins >= 0) & seen[points.station]
    left, up, station, bins = left[used], up[used], points.station[used], bins[used]
    start: Section | None = None
    for first, last, is_part in _views(borders(station, count), station, left > 0):
        start = None if is_part else start
        here = slice(*np.searchsorted(station, [first, last]))
        counts = np.bincount(bins[here], minlength=grid.size).astype(float)
        if counts.sum() < MIN_SECTION_POINTS:
            middles.aside[first:last] = np.diff(np.searchsorted(points.station, [first, last])) >= MIN_SECTION_POINTS
            continue
        section, fitted, width_m = _fitted(counts, head, grid, start)
        if section.shares[FACES.stop : -1].sum() > MAX_BEHIND_SHARE:
            section, fitted, width_m = _fitted(counts, Head.of(head_width_m, rays_deg=()), grid, None)
            start = None
        else:
            start, head = section, fitted
        part = slice(first, last)
        is_narrow = width_m < head_width_m - MAX_WRONG_WIDTH_M and section.noise_m.max() < START_NOISE_M
        if is_narrow or section.shares[-1] > MAX_STRAY_SHARE or abs(section.place[0]) > MAX_SECTION_SHIFT_M:
            start, middles.aside[part] = None, True
            continue
        scores = Scores.of(counts, section, fitted.outline, grid)
        (offset, above), (middles.information[part], middles.top_information[part]), (course, _) = _by_station(
            section.place[:2], scores, bins[here], station[here] - first, last - first
        )
        is_crowned = _is_crowned(left[here], up[here], head_width_m)
        is_flat = not is_crowned and _is_flat(left[here] - section.place[0], up[here], head_width_m)
        pull = _pull(station[here] - first, left[here] > section.place[0], last - first)
        is_sharp = section.noise_m[1] < SHARP_NOISE_M
        if not (is_flat and is_sharp):
            middles.aside[part] = _are_aside(scores.stray[bins[here]], station[here] - first, last - first)
            middles.offset[part] = np.where(seen[part] & ~middles.aside[part], offset - pull, np.nan)
        if not is_flat:
            middles.top[part] = np.where(seen[part], level[part] + above, np.nan)
        middles.common[part] = np.sqrt(scores.common_m[0] ** 2 + (PULL_DOUBT * pull) ** 2 + SHAPE_SIGMA_M**2)
        middles.top_common[part] = scores.common_m[1]
        on_crown = np.abs(left[here] - section.place[0]) < FLAT_SHARE * head_width_m
        middles.blur_up[part] = apart_m = _half_apart(_above_crown(left[here], up[here], section.place)[on_crown])
        middles.blur[part] = _blur(section, width_m - head_width_m, course, apart_m, is_crowned)
    return middles


@dataclass(frozen=True)
class Head:
    """A head of some width in metres, whether that is the stated one, and the lines of sight behind its outline."""

    width_m: float
    outline: Outline
    is_stated: bool
    rays_deg: Sequence[float]

    @classmethod
    def of(cls, width_m: float, is_stated: bool = True, rays_deg: Sequence[float] = RAYS_DEG) -> Head:
        """Sample the outline of a head."""
        return cls(width_m, Outline.of(width_m, rays_deg), is_stated, rays_deg)


def _fitted(counts: np.ndarray, head: Head, grid: Grid, start: Section | None) -> tuple[Section, Head, float]:
    """Fit a head to a section, with another outline if the stated width is wrong, and find the width that it shows.

    What the scanner sees of an outline that is too wide depends on the side that it looks from, and so does the axis of
    a head that was made narrower. Each round therefore begins with the outline of the width found before. Where that
    does not settle at the width of some head, the points have another shape, as flat heads, and the outline stays.
    """
    section = first = fit_section(counts, head.outline, grid, start)
    found, width_m = head, head.width_m + first.place[3]
    least_m = WRONG_WIDTH_M if head.is_stated else SETTLED_WIDTH_M
    for _ in range(WIDTH_ROUNDS):
        if not least_m < abs(width_m - found.width_m) or abs(width_m - head.width_m) >= MAX_WRONG_WIDTH_M:
            break
        found, least_m = Head.of(width_m, False, head.rays_deg), SETTLED_WIDTH_M
        section = fit_section(counts, found.outline, grid)
        width_m = found.width_m + section.place[3]
    settled = abs(width_m - found.width_m) <= least_m and width_m <= MAX_HEAD_WIDTH_M
    return (section, found, width_m) if settled else (first, head, width_m)


def _is_flat(left: np.ndarray, up: np.ndarray, head_width_m: float) -> bool:
    """Return whether points, by their offsets from the axis and heights, (n,) metres, show a head without corners.

    Its outline is not that of a rail, which lies anywhere across it with little doubt; its two edges show its middle.
    """
    left, up = left[np.abs(up) < CROWN_BAND_M] / head_width_m, up[np.abs(up) < CROWN_BAND_M]
    middle = up[np.abs(left) < CROWN_SHARE]
    sides = [up[(side * left > FLAT_RING[0]) & (side * left < FLAT_RING[1])] for side in (-1, 1)]
    if min(len(middle), *map(len, sides)) < ENOUGH_POINTS:
        return False
    beyond = np.count_nonzero((np.abs(left) > BEYOND_RING[0]) & (np.abs(left) < BEYOND_RING[1]))
    if beyond * CROWN_SHARE > MAX_BEYOND * len(middle) * (BEYOND_RING[1] - BEYOND_RING[0]):
        return False
    drop_m = np.mean(middle) - np.mean([np.mean(side) for side in sides])
    doubt_m = np.sqrt(np.mean([np.var(side) / len(side) for side in sides]))
    return bool(drop_m + 2 * doubt_m < FLAT_DROP_M)


def _is_crowned(left: np.ndarray, up: np.ndarray, head_width_m: float) -> bool:
    """Return whether points, by their offsets from the axis and from the top, (n,) metres, show a round top."""
    top = (np.abs(left) < CROWN_SHARE * head_width_m) & (np.abs(up) < CROWN_BAND_M)
    if top.sum() < ENOUGH_POINTS:
        return False
    curvature = -2 * np.polynomial.polynomial.polyfit(left[top], up[top], 2)[2]
    return bool(curvature > CROWNED_SHARE / CROWN_RADIUS_M)


def _above_crown(left: np.ndarray, up: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return the heights of points, (n,) metres, above the crown of a head at a place."""
    return up - place[1] - place[2] * left + (0.5 / CROWN_RADIUS_M + place[6]) * (left - place[0]) ** 2


def _half_apart(above: np.ndarray) -> float:
    """Return half the distance of two levels on which heights, (n,) metres, are, as of two passes; 0 if on one.

    The fourth moment distinguishes two levels from noise: the sum of both has the fourth cumulant -2 d⁴.
    """
    above = above - np.median(above) if len(above) else above
    above = above[np.abs(above) <= CORE_SIGMAS * sigma_by_median(above)] if len(above) else above
    if len(above) < MIN_SECTION_POINTS:
        return 0.0
    variance = float(np.var(above))
    kurtosis = float(np.mean((above - above.mean()) ** 4)) / variance**2 - 3 if variance else 0.0
    apart_m = np.sqrt(variance) * max(-0.5 * kurtosis, 0.0) ** 0.25
    sure = kurtosis <= min(TWO_LEVELS, -SURE_SIGMAS * np.sqrt(24 / len(above)))
    return float(apart_m) if sure and apart_m >= APART_M else 0.0


def _blur(section: Section, wider_m: float, offset: np.ndarray, apart_up_m: float, is_crowned: bool) -> float:
    """Return by how much the edges of a head are blurred beyond the noise; see `Middles.blur`.

    Where the line wanders about the head, by its `offset`, (k,) metres, it blurs the section as well, and so do passes
    in height, by `apart_up_m`. A head that is flat to its edges looks both blurred and wider, by `wider_m`.
    """
    across_m, height_m = section.noise_m
    known = offset[np.isfinite(offset)]
    if len(known) and np.sqrt(np.mean(known**2)) > ON_HEAD_M:
        return 0.0
    across_m = np.sqrt(max(across_m**2 - (np.var(known) if len(known) else 0.0), 0.0))
    height_m = np.sqrt(max(height_m**2 - apart_up_m**2, MIN_NOISE_M**2))
    blur_m = np.sqrt(max(across_m**2 - height_m**2, 0.0))
    is_blurred = blur_m >= BLURRED_M and across_m >= BLURRED_RATIO * height_m and wider_m >= -WRONG_WIDTH_M
    is_blurred &= wider_m < MAX_WRONG_WIDTH_M if is_crowned else wider_m < WRONG_WIDTH_M and blur_m > FLAT_BLUR_M
    return float(blur_m) if is_blurred else 0.0


def likelier_width(lines: Sequence[np.ndarray], points: RailPoints, widths_m: Sequence[float]) -> float:
    """Return which of several widths of heads explains points on rails best, metres; the first if none does.

    Other than the spread of the points, this does not depend on their noise and on how much of the faces is classified.
    """
    grid, outlines = Grid.of(max(widths_m)), [Outline.of(width_m) for width_m in widths_m]
    likelihood = np.zeros(len(widths_m))
    for head in near_lines(lines, points, max(widths_m)):
        for counts in _counted(replace(head, width_m=widths_m[0]), grid):
            likelihood += [log_likelihood(counts, fit_section(counts, one, grid), one, grid) for one in outlines]
    return widths_m[int(np.argmax(likelihood))]


def head_noise(points: HeadPoints) -> float:
    """Return the noise about a head in the points of a line, across and in height together; infinite without points.

    It is the mean logarithm of their product, in metres, and smaller where points show a sharper head. Points on no
    part of it are anywhere in the bins: one of two heads side by side is as sharp as a single one, but leaves the other
    out.
    """
    grid, outline = Grid.of(points.width_m), Outline.of(points.width_m)
    anywhere = np.log(np.ptp(grid.left) * np.ptp(grid.up) / 12)
    fits = [(counts.sum(), fit_section(counts, outline, grid)) for counts in _counted(points, grid)]
    noise = [one.place[4:6].sum() + one.shares[-1] * (anywhere - one.place[4:6].sum()) for _, one in fits]
    return float(np.average(noise, weights=[count for count, _ in fits])) if fits else np.inf


def _counted(points: HeadPoints, grid: Grid) -> Iterator[np.ndarray]:
    """Yield the counts of points in the bins of each section of a line, (b,)."""
    left, up, _ = points.in_frame()
    bins = grid.number(left, up)
    station = points.station[bins >= 0]
    for first, last in borders(station, len(points.stations)):
        here = bins[bins >= 0][slice(*np.searchsorted(station, [first, last]))]
        counts = np.bincount(here, minlength=grid.size).astype(float)
        if counts.sum() >= MIN_SECTION_POINTS:
            yield counts


def borders(
    station: np.ndarray, count: int, least: int = MIN_SECTION_POINTS, usual: int = VIEW_STATIONS
) -> list[tuple[int, int]]:
    """Divide stations into sections of about `usual` ones, longer ones where points, at `station`, are fewer."""
    ends = np.linspace(0, count, max(int(round(count / usual)), 1) + 1).astype(int)
    found, before = [0], np.searchsorted(station, ends)
    for end, points in zip(ends[1:].tolist(), before[1:].tolist()):
        if points - np.searchsorted(station, found[-1]) >= least:
            found.append(end)
    found[max(len(found) - 1, 1) :] = [count]
    return list(zip(found[:-1], found[1:]))


def _views(
    sections: Sequence[tuple[int, int]], station: np.ndarray, is_left: np.ndarray, is_part: bool = False
) -> Iterator[tuple[int, int, bool]]:
    """Divide sections whose halves show other parts of the head, as long as both have enough points.

    `station`, ascending, and `is_left` of the line are those of each point. Yields whether a section is part of another
    one: what the section before shows is then no estimate of it.
    """
    for first, last in sections:
        middle = (first + last) // 2
        start, half, end = np.searchsorted(station, [first, middle, last])
        is_full = min(half - start, end - half) >= MIN_SECTION_POINTS
        if is_full and abs(_change(station, is_left, start, half, end)) > OTHER_SIDE:
            yield from _views([(first, middle), (middle, last)], station, is_left, is_part=True)
        else:
            yield first, last, is_part


def _change(station: np.ndarray, is_left: np.ndarray, start: int, half: int, end: int) -> float:
    """Return by how much the share of points on the left is larger in `half` to `end` than in `start` to `half`."""
    before, after = slice(start, half), slice(half, end)
    return _share(station[after], is_left[after]) - _share(station[before], is_left[before])


def _pull(station: np.ndarray, is_left: np.ndarray, count: int) -> np.ndarray:
    """Return how far middles of a section are pulled to the left because the view changes along it, (count,) metres.

    `station`, ascending, and `is_left` of the axis are those of each point. A branch leaves the track that the scanner
    is on: it is seen from above first, then from the side. What the whole section shows on average pulls its beginning
    to one side and its end to the other.
    """
    half = int(np.searchsorted(station, count // 2))
    if not 0 < half < len(station):
        return np.zeros(count)
    change = _change(station, is_left, 0, half, len(station))
    chance = CHANGE_SIGMAS * MEDIAN_SIGMA * np.sqrt(0.25 / half + 0.25 / (len(station) - half))
    if not chance < abs(change) <= MAX_CHANGE:
        return np.zeros(count)
    return PULL_M * change * (1 - (chance / change) ** 2) * np.linspace(-1.0, 1.0, count)


def _share(station: np.ndarray, is_left: np.ndarray) -> float:
    """Return the share of points on the left in most parts of a section: in some the line may be off the head."""
    part = (station - station[0]) // SHARE_STATIONS
    count, on_left = np.bincount(part), np.bincount(part, is_left)
    return float(np.median(on_left[count > 0] / count[count > 0]))


def _are_aside(stray: np.ndarray, station: np.ndarray, count: int) -> np.ndarray:
    """Return at which stations of a section too many of the points around are off its outline, (count,) bool.

    `stray` is the probability of each point to be on no part of the outline, and `station` where it is. Far from a
    tripod, a section has few points, which may be on the other face, and the line may be half a head off.
    """
    sums = (np.bincount(station, values, minlength=count) for values in (stray, np.ones(len(stray))))
    strays, points = (uniform_filter1d(values, COURSE_STATIONS, mode="constant") for values in sums)
    return strays > MAX_STRAY_SHARE * points


def _by_station(
    place: np.ndarray, scores: Scores, bins: np.ndarray, station: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find offset and height at the stations of a section from the scores of their points.

    Parameters
    ----------
    place : (2,) array
        Offset and height of the section.
    bins, station : (n,) int arrays
        Bin and station of each point.
    count : int
        Number of stations.

    Returns
    -------
    places, information : (2, count) arrays
        See `Middles`; NaN and 0 without points. Across, the squares of the scores count, because part of the head may
        be hidden here. In height, what a point says on average does: every point of a top says as much, and in few
        points, squares would give those far off it most weight.
    course : (2, count) array
        The places in windows of `COURSE_STATIONS`, which show how the line wanders about the head.
    """
    gradient = np.array([np.bincount(station, own, minlength=count) for own in scores.by_bin[:, bins]])
    shown = np.bincount(station, scores.by_bin[0, bins] ** 2, minlength=count)
    known = np.array([shown, scores.per_point * np.bincount(station, minlength=count)])
    places, course = (
        place[:, None] + sums[0] / np.maximum(sums[1], 1e-9)
        for sums in ((gradient, known), uniform_filter1d([gradient, known], COURSE_STATIONS, axis=2, mode="constant"))
    )
    return np.where(known > 0, places, np.nan), known, course
