"""Strips, the passes of a scanner: by how much they differ across and in height along a line, and how to align them.

The position of a scanner is in error by some millimetres to centimetres that change slowly along the way. Where two
passes show a rail, or one passes on to the next, their difference is seen. See docs/method.md section 6.6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d
from scipy.sparse.linalg import spsolve

from ..lines.smoothing import PROFILE_SIGMA_M
from ..parameters import Parameters
from ..polyline import Polyline, distance_to, interpolate, project
from ..rails import HALF_TRACK_M, Centerline, StripCourse, Support
from .edges import edge_middles
from .head_points import HeadPoints
from .sections import head_noise
from .top import find_top

STEP_M = 1.0
"""Spacing of the stations at which strips are compared, and averaged over both rails: four of the windows in which
edges are looked for."""

MIN_IN_STEP = 5
"""Points on top of the head that show a strip at a station; fewer may be stray points."""

OBSERVED_M = 0.002
"""Standard error of the position of one strip at a station, across and in height."""

DRIFT_M, DRIFT_LENGTH_M = 0.02, 50.0
"""Standard deviation of the error of a strip's position, and length along the way over which it changes and away from
another strip fades: seconds of a scanning train."""

FADE_M = 35.0
"""Length over which offsets fade to zero away from where strips meet: less than a square sees beyond its border, so
that neighbouring squares align strips alike."""

IRREGULAR_M = 0.0005
"""Standard deviation of the third difference of a rail's position at stations 1 m apart: waves of 2 mm that are 10 m
long. Transitions have less than 0.2 mm. Steps between strips have tens of millimetres."""

OUTLIER_SIGMAS = 2.0
"""Residuals, in standard errors, from which a station loses weight: blades that one strip shows better."""

HOLE_M, END_M = 2.0, 2.0
"""Half the length without points that does not end a strip, and length of its ends that is left out: windows reach
beyond the end there, where the line bends towards the next strip."""

UNKNOWN = -1
"""Number of the strip of points that show none."""

ROUNDS = 3
"""Rounds of solving and weighing; a fourth changes offsets by less than 0.1 mm."""

MEETING_M = 5.0
"""Distance from a station within which two strips show the line: they are compared there. It is half the longest window
in which edges are looked for, and a station."""


@dataclass(frozen=True)
class StripOffsets:
    """Offsets of the strips that show a line from their mean, at n stations `STEP_M` apart.

    Attributes
    ----------
    t : (n,) array
        Chainage of the stations.
    strips : (s,) int array
        Numbers of the strips, ascending.
    across, up : (s, n) arrays
        Offsets to the left and upwards, metres. Away from where a strip meets another one they fade to zero.
    points : (s, n) array
        Points on the head by strip, averaged over `MEETING_M` on either side.
    shown : (s, n) bool array
        Where a strip shows the line within `MEETING_M`.
    gathered : (s, n) bool array
        Where the points of a strip belong on the mean of the strips that are there: where it has points, apart from
        short holes, if all of them together then show a sharper head.
    passes : (s,) array
        Number of passes that a strip holds, by which it counts: those of the same height cannot be told apart.
    """

    t: np.ndarray
    strips: np.ndarray
    across: np.ndarray
    up: np.ndarray
    points: np.ndarray
    shown: np.ndarray
    gathered: np.ndarray
    passes: np.ndarray

    def moved(self, points: HeadPoints, align: bool = False) -> HeadPoints:
        """Move the points onto the mean of the strips that are at each place, or, to `align`, of all strips.

        Heads that are side by side have no outline: a line would be on the highest of them, or on the densest.
        """
        across, up = points.across.copy(), points.z.copy()
        for values, offsets in ((across, self.across), (up, self.up)):
            for strip, off in zip(self.strips, self._off(offsets, align)):
                mine = points.strips == strip
                values[mine] -= np.interp(points.t[mine], self.t, off)
        return replace(points, across=across, z=up)

    def _off(self, offsets: np.ndarray, align: bool) -> np.ndarray:
        """Return how far strips, by their `offsets`, are off the mean that their points are moved onto, (s, n)."""
        if align:
            return offsets
        weight = self.gathered * self.passes[:, None]
        mean = (weight * offsets).sum(axis=0) / np.maximum(weight.sum(axis=0), 1)
        return np.where(self.gathered, offsets - mean, 0.0)

    @property
    def count(self) -> np.ndarray:
        """Number of strips that show the line, (n,)."""
        return self.shown.sum(axis=0)

    @property
    def spread_m(self) -> np.ndarray:
        """Largest distance between two strips, across or in height, (n,); NaN where fewer than two show the line."""
        spans = [
            np.max(np.where(self.shown, values, -np.inf), axis=0) - np.min(np.where(self.shown, values, np.inf), axis=0)
            for values in (self.across, self.up)
        ]
        return np.where(self.count >= 2, np.maximum(*spans), np.nan)

    def standard_error(self, offsets: np.ndarray, align: bool) -> np.ndarray:
        """Return the standard error of a line that several strips show, (n,) metres; offsets are `across` or `up`.

        The mean of strips errs as their differences show; a line that follows some of them more than others errs by its
        distance from the mean as well. Away from the place where strips meet, their errors there are the best estimate.
        """
        meeting = self.count >= 2
        if not meeting.any():
            return np.zeros(len(self.t))
        weight = self.shown * self.passes[:, None]
        squares, passes = np.sum(weight * offsets**2, axis=0), weight.sum(axis=0)
        of_mean = np.sqrt(squares[meeting] / (passes * (passes - 1))[meeting])
        share = self.points / np.maximum(self.points.sum(axis=0), 1e-9)
        followed = np.zeros(len(self.t))
        for number, (own, off) in enumerate(zip(offsets, self._off(offsets, align))):
            known = meeting & self.shown[number]
            held = np.interp(self.t, self.t[known], own[known]) if known.any() else np.zeros(len(own))
            followed += share[number] * (held - off)
        return np.hypot(np.interp(self.t, self.t[meeting], of_mean), followed)

    def added_to(self, support: Support, align: bool) -> Support:
        """Add the number of strips, their spread and what they disagree about to the support of the line."""
        error_m = np.interp(support.t, self.t, self.standard_error(self.across, align))
        nearest = np.clip(np.round(support.t / STEP_M - 0.5).astype(int), 0, len(self.t) - 1)
        strips = np.column_stack([np.maximum(self.count, 1)[nearest], self.spread_m[nearest], error_m])
        up_m = np.interp(support.t, self.t, self.standard_error(self.up, align))
        return replace(
            support,
            sigma_m=np.hypot(support.sigma_m, error_m),
            sigmaz_m=np.hypot(support.sigmaz_m, up_m),
            strips=strips,
        )


def measure_strips(points: HeadPoints) -> StripOffsets | None:
    """Measure the offsets of the strips along a line within 3 cm of its rail; None where a single strip shows it."""
    if points.strips is None:
        return None
    if points.apart is not None:
        return _known(points, points.strips, points.apart)
    seen = []
    for strip in np.unique(points.strips[points.strips != UNKNOWN]):
        shown = Shown.by(points[points.strips == strip])
        if shown is not None:
            seen.append((int(strip), shown))
    if len(seen) < 2:
        return None
    t = (np.arange(_steps(points.length_m)) + 0.5) * STEP_M
    across, up, counts = (np.array([getattr(shown, name) for _, shown in seen]) for name in ("across", "up", "points"))
    reach = 2 * int(round(MEETING_M / STEP_M)) + 1
    shown = maximum_filter1d(np.isfinite(across).astype(np.uint8), reach, axis=1, mode="constant") > 0
    away_m = distance_to(t[shown.sum(axis=0) >= 2], t)
    kept = 0.5 + 0.5 * np.cos(np.pi * np.clip(away_m / FADE_M, 0.0, 1.0))
    found = StripOffsets(
        t,
        np.array([strip for strip, _ in seen]),
        kept * _from_mean(across, _third_differences(points.line, t)),
        kept * _from_mean(up, np.zeros(max(len(t) - 3, 0))),
        uniform_filter1d(counts.astype(float), reach, axis=1, mode="constant"),
        shown,
        _without_holes(counts > 0),
        np.ones(len(seen)),
    )
    sharper = not points.is_blunt and head_noise(found.moved(points)) < head_noise(points)
    return found if sharper else replace(found, gathered=np.zeros_like(found.gathered))


def _known(points: HeadPoints, strips: np.ndarray, apart: np.ndarray) -> StripOffsets | None:
    """Return the offsets along a line of strips that are apart alike in the whole cloud; see `RailPoints`."""
    numbers, steps = np.arange(1, len(apart) + 1), _steps(points.length_m)
    t, line = (np.arange(steps) + 0.5) * STEP_M, Polyline(points.line)
    normals = interpolate(line.normals, line.t, t)
    step = np.minimum((points.t / STEP_M).astype(int), steps - 1)
    counts = np.array([np.bincount(step[strips == number], minlength=steps) for number in numbers])
    reach = 2 * int(round(MEETING_M / STEP_M)) + 1
    return StripOffsets(
        t,
        numbers,
        apart[:, :2] @ normals.T,
        np.tile(apart[:, 2:3], steps),
        uniform_filter1d(counts.astype(float), reach, axis=1, mode="constant"),
        maximum_filter1d((counts > 0).astype(np.uint8), reach, axis=1, mode="constant") > 0,
        np.ones(counts.shape, dtype=bool),
        apart[:, 3],
    )


def _without_holes(there: np.ndarray) -> np.ndarray:
    """Fill what a strip misses, (s, n) bool, for less than twice `HOLE_M`."""
    hole = 2 * int(round(HOLE_M / STEP_M)) + 1
    grown = maximum_filter1d(there.astype(np.uint8), hole, axis=1, mode="constant")
    return minimum_filter1d(grown, hole, axis=1, mode="constant", cval=1) > 0


def _steps(length_m: float) -> int:
    return max(int(np.ceil(length_m / STEP_M)), 1)


@dataclass(frozen=True)
class Shown:
    """How one strip shows a line, at n stations `STEP_M` apart.

    `across` and `up`, (n,), are the offset of the middle of the head to the left of the line and the height of its top;
    NaN where it shows none. `points`, (n,), are those on top.
    """

    across: np.ndarray
    up: np.ndarray
    points: np.ndarray

    @classmethod
    def by(cls, strip: HeadPoints) -> Shown | None:
        """Measure the head in the points of one strip; None if it has too few."""
        top, _ = strip.top
        stations, (middle, _) = strip.stations, edge_middles(strip, strip.free)
        steps = _steps(strip.length_m)
        points = np.bincount(np.minimum((strip.t[top] / STEP_M).astype(int), steps - 1), minlength=steps)
        number, known = np.minimum((stations / STEP_M).astype(int), steps - 1), np.isfinite(middle)
        windows = np.bincount(number[known], minlength=steps)
        seen = (points >= MIN_IN_STEP) & (windows > 0)
        if not seen.any():
            return None
        inner = seen & _inner(seen)
        seen = inner if inner.any() else seen
        # The top is as high as on the axis of the head as this strip shows it: the head may lean.
        own = replace(strip, across=strip.across - np.interp(strip.t, stations[known], middle[known]))
        head = own[own.within(0.5)]
        settings = Parameters.crown_radius_m, Parameters.tolerance_z_m, PROFILE_SIGMA_M
        found = find_top(head, *settings) if len(head.t) else None
        if found is None:
            return None
        across = np.bincount(number[known], middle[known], minlength=steps) / np.maximum(windows, 1)
        up = found.course.at((np.arange(steps) + 0.5) * STEP_M)
        return cls(np.where(seen, across, np.nan), np.where(seen, up, np.nan), points)


def _inner(seen: np.ndarray) -> np.ndarray:
    """Return the stations, (n,) bool, that are not at an end of what a strip shows; it may miss some in between."""
    hole, end = (2 * int(round(length / STEP_M)) + 1 for length in (HOLE_M, HOLE_M + END_M))
    whole = maximum_filter1d(seen.astype(np.uint8), hole, mode="constant", cval=1)
    return minimum_filter1d(whole, end, mode="constant", cval=1) > 0


def _third_differences(line: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Return the third differences, (n - 3,) metres to the left, of places `t`, (n,), on a line."""
    if len(t) < 4:
        return np.empty(0)
    own = Polyline(line)
    normals = interpolate(own.normals, own.t, t[1:-1])
    bends = np.einsum("ij,ij->i", np.diff(own.at(t), 2, axis=0), normals)
    return np.diff(bends)


