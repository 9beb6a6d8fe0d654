"""From a course to a curve: the ridges of a line are measured, and its middle is fitted in every section."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .axis import STEP_M as VERTEX_M
from .axis import Axis, Points
from .corridor import Corridor, gather
from .curve import smooth
from .ridges import HALF_M, Fit, Shape, binned, fit, windows

STATION_M = 10.0
"""Length of a section of the fit, and the distance of stations."""

REACHES_M = (0.45, 0.35, 0.25)
"""Distance from the line within which its middle is looked for, in each round."""

MARGIN_M = 0.75
"""Points this much farther than the bed's half width are read: the line may still move."""

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

STRAIGHT_M, STRAIGHT_SECTIONS, TURN_SECTIONS = 0.004, 2, 5
"""Standard deviation of the third differences of a track in plan over 10 m where its curvature does not change, the
number of sections for which this counts beside what is measured, and the sections over which it is measured: a
transition is rarely shorter than 50 m."""

FIRST_TURN_M, SLOPE_M = 0.03, 0.017
"""Standard deviations with which the search for them begins, and of the second differences of the height: a curve of
300 m radius whose transition is 60 m long has third differences of 0.056 m, the toe of a switch 0.3 m."""

CURVE_PASSES, OUTLIER, TRUSTED = 12, 3.0, 0.2
"""Weightings of the curve, after which it hardly moves, the residual, in standard errors, at which a section has lost
3/4 of its weight, and the weight above which it states how good the standard errors are."""

COURSE_TURN_M, COURSE_M = 0.03, 0.12
"""Standard deviation of the third differences of the first curve, through the courses of 5 m, and the standard error of
their places."""

HOLD_M = 0.3
"""Standard error of the place of a section that is not seen: it stays where the last curve passed."""

ENOUGH_GAIN, GAIN_SHARE, MOST_EXPECTED = 6.0, 0.3, 60.0
"""A section shows a track if three of them gain more than this, and more than this share of what is expected."""

FEW_POINTS = 8
"""Points on a section's bed up to which it shows nothing."""

SHIFT_LENGTH_M, STRIP_SHIFT_M, MIXED_SECTIONS = 50.0, 0.1, 7
"""Length of the sections in which strips are fitted alone, standard deviation of the shift between two strips, and the
sections over which a curve mixes them."""

EDGE_M = 0.01
"""A middle this close to the end of the search lies beyond it."""


@dataclass(frozen=True)
class Sections:
    """What each section of `STATION_M` shows.

    Attributes
    ----------
    offset, sigma : (n,) arrays
        Middle of the track to the left of the axis, and its standard error, metres.
    found : Fit
        The fit there.
    points : (n,) array
        On the bed.
    shows : (n,) bool array
        Whether it shows two rails.
    """

    offset: np.ndarray
    sigma: np.ndarray
    found: Fit
    points: np.ndarray
    shows: np.ndarray


@dataclass(frozen=True)
class Refined:
    """A line that was fitted.

    Attributes
    ----------
    axis : Axis
        The curve before the last round, on which `sections` are seen.
    t : (n,) array
        Chainage of the middle of each section along the guide.
    xy : (n, 2) array
        The curve there.
    sigma : (n,) array
        Standard error across.
    bed, sigma_bed : (n,) arrays
        Height of the bed in the middle of the track, and its standard error.
    sections : Sections
    beside : (n,) array
        Distance of the section's own middle from the curve, metres.
    shape : Shape
        Ridges as they were measured.
    shown_m : float
        Distance of the rails that the points show where it is clearly not the expected one, else NaN.
    corridor : Corridor
    """

    axis: Axis
    t: np.ndarray
    xy: np.ndarray
    sigma: np.ndarray
    bed: np.ndarray
    sigma_bed: np.ndarray
    sections: Sections
    beside: np.ndarray
    shape: Shape
    shown_m: float
    corridor: Corridor


