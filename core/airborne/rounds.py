"""From courses to curves: in rounds, the ridges of each line are measured, its sections fitted, and curves drawn.

What lies on and beside a fitted line is looked for over 70 m: two rails on a bed, a better place, or another track.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..polyline import Polyline
from .curves import FIRST_TURN_M, TrackCurve, differences, draw_together, smooth
from .guide_line import SECTION_M, STATION_M, Corridor, GuidePoints, gather
from .guide_line import STEP_M as VERTEX_M
from .ridges import (
    ENOUGH_GAIN,
    HALF_M,
    LEAST_SIGMA_M,
    RidgeShape,
    Sections,
    binned,
    fit,
    fit_sections,
    measure,
    windows,
)
from .search import APART_M, LONG, STEP_M, TRACKS_APART_M

WIDE_M = 5.6
"""Distance from the line up to which places are compared: tracks of one line are rarely farther apart."""

REPEATED_M = 1.1
"""Places less far apart than a gauge are of one track, and rails of the line are on its own place alone."""

REACHES_M = (0.45, 0.35, 0.25)
"""Distance from the line within which its middle is looked for, in each round."""

MARGIN_M = 0.75
"""Points this much farther than the bed's half width are read: the line may still move."""

SLOPE_M = 0.017
"""Standard deviation of the second differences of the height over 10 m."""

COURSE_M = 0.12
"""Standard error of the places of a course."""

SHIFT_LENGTH_M, STRIP_SHIFT_M = 50.0, 0.1
"""Length of the sections in which strips are fitted alone, and standard deviation of the shift between two strips."""


@dataclass(frozen=True)
class Beside:
    """Places `across`, (c,), to the left of a line and on it, for the `LONG` sections around each section.

    `gain` and `flaw`, (n, c), are those of `ridges.RidgeFit`.
    """

    across: np.ndarray
    gain: np.ndarray
    flaw: np.ndarray

    @property
    def score(self) -> np.ndarray:
        """Gain of two rails, less the flaws of the bed, (n, c)."""
        return self.gain - self.flaw

    @property
    def on(self) -> tuple[np.ndarray, np.ndarray]:
        """Gain and score on the line, (n,) each."""
        middle = len(self.across) // 2
        return self.gain[:, middle], self.score[:, middle]

    @property
    def rival(self) -> np.ndarray:
        """Best score of a place that excludes the line, because two tracks are never so close, (n,)."""
        return self._best(APART_M, TRACKS_APART_M)

    @property
    def repeated(self) -> np.ndarray:
        """Best score of a place that the line's own rails can't make, as the furrows of a field do, (n,)."""
        return self._best(APART_M, REPEATED_M)

    def _best(self, low_m: float, high_m: float) -> np.ndarray:
        """Return the best score of places between two distances, (n,)."""
        apart = np.abs(self.across)
        return self.score[:, (apart > low_m) & (apart < high_m)].max(axis=1)


