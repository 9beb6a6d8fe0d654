"""From courses to curves: in rounds, the ridges of each line are measured, its sections fitted, and curves drawn.

What lies on and beside a fitted line is looked for over 70 m: two rails on a bed, a better place, or another track. The
curves of parallel tracks are drawn together: each bends little, and the distance between two bends less. A section that
one track hides, or that few points show, lies on the curve of the others, at their distance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import block_diag, csr_matrix, diags, vstack

from ..polyline import Polyline, cross
from .guide_line import SECTION_M, STATION_M, Corridor, GuidePoints, gather
from .guide_line import STEP_M as VERTEX_M
from .ridges import (
    ENOUGH_GAIN,
    HALF_M,
    LEAST_SIGMA_M,
    OUTLIER,
    RidgeShape,
    Sections,
    binned,
    fit,
    fit_sections,
    measure,
    windows,
)
from .search import APART_M, LONG, STEP_M, TRACKS_APART_M, parallel

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

LITTLE = 1e-12
"""Added to the diagonal, so that a matrix without any data can be solved."""

STILL_M = 0.004
"""Standard deviation, over 10 m, of the third differences of a track in plan where its curvature does not change, and
of the second differences of the distance between two tracks: it changes by as much in a curve of 300 m radius."""

STRAIGHT_SECTIONS = 2
"""Sections for which `STILL_M` counts for a track beside what is measured."""

TURN_SECTIONS = 5
"""Sections over which the differences are measured, for which `STILL_M` counts for a distance, and up to which
residuals do not judge the standard errors: a transition is rarely shorter than 50 m."""

FIRST_TURN_M, FIRST_APART_M = 0.03, 0.3
"""Standard deviations with which the search for both begins: a curve of 300 m radius whose transition is 60 m long has
third differences of 0.056 m, the toe of a switch 0.3 m; its tracks part with second differences of 0.3 to 0.5 m."""

CURVE_PASSES = 12
"""Weightings of the curve, after which it hardly moves."""

TRUSTED = 0.2
"""Least weight of the sections whose residuals judge the standard errors."""

HOLD_M = 0.3
"""Standard error of the place of a section that is not seen: it stays where the last curve passed."""

SPREAD = (0.5, 3.0)
"""Limits of the factor by which residuals correct the standard errors."""

TURNED = 0.02
"""Sine of the angle between two lines below which they keep their distance: branches of switches turn by more."""

FOOT_ROUNDS = 2
"""Rounds of the search for the place beside a station on a parallel line; the first one starts at a vertex."""


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


@dataclass(frozen=True)
class Smooth:
    """A smooth curve through n places: `values`, (n, d), and the differences that are penalised, `rows`, (k, n).

    `covariance`, (n, n), is that of the curve if each place has the variance 1 / weight.
    """

    values: np.ndarray
    covariance: np.ndarray
    rows: csr_matrix

    @property
    def variance(self) -> np.ndarray:
        """Variance of each place, (n,)."""
        return np.diag(self.covariance)

    @property
    def bend(self) -> np.ndarray:
        """Expected square of each penalised difference, (k,): that of the curve's, and its variance."""
        spread = self.rows.multiply(self.rows @ self.covariance).sum(axis=1)
        return ((self.rows @ self.values) ** 2).sum(axis=1) + np.asarray(spread).ravel()


def smooth(values: np.ndarray, weight: np.ndarray, rows: csr_matrix, sigma: float | np.ndarray) -> Smooth:
    """Return the curve that balances places, `values` (n, d), and smoothness.

    `weight`, (n,), is 1 / variance; places with a weight of 0 may hold any number. `rows`, (k, n), such as those of
    `differences`, give differences that are small: `sigma`, one or (k,), is their standard deviation.
    """
    stiffness = np.broadcast_to(1 / np.square(sigma), rows.shape[0])
    matrix = (rows.T @ diags(stiffness) @ rows).toarray()
    matrix[np.diag_indices(len(matrix))] += weight + LITTLE
    covariance = np.linalg.inv(matrix)
    return Smooth(covariance @ (weight[:, None] * values), covariance, rows)


def differences(count: int, order: int) -> csr_matrix:
    """Return the differences of some order between places at equal steps, (count - order, count)."""
    if count <= order:
        return csr_matrix((0, count))
    weights = np.diff(np.eye(order + 1), order, axis=0)[0]
    return diags(weights, range(order + 1), shape=(count - order, count), format="csr")


@dataclass(frozen=True)
class TrackCurve:
    """The curve of a track at the middles of its sections, `xy` (n, 2).

    `sigma`, (n,), is the standard error across, and `beside`, (n,), the distance of the section's own middle from the
    curve, metres.
    """

    xy: np.ndarray
    sigma: np.ndarray
    beside: np.ndarray