def refine(points: Points, axis: Axis, across: np.ndarray, shape: Shape) -> Refined | None:
    """Fit the curve of a track.

    Parameters
    ----------
    points : Points
        Around the axis.
    axis : Axis
        The guide.
    across : (sections,) array
        Course of the track, see `course.Course`.
    shape : Shape
        Ridges as they are expected.

    Returns
    -------
    Refined or None
        None if no section shows a track.
    """
    start_m = float(axis.t[0])
    middles = start_m + (np.arange(len(across)) + 0.5) * (STATION_M / 2)
    place, normal = axis.at(middles)
    first = smooth(place + across[:, None] * normal, np.full(len(place), COURSE_M**-2), COURSE_TURN_M, 3)
    line = _axis_through(first.values, middles, axis)
    found: _Round | None = None
    for reach_m in REACHES_M:
        found = _round(points, line, shape, found.sections.shows if found else None, reach_m)
        if found is None:
            return None
        line, seen_on = _axis_through(found.xy, found.t, axis), line
    return None if found is None else _with_heights(found, seen_on)


@dataclass(frozen=True)
class _Round:
    """A line after one round; see `Refined`."""

    t: np.ndarray
    xy: np.ndarray
    sigma: np.ndarray
    beside: np.ndarray
    sections: Sections
    shape: Shape
    shown_m: float
    corridor: Corridor


def _round(points: Points, line: Axis, shape: Shape, shows: np.ndarray | None, reach_m: float) -> _Round | None:
    """Measure the ridges along a line, fit its sections, and draw the curve through them."""
    corridor = gather(points, line, HALF_M + MARGIN_M)
    if corridor is None:
        return None
    measured, shown_m = measure(corridor, shape, shows)
    sections = fit_sections(corridor, measured, reach_m)
    if not sections.shows.any():
        return None
    t = corridor.start_m + (np.arange(len(sections.shows)) + 0.5) * STATION_M
    xy, sigma, beside = _curve(line, t, sections)
    return _Round(t, xy, sigma, beside, sections, measured, shown_m, corridor)


def _with_heights(last: _Round, axis: Axis) -> Refined:
    """Smooth the heights of the bed as well."""
    sections, noise_m = last.sections, last.shape.noise_m
    level = sections.found.level[:, None] + last.corridor.level_at(last.t)[:, None]
    noise = np.maximum(noise_m / np.sqrt(np.maximum(sections.points, 1)), LEAST_SIGMA_M)
    heights = smooth(level, np.where(sections.shows, noise**-2, 0.0), SLOPE_M, 2)
    return Refined(
        axis,
        last.t,
        last.xy,
        last.sigma,
        heights.values[:, 0],
        np.sqrt(heights.variance),
        sections,
        last.beside,
        last.shape,
        last.shown_m,
        last.corridor,
    )


def _axis_through(xy: np.ndarray, t: np.ndarray, guide: Axis) -> Axis:
    """Return an axis through places, (n, 2), at chainages of the guide; it goes on straight to the guide's ends."""
    from scipy.interpolate import CubicSpline

    wanted = np.arange(guide.t[0], guide.t[-1] + VERTEX_M / 2, VERTEX_M)
    if len(t) < 2:
        place, normal = guide.at(t)
        return Axis(guide.xy + ((xy - place) * normal).sum(axis=1) * guide.normal, guide.t)
    curve = CubicSpline(t, xy, bc_type="natural") if len(t) > 2 else None
    inside = np.clip(wanted, t[0], t[-1])
    if curve is None:
        return Axis(xy[0] + (wanted - t[0])[:, None] * (xy[1] - xy[0]) / (t[1] - t[0]), wanted)
    return Axis(curve(inside) + (wanted - inside)[:, None] * curve(inside, 1), wanted)


def measure(corridor: Corridor, shape: Shape, shows: np.ndarray | None) -> tuple[Shape, float]:
    """Return the ridges that the profile of a whole line shows, and the distance of the rails if it is another one."""
    near = np.abs(corridor.across) < HALF_M
    if shows is not None and shows.any():
        section = ((corridor.t - corridor.start_m) / STATION_M).astype(np.int64)
        near &= shows[np.clip(section, 0, len(shows) - 1)]
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
    section = ((corridor.t - corridor.start_m) / length_m).astype(np.int64)
    bins, low_m = places + width - 1, -(aside + half + 0.5) * BIN_M
    count, height = binned(section, corridor.across, corridor.height, total, low_m, bins, BIN_M)
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
    shows = _shows(here, points) & (np.abs(offset) < reach_m - EDGE_M)
    return Sections(offset, np.maximum(1 / np.sqrt(sharp), LEAST_SIGMA_M), here, points, shows)


LITTLE_SHARP = 1.0
"""Sharpness of a maximum, 1/m², that states nothing about the middle: a standard error of 1 m."""