def look_beside(corridor: Corridor, shape: RidgeShape, sections: int) -> Beside:
    """Compare the places beside a line, whose corridor reaches `WIDE_M` and half the width of a bed farther.

    Stones and sleepers differ from section to section, so that averaging removes more of them over many.
    """
    half, places = int(round(HALF_M / STEP_M)), 2 * int(round(WIDE_M / STEP_M)) + 1
    width = 2 * half + 1
    bins = places + width - 1
    low_m = -(places // 2 + half + 0.5) * STEP_M
    count, height = binned(
        corridor.section_of(STATION_M), corridor.across, corridor.height, sections, low_m, bins, STEP_M
    )
    total = _around(count * height)
    count = _around(count)
    height = total / np.maximum(count, 1)
    u = (np.arange(width) - half) * STEP_M
    long = replace(shape, rough_m=shape.rough_m / np.sqrt(LONG))
    found = fit(windows(count, width), windows(height, width), u, long, passes=3)
    return Beside((np.arange(places) - places // 2) * STEP_M, found.gain, found.flaw)


def _around(values: np.ndarray) -> np.ndarray:
    """Return the sums over the `LONG` sections around each, (n, k); there are fewer at the ends."""
    padded = np.pad(values, ((LONG // 2 + 1, LONG // 2), (0, 0)))
    total = np.cumsum(padded, axis=0, dtype=np.float64)
    return (total[LONG:] - total[:-LONG]).astype(values.dtype)


@dataclass(frozen=True)
class Traced:
    """A track whose course, `across` as in `search.GuideCourse`, is known to half a metre; its ridges as expected."""

    points: GuidePoints
    guide: Polyline
    across: np.ndarray
    shape: RidgeShape


@dataclass(frozen=True)
class Seen:
    """What shows along a line, with the ridges as they were measured.

    `shown_m` is the distance of the rails that the points show where it is clearly not the expected one, else NaN.
    """

    axis: Polyline
    corridor: Corridor
    shape: RidgeShape
    shown_m: float
    sections: Sections

    @property
    def t(self) -> np.ndarray:
        """Chainage of the middle of each section along the guide, (n,)."""
        return self.sections.stations_on(self.axis)


@dataclass(frozen=True)
class Refined:
    """A line through a fitted curve, and what was seen along the curve before the last round.

    `bed` and `sigma_bed`, (n,), are the height of the bed in the middle of the track and its standard error.
    """

    seen: Seen
    curve: TrackCurve
    line: Polyline
    bed: np.ndarray
    sigma_bed: np.ndarray

    @property
    def t(self) -> np.ndarray:
        """Chainage of the middle of each section along the guide, (n,)."""
        return self.seen.t


def refine(tracks: Sequence[Traced]) -> list[Refined | None]:
    """Fit the curves of parallel tracks; None for those of which no section shows a track."""
    lines = {number: _first(track) for number, track in enumerate(tracks)}
    found: dict[int, tuple[Seen, TrackCurve, Polyline]] = {}
    for reach_m in REACHES_M:
        seen: dict[int, Seen] = {}
        for number, line in lines.items():
            last = found[number][0] if found else None
            one = _look(tracks[number], line, last, reach_m)
            if one is not None:
                seen[number] = one
        if not seen:
            return [None] * len(tracks)
        curves = draw_together([one.axis for one in seen.values()], [one.sections for one in seen.values()])
        lines = {
            number: _axis_through(curve.xy, seen[number].t, tracks[number].guide) for number, curve in zip(seen, curves)
        }
        found = {number: (seen[number], curve, lines[number]) for number, curve in zip(seen, curves)}
    return [_with_heights(*found[number]) if number in found else None for number in range(len(tracks))]


def _first(track: Traced) -> Polyline:
    """Return the line through the course of a track."""
    middles = float(track.guide.t[0]) + (np.arange(len(track.across)) + 0.5) * SECTION_M
    place, normal = track.guide.at(middles), track.guide.left_at(middles)
    weight, rows = np.full(len(place), COURSE_M**-2), differences(len(place), 3)
    curve = smooth(place + track.across[:, None] * normal, weight, rows, FIRST_TURN_M)
    return _axis_through(curve.values, middles, track.guide)


def _look(track: Traced, line: Polyline, last: Seen | None, reach_m: float) -> Seen | None:
    """Measure the ridges along a line and fit its sections; None if none of them shows a track."""
    corridor = gather(track.points, line, HALF_M + MARGIN_M)
    if corridor is None:
        return None
    shape, shown_m = measure(corridor, track.shape, last.sections.shows if last else None)
    sections = fit_sections(corridor, shape, reach_m)
    return Seen(line, corridor, shape, shown_m, sections) if sections.shows.any() else None


def _with_heights(seen: Seen, curve: TrackCurve, line: Polyline) -> Refined:
    """Smooth the heights of the bed as well."""
    sections = seen.sections
    level = sections.found.level + seen.corridor.level_at(seen.t)
    noise = np.maximum(seen.shape.noise_m / np.sqrt(np.maximum(sections.points, 1)), LEAST_SIGMA_M)
    weight = np.where(sections.shows, noise**-2, 0.0)
    heights = smooth(level[:, None], weight, differences(len(level), 2), SLOPE_M)
    return Refined(seen, curve, line, heights.values[:, 0], np.sqrt(heights.variance))


def _axis_through(xy: np.ndarray, t: np.ndarray, guide: Polyline) -> Polyline:
    """Return an axis through places, (n, 2), at chainages of the guide; it goes on straight to the guide's ends."""
    from scipy.interpolate import CubicSpline

    wanted = np.arange(guide.t[0], guide.t[-1] + VERTEX_M / 2, VERTEX_M)
    if len(t) < 2:
        left_m = ((xy - guide.at(t)) * guide.left_at(t)).sum(axis=1)
        return Polyline(guide.xy + left_m * guide.normals, guide.t)
    curve = CubicSpline(t, xy, bc_type="natural")
    inside = np.clip(wanted, t[0], t[-1])
    return Polyline(curve(inside) + (wanted - inside)[:, None] * curve(inside, 1), wanted)


def strip_error(refined: Refined) -> np.ndarray:
    """Return the standard error across by the distance between the two main strips, (n,) metres.

    Where both have as many points, the curve lies in their middle; where one is alone, it is off by half the distance.
    """
    seen, error = refined.seen, np.zeros(len(refined.t))
    strips, counts = np.unique(seen.corridor.strip, return_counts=True)
    main: Sequence[int] = strips[np.argsort(-counts)][:2].tolist()
    if len(main) < 2:
        return error
    section = np.clip(seen.corridor.section_of(STATION_M), 0, len(error) - 1)
    one, other = (
        np.bincount(section[seen.corridor.strip == strip], minlength=len(error)).astype(float) for strip in main
    )
    mixed = (one - other) / np.maximum(one + other, 1.0)
    normal = seen.axis.left_at(refined.t)
    return np.abs(mixed * (normal @ _strip_shift(seen, main))) / 2


def _strip_shift(seen: Seen, strips: Sequence[int]) -> np.ndarray:
    """Return how far one strip is shifted in plan against another, (2,) metres, as far as it shows across the track."""
    corridor, fits = seen.corridor, []
    for strip in strips:
        fits.append(fit_sections(corridor.kept(corridor.strip == strip), seen.shape, REACHES_M[-1], SHIFT_LENGTH_M))
    one, other = fits
    middles = corridor.start_m + (np.arange(len(one.offset)) + 0.5) * SHIFT_LENGTH_M
    normal = seen.axis.left_at(np.minimum(middles, seen.axis.t[-1]))
    good = (one.found.gain > ENOUGH_GAIN) & (other.found.gain > ENOUGH_GAIN)
    weight = np.where(good, 1 / (one.sigma**2 + other.sigma**2), 0.0)
    matrix = (normal * weight[:, None]).T @ normal + np.eye(2) / STRIP_SHIFT_M**2
    return np.linalg.solve(matrix, normal.T @ (weight * (one.offset - other.offset)))