def draw_together(lines: Sequence[Polyline], found: Sequence[Sections]) -> list[TrackCurve]:
    """Draw the curves of tracks through their sections, which are seen on `lines`.

    How much curvature and distance change is measured along the tracks (expectation maximisation of the variance of the
    differences), so that a straight stays stiff beside a transition and a switch.
    """
    stations = [one.stations_on(line) for line, one in zip(lines, found)]
    place = np.concatenate([line.at(t) for line, t in zip(lines, stations)])
    normal = np.concatenate([line.left_at(t) for line, t in zip(lines, stations)])
    shows, offset, sigma = (
        np.concatenate([getattr(one, name) for one in found]) for name in ("shows", "offset", "sigma")
    )
    target = place + np.where(shows, offset, 0.0)[:, None] * normal
    weight, robust = np.where(shows, sigma**-2, HOLD_M**-2), np.ones(len(target))
    stiff = _Stiffness.of(lines, stations)
    turn_m = stiff.first
    for _ in range(CURVE_PASSES):
        curve = smooth(target, weight * robust, stiff.rows, turn_m)
        beside = ((target - curve.values) * normal).sum(axis=1)
        robust = np.where(shows, 1 / (1 + (beside / sigma / OUTLIER) ** 2) ** 2, 1.0)
        turn_m = stiff.measured(curve.bend)
    error, good = np.sqrt(curve.variance), shows & (robust > TRUSTED)
    parts = np.split(np.arange(len(target)), np.cumsum([len(t) for t in stations])[:-1])
    return [
        TrackCurve(curve.values[at], error[at] * _spread((beside / sigma)[at][good[at]]), beside[at]) for at in parts
    ]


def _spread(residual: np.ndarray) -> float:
    """Return how much larger than their standard errors residuals are."""
    return float(np.clip(np.sqrt(np.mean(residual**2)), *SPREAD)) if len(residual) > TURN_SECTIONS else 1.0


@dataclass(frozen=True)
class _Stiffness:
    """The differences that are small, those of each track and of their distances: `rows`, (k, n) over all stations.

    The search for their standard deviations begins with `first`, (k,). A block is the number of rows that follow each
    other along the line, their standard deviation where nothing turns, and for how many sections this counts.
    """

    rows: csr_matrix
    first: np.ndarray
    blocks: list[tuple[int, float, int]]

    @classmethod
    def of(cls, lines: Sequence[Polyline], stations: Sequence[np.ndarray]) -> _Stiffness:
        """Set up the differences at the stations of lines."""
        own = [differences(len(t), 3) for t in stations]
        apart = list(_distances(lines, stations))
        blocks = [(one.shape[0], STILL_M, STRAIGHT_SECTIONS) for one in own]
        blocks += [(one.shape[0], STILL_M, TURN_SECTIONS) for one in apart]
        starts = [FIRST_TURN_M] * len(own) + [FIRST_APART_M] * len(apart)
        first = np.concatenate([np.full(count, start) for (count, _, _), start in zip(blocks, starts)])
        return cls(vstack([block_diag(own), *apart], format="csr"), first, blocks)

    def measured(self, bend: np.ndarray) -> np.ndarray:
        """Return the standard deviations, (k,), by the expected squares of the differences, (k,)."""
        found, kernel = [], np.ones(TURN_SECTIONS)
        for squares, (rows, still_m, sections) in zip(np.split(bend, self._ends), self.blocks):
            total, count = (
                np.convolve(one, kernel)[TURN_SECTIONS // 2 :][:rows] if rows else one
                for one in (squares, np.ones(rows))
            )
            found.append(np.sqrt((sections * still_m**2 + total) / (sections + count)))
        return np.concatenate(found)

    @property
    def _ends(self) -> np.ndarray:
        return np.cumsum([rows for rows, _, _ in self.blocks])[:-1]


def _distances(lines: Sequence[Polyline], stations: Sequence[np.ndarray]) -> Iterator[csr_matrix]:
    """Yield the second differences of the distance between each two parallel lines, over the stations of all."""
    first = np.cumsum([0, *map(len, stations)])
    for one in range(len(lines)):
        for other in range(one + 1, len(lines)):
            near, t = _feet(lines[one], stations[one], lines[other])
            weights, columns = _interpolation(t, stations[other])
            near &= (t >= stations[other][0]) & (t <= stations[other][-1])
            count = len(near)
            across = csr_matrix(
                (
                    np.column_stack([np.ones(count), -weights]).ravel(),
                    np.column_stack([first[one] + np.arange(count), first[other] + columns]).ravel(),
                    np.arange(count + 1) * (1 + weights.shape[1]),
                ),
                shape=(count, first[-1]),
            )
            whole = near[2:] & near[1:-1] & near[:-2]
            if whole.any():
                yield (differences(count, 2) @ across)[whole]


def _feet(line: Polyline, t: np.ndarray, other: Polyline) -> tuple[np.ndarray, np.ndarray]:
    """Return at which stations of a line another one is parallel, (n,) bool, and its chainages there, (n,)."""
    place, normal = line.at(t), line.left_at(t)
    near, feet, _ = parallel(place, normal, other)
    for _ in range(FOOT_ROUNDS):
        left = other.left_at(feet)
        feet = feet + cross(place - other.at(feet), left)
    return near & (np.abs(cross(normal, left)) < TURNED), feet


def _interpolation(t: np.ndarray, stations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return weights and numbers, (n, 4) each, of the stations between which a cubic is drawn at chainages, (n,)."""
    count = min(4, len(stations))
    at = (t - stations[0]) / STATION_M
    low = np.clip(np.floor(at).astype(np.int64) - 1, 0, len(stations) - count)
    nodes = np.arange(count)
    step = (at - low)[:, None] - nodes
    weights = [np.prod([step[:, k] / (j - k) for k in nodes if k != j] or [np.ones(len(t))], axis=0) for j in nodes]
    return np.column_stack(weights), low[:, None] + nodes