def _shows(found: Fit, points: np.ndarray) -> np.ndarray:
    """Return which sections show two rails, together with those next to them."""
    together, expected = (np.convolve(one, np.ones(3))[1:-1] for one in (found.both, found.most))
    enough = together > np.maximum(ENOUGH_GAIN, GAIN_SHARE * np.minimum(expected, MOST_EXPECTED))
    return enough & (found.both > 0) & (points > FEW_POINTS)


def _curve(line: Axis, t: np.ndarray, sections: Sections) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the curve through the middles, its standard error, and how far the middles lie beside it.

    Straights and arcs are long, and transitions lie between them: how much the curvature changes is measured along the
    track (expectation maximisation of the variance of the third differences), so that a straight stays stiff beside a
    transition and a switch.
    """
    place, normal = line.at(t)
    shows = sections.shows
    target = place + np.where(shows, sections.offset, 0.0)[:, None] * normal
    weight, robust = np.where(shows, sections.sigma**-2, HOLD_M**-2), np.ones(len(t))
    turn_m = np.full(max(len(t) - 3, 0), FIRST_TURN_M)
    for _ in range(CURVE_PASSES):
        curve = smooth(target, weight * robust, turn_m, 3)
        beside = ((target - curve.values) * normal).sum(axis=1)
        squares = (beside / sections.sigma / OUTLIER) ** 2
        robust = np.where(shows, 1 / (1 + squares) ** 2, 1.0)
        turn_m = _turns(curve.bend)
    good = shows & (robust > TRUSTED)
    spread = np.sqrt(np.mean((beside / sections.sigma)[good] ** 2)) if good.sum() > 5 else 1.0
    return curve.values, np.sqrt(curve.variance) * np.clip(spread, 0.5, 3.0), beside


def _turns(bend: np.ndarray) -> np.ndarray:
    """Return the standard deviations of third differences, (n,), from their expected squares."""
    if not len(bend):
        return bend
    kernel = np.ones(TURN_SECTIONS)
    total, count = (np.convolve(one, kernel)[TURN_SECTIONS // 2 :][: len(bend)] for one in (bend, np.ones(len(bend))))
    return np.sqrt((STRAIGHT_SECTIONS * STRAIGHT_M**2 + total) / (STRAIGHT_SECTIONS + count))


def strip_error(refined: Refined) -> np.ndarray:
    """Return the standard error across by the distance between the two main strips, (n,) metres.

    Where both have as many points, the curve lies in their middle; where one is alone, it is off by half the distance.
    """
    strips, counts = np.unique(refined.corridor.strip, return_counts=True)
    main: Sequence[int] = strips[np.argsort(-counts)][:2].tolist()
    error = np.zeros(len(refined.t))
    if len(main) < 2:
        return error
    section = np.clip(((refined.corridor.t - refined.corridor.start_m) / STATION_M).astype(np.int64), 0, len(error) - 1)
    one, other = (
        np.bincount(section[refined.corridor.strip == strip], minlength=len(error)).astype(float) for strip in main
    )
    long = np.ones(min(MIXED_SECTIONS, len(error)))
    mixed = np.convolve(one - other, long, "same") / np.maximum(np.convolve(one + other, long, "same"), 1.0)
    _, normal = refined.axis.at(refined.t)
    return np.abs(mixed * (normal @ _strip_shift(refined, main))) / 2


def _strip_shift(refined: Refined, strips: Sequence[int]) -> np.ndarray:
    """Return how far one strip is shifted in plan against another, (2,) metres, as far as it shows across the track."""
    corridor, fits = refined.corridor, []
    for strip in strips:
        fits.append(fit_sections(corridor.kept(corridor.strip == strip), refined.shape, REACHES_M[-1], SHIFT_LENGTH_M))
    one, other = fits
    middles = corridor.start_m + (np.arange(len(one.offset)) + 0.5) * SHIFT_LENGTH_M
    _, normal = refined.axis.at(np.minimum(middles, refined.axis.t[-1]))
    good = (one.found.gain > ENOUGH_GAIN) & (other.found.gain > ENOUGH_GAIN)
    weight = np.where(good, 1 / (one.sigma**2 + other.sigma**2), 0.0)
    matrix = (normal * weight[:, None]).T @ normal + np.eye(2) / STRIP_SHIFT_M**2
    return np.linalg.solve(matrix, normal.T @ (weight * (one.offset - other.offset)))