def _from_mean(observed: np.ndarray, third: np.ndarray) -> np.ndarray:
    """Separate what strips show of a rail into the rail and the offset of each strip, (s, n).

    The rail bends as smoothly as rails do, and the offset of a strip changes slowly. Least squares give both, so that
    strips that show the same places, and strips that meet, are treated alike. Given are the position of the rail
    relative to a line at n stations as each strip shows it, (s, n), NaN where it does not, and the third differences of
    that line, (n - 3,).
    """
    count, n = observed.shape
    base = float(np.nanmedian(observed))
    strip, station = np.nonzero(np.isfinite(observed))
    values = observed[strip, station] - base
    size = (count + 1) * n
    rail, own = station * (count + 1), station * (count + 1) + 1 + strip
    rows = np.arange(len(values))
    shown = sparse.csr_matrix(
        (np.ones(2 * len(values)), (np.tile(rows, 2), np.concatenate([rail, own]))), shape=(len(values), size)
    )
    prior, target = _prior(count, n, third)
    weight = np.ones(len(values))
    for _ in range(ROUNDS):
        scaled = sparse.diags(weight / OBSERVED_M**2)
        matrix = (shown.T @ scaled @ shown + prior.T @ prior).tocsc()
        solution = spsolve(matrix, shown.T @ (weight / OBSERVED_M**2 * values) + prior.T @ target)
        residual = np.abs(shown @ solution - values)
        weight = np.minimum(1.0, OUTLIER_SIGMAS * OBSERVED_M / np.maximum(residual, 1e-9))
    return solution.reshape(n, count + 1)[:, 1:].T


def _prior(count: int, n: int, third: np.ndarray) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return the equations, in standard deviations, that say how rails bend and how offsets change."""
    unit = sparse.identity(count + 1, format="csr")
    # The error of a position as a process with two equal roots: it and its rate of change are steady.
    kept = np.exp(-STEP_M / DRIFT_LENGTH_M)
    deviation_m = DRIFT_M * np.sqrt((1 - kept**2) ** 3 / (1 + kept**2))
    change = sparse.diags([kept**2, -2 * kept, 1.0], [0, 1, 2], shape=(max(n - 2, 0), n)) / deviation_m
    rate = sparse.diags([-1.0, 1.0], [0, 1], shape=(min(n - 1, 1), n)) * (DRIFT_LENGTH_M / STEP_M / DRIFT_M)
    change = sparse.vstack([sparse.eye(1, n) / DRIFT_M, rate, change])
    offsets = sparse.kron(change, unit[1:])
    if not len(third):
        level = sparse.kron(sparse.identity(n), unit[:1]) / DRIFT_M
        return sparse.vstack([offsets, level]).tocsr(), np.zeros(offsets.shape[0] + n)
    bends = sparse.diags([-1.0, 3.0, -3.0, 1.0], [0, 1, 2, 3], shape=(n - 3, n)) / IRREGULAR_M
    rail = sparse.kron(bends, unit[:1])
    target = np.concatenate([np.zeros(offsets.shape[0]), -third / IRREGULAR_M])
    return sparse.vstack([offsets, rail]).tocsr(), target


def rows_of(lines: Sequence[np.ndarray], offsets: Sequence[StripOffsets | None]) -> np.ndarray:
    """List the offsets of strips where they meet, given lines, (n, 2) each, and the offsets along each.

    Rows, (k, 7), have x and y of a station, the number of a strip that shows it, its offset in x, y and z, and the
    number of points.
    """
    rows = [np.empty((0, 7))]
    for line, own in zip(lines, offsets):
        if own is None:
            continue
        along = Polyline(line)
        places, normals = along.at(own.t), interpolate(along.normals, along.t, own.t)
        strip, station = np.nonzero(own.shown & (own.count >= 2))
        shift = own.across[strip, station, None] * normals[station]
        columns = places[station], own.strips[strip], shift, own.up[strip, station], own.points[strip, station]
        rows.append(np.column_stack(columns))
    return np.concatenate(rows)


def strip_courses(centerlines: Sequence[Centerline], rows: np.ndarray) -> tuple[StripCourse, ...]:
    """Describe the offsets of strips along tracks, given `heads.strips.rows_of` in their frame, (k, 7)."""
    lines = [one.xyz[:, :2] for one in centerlines]
    feet = project(lines, rows[:, :2], HALF_TRACK_M)
    return tuple(
        course
        for number, one in enumerate(centerlines)
        for course in _courses(one, feet.of(number).t, rows[feet.of(number).point])
    )


def _courses(centerline: Centerline, t: np.ndarray, rows: np.ndarray) -> Iterator[StripCourse]:
    """Average the offsets of each strip along one track."""
    normals = interpolate(centerline.line.normals, centerline.line.t, t)
    across = np.einsum("ij,ij->i", rows[:, 3:5], normals)
    for strip in np.unique(rows[:, 2]):
        mine = rows[:, 2] == strip
        step, number, count = np.unique(np.floor(t[mine] / STEP_M), return_inverse=True, return_counts=True)
        means = [1000 * np.bincount(number, values[mine]) / count for values in (across, rows[:, 5])]
        yield StripCourse(centerline.track_id, int(strip), (step + 0.5) * STEP_M, *means)
