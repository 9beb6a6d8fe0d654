"""Lines of two surveys, or of a survey and a design, compared metre by metre: across, in height, in gauge and in cant.

The constant shift of one survey against the other is found in differences of which some are movements. See
docs/comparison.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from .parameters import ComparisonParameters
from .polyline import Chords, Polyline, cross, runs
from .progress import SILENT, Progress
from .rails import RailLine, cell_borders
from .spread import known, rms, sigma_by_median
from .standards import LEAST_ERROR_M
from .tracks.parallels import most_common_spacing

BOTH, MISSING, EXTRA = "both", "missing", "extra"
"""States of a station: on a line of both surveys, of the reference only, or of the other survey only."""

SKEWED_M = 0.1
"""Largest distance along the track between a place and the nearest place of the other line, metres: more shows that the
other line has ended."""

MAX_SINE = float(np.sin(np.radians(3.0)))
"""Sine of the largest angle between lines that are the same: two measurements of a rail differ in direction by less
than a degree, and most crossings are steeper."""

SURE = 3.0
"""Standard errors of a difference beyond which a track has moved: one in 370 is larger by chance."""

STATIONS_AT_ONCE = 1_000
"""Stations compared between two checks for cancellation."""

MIN_PAIRED_M = 5.0
"""Shortest length of parallel rails that shows their distance."""

STEP_M = 0.05
"""Length of the chords that are compared; a chord of this length deviates from an arc of 25 m by 0.01 mm."""

ASTRAY_M = 0.10
"""Distance from its expected place, relative to the track, at which a line is not the rail of the track."""

SMALLEST_M = 1e-4
"""Differences from the shift below this count alike, metres: it is below the noise of any survey."""

STEPS = 50
"""Steps of the iteration, of which twenty are enough even where a third of the length has moved."""

STRAIGHT = 0.1
"""Smallest ratio of the two singular values of the directions across the tracks from which a shift in both directions
shows: tracks whose direction varies by less than some six degrees show only the shift across."""


@dataclass(frozen=True)
class SurveyedLine:
    """A line of a survey or of a design.

    Attributes
    ----------
    number : int
        Its `rail_id` or `track_id`.
    xyz : (n, 3) array
        Local metres; z is NaN without heights.
    sigma_m, sigmaz_m : float
        Standard errors across and in height; NaN where they are unknown.
    is_rail : bool
        Whether it may be one of the two rails of a track; else it is a centerline.
    name : str
        What the report calls it.
    """

    number: int
    xyz: np.ndarray
    sigma_m: float = np.nan
    sigmaz_m: float = np.nan
    is_rail: bool = True
    name: str = ""


@dataclass(frozen=True)
class Survey:
    """The lines of a survey, and the rails of its tracks where lines are centerlines and gauge and cant are compared.

    `sigma_m` is the standard error, across and in height, of lines that state none; NaN if it is unknown.
    """

    lines: Sequence[SurveyedLine]
    rails: Sequence[RailLine] = ()
    sigma_m: float = np.nan

    def errors_of(self, line: SurveyedLine) -> tuple[float, float]:
        """Return the standard errors of a line across and in height: its own, the stated one, or that of the rails.

        A centerline averages the errors of two rails across; in height, what hides one rail hides the other as well.
        """
        across, height = (
            rms(np.array([getattr(rail, name) for rail in self.rails])) for name in ("sigma_mm", "sigmaz_mm")
        )
        of_rails = across / np.sqrt(2) / 1000, height / 1000
        first, second = (
            next((one for one in (own, self.sigma_m, rail) if np.isfinite(one)), np.nan)
            for own, rail in zip((line.sigma_m, line.sigmaz_m), of_rails)
        )
        return first, second


@dataclass(frozen=True)
class LineDifferences:
    """Differences along one line; (n,) arrays, NaN where unknown. The other survey minus the reference.

    Attributes
    ----------
    line_id : int
        Of the reference; of the other survey where the state is "extra".
    name : str
        Of this line.
    state : object
        "both" or "missing" at stations of a line of the reference; of a line of the other survey "extra", or empty
        where the reference has it.
    input_id : object
        Number of the other survey's line, None without one.
    xyz : (n, 3) array
        Stations, local metres.
    left : (n, 2) array
        Unit vectors to the left there.
    chainage_m : float
        Plan distance from the start of the line.
    across_mm, height_mm : float
        Positive to the left of the reference, and above it.
    gauge_mm, cant_mm : float
        Change of gauge, and of cant, left minus right along the reference.
    sigma_mm, sigmaz_mm : float
        Standard errors of the differences across and in height.
    shift_mm, shiftz_mm : float
        Part of `across_mm` and `height_mm` that is the constant shift.
    moved : bool
        Whether the line has moved by more than `SURE` standard errors.
    """

    line_id: int
    name: str
    state: np.ndarray
    input_id: np.ndarray
    xyz: np.ndarray
    left: np.ndarray
    chainage_m: np.ndarray
    across_mm: np.ndarray
    height_mm: np.ndarray
    gauge_mm: np.ndarray
    cant_mm: np.ndarray
    sigma_mm: np.ndarray
    sigmaz_mm: np.ndarray
    shift_mm: np.ndarray
    shiftz_mm: np.ndarray
    moved: np.ndarray

    @classmethod
    def at(cls, stations: tuple[np.ndarray, np.ndarray, np.ndarray], **known: Any) -> LineDifferences:
        """Return what is known at stations, given as chainages, places and vectors to the left; the rest is NaN."""
        t, places, left = stations
        unknown = {one.name: np.full(len(t), np.nan) for one in fields(cls) if one.name.endswith("_mm")}
        moved = np.zeros(len(t), dtype=bool)
        return cls(xyz=places, left=left, chainage_m=t, moved=moved, **{**unknown, **known})

    @property
    def shifted(self) -> np.ndarray:
        """Whether the constant shift alone exceeds `SURE` standard errors, (n,) bool."""
        across, up = np.abs(self.shift_mm) > SURE * self.sigma_mm, np.abs(self.shiftz_mm) > SURE * self.sigmaz_mm
        return across | up

    @property
    def cells_m(self) -> np.ndarray:
        """Length that each station represents, (n,)."""
        return np.diff(cell_borders(self.chainage_m))

    def length_of(self, which: np.ndarray) -> float:
        """Return the length of the stations that are marked, (n,) bool."""
        return float(self.cells_m[which].sum())

    def sections(self, which: np.ndarray) -> Iterator[tuple[float, float, slice]]:
        """Yield start, end and stations of each run of marked stations."""
        borders = cell_borders(self.chainage_m)
        for first, last in runs(which):
            yield float(borders[first]), float(borders[last + 1]), slice(first, last + 1)


@dataclass(frozen=True)
class TrackComparison:
    """All differences between two surveys.

    There is one line for each line of the reference, then one for each line of the other survey with extra lengths.
    `estimated_m` is the standard error across that the scatter of the differences shows, where lines state none, NaN
    otherwise; `counts_shift` says whether the constant shift counts as a movement.
    """

    lines: tuple[LineDifferences, ...]
    shift: Shift
    estimated_m: float
    counts_shift: bool

    def length_of(self, state: str) -> float:
        """Return the length in a state, metres."""
        return sum(line.length_of(line.state == state) for line in self.lines)

    @property
    def moved_m(self) -> float:
        """Length that has moved, metres."""
        return sum(line.length_of(line.moved) for line in self.lines)

    def values(self, name: str) -> np.ndarray:
        """Return the known values of a field at all stations, (k,)."""
        every = np.concatenate([getattr(line, name) for line in self.lines] or [np.empty(0)])
        return every[np.isfinite(every)]


def doubts_of(found: TrackComparison) -> list[str]:
    """Return what the user is warned of: nothing in common, or standard errors that no survey states."""
    if not found.values("across_mm").size:
        return ["The two surveys have no line in common: check that they are of the same place, and REACH."]
    if not np.isfinite(found.estimated_m):
        return []
    return [
        "A survey has no standard errors: the scatter of the differences is used instead, "
        f"{1000 * found.estimated_m:.1f} mm across. Fill in REFERENCE_SIGMA and INPUT_SIGMA if it is known."
    ]


def compare_surveys(
    reference: Survey, other: Survey, settings: ComparisonParameters, progress: Progress = SILENT
) -> TrackComparison:
    """Compare the lines of a survey with those of a reference, in the same frame, at equal distances.

    A line of the other survey counts as the same where it is nearest to the reference's line, within reach, and the
    reference's line is in turn the nearest to it: a branch that is missing is not compared with the track beside it.
    """
    own, others = (cut([line.xyz for line in survey.lines]) for survey in (reference, other))
    chords = own, others
    gauges = _Gauges.of(reference, other, chords)
    lines = [
        _compare(line, number, chords, other, gauges, settings, progress)
        for number, line in enumerate(progress.span(0, 0.8).follow(reference.lines))
    ]
    every = [np.concatenate([getattr(one, name) for one in lines]) for name in ("across_mm", "height_mm", "left")]
    shift = find_shift(every[0] / 1000, every[1] / 1000, every[2])
    lines = [_without_shift(one, shift) for one in lines]
    scatter_m = [_scatter(lines, *names) for names in (("across_mm", "shift_mm"), ("height_mm", "shiftz_mm"))]
    ours_m = [reference.errors_of(line) for line in reference.lines]
    estimated = any(map(_is_estimated, lines, ours_m))
    lines = [_judged(*one, scatter_m, settings.ignore_shift) for one in zip(lines, ours_m)]
    extra = [
        _extra(line, number, chords, settings, progress)
        for number, line in enumerate(progress.span(0.8, 1).follow(other.lines))
    ]
    estimate_m = scatter_m[0] if estimated else np.nan
    return TrackComparison((*lines, *filter(None, extra)), shift, estimate_m, not settings.ignore_shift)


def _stations(line: np.ndarray, step_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return chainages, (n,), places, (n, 3), and unit vectors to the left, (n, 2); the last is the line's end."""
    own = Polyline(line)
    t = np.append(np.arange(max(round(own.length_m / step_m), 1)) * step_m, own.length_m)
    return t, own.at(t), own.left_at(t)


def _parts(count: int, progress: Progress) -> Iterator[slice]:
    """Yield the stations in parts; before each, check for cancellation."""
    for start in range(0, count, STATIONS_AT_ONCE):
        progress.check()
        yield slice(start, start + STATIONS_AT_ONCE)


def _paired(
    places: np.ndarray, left: np.ndarray, number: int, chords: tuple[Chords, Chords], reach_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the places on the other survey's lines, (n, 3), NaN without one, and the numbers of these lines, (n,)."""
    own, others = chords
    if not len(others.xyz):
        return np.full((len(places), 3), np.nan), np.full(len(places), -1)
    feet, chord = others.nearest(places)
    step = (feet - places)[:, :2]
    across = np.sum(step * left, axis=1)
    along = np.abs(cross(left, step))
    _, back = own.nearest(feet)
    course = others.step[chord, :2]
    parallel = np.abs(np.sum(course * left, axis=1)) <= MAX_SINE * np.linalg.norm(course, axis=1)
    same = parallel & (np.abs(across) <= reach_m) & (along <= SKEWED_M) & (own.number[back] == number)
    return np.where(same[:, None], feet, np.nan), np.where(same, others.number[chord], -1)


def _compare(
    line: SurveyedLine,
    number: int,
    chords: tuple[Chords, Chords],
    other: Survey,
    gauges: _Gauges,
    settings: ComparisonParameters,
    progress: Progress,
) -> LineDifferences:
    """Compare one line of the reference; standard errors are those of the other survey's lines as yet."""
    t, places, left = _stations(line.xyz, settings.step_m)
    parts = []
    for part in _parts(len(t), progress):
        feet, found = _paired(places[part], left[part], number, chords, settings.reach_m)
        step = feet - places[part]
        parts.append((step, found, *gauges.differences(line, places[part, :2], left[part], step[:, :2])))
    step, found, gauge_m, cant_m = (np.concatenate(column) for column in zip(*parts))
    ids, errors_m = np.full(len(t), None, dtype=object), np.full((len(t), 2), np.nan)
    for one in set(found[found >= 0].tolist()):
        ids[found == one], errors_m[found == one] = other.lines[one].number, other.errors_of(other.lines[one])
    return LineDifferences.at(
        (t, places, left),
        line_id=line.number,
        name=line.name,
        state=np.where(found < 0, MISSING, BOTH).astype(object),
        input_id=ids,
        across_mm=1000 * np.sum(step[:, :2] * left, axis=1),
        height_mm=1000 * step[:, 2],
        gauge_mm=1000 * gauge_m,
        cant_mm=1000 * cant_m,
        sigma_mm=1000 * errors_m[:, 0],
        sigmaz_mm=1000 * errors_m[:, 1],
    )


def _without_shift(line: LineDifferences, shift: Shift) -> LineDifferences:
    """State the part of the differences that is the constant shift."""
    known = line.state == BOTH
    across = np.where(known, 1000 * line.left @ shift.plan_m, np.nan)
    return replace(line, shift_mm=across, shiftz_mm=np.where(known, 1000 * shift.up_m, np.nan))


def _scatter(lines: Sequence[LineDifferences], value: str, shift: str) -> float:
    """Return the standard error that the differences show apart from the shift, metres: robust against movements."""
    rest = np.concatenate([getattr(line, value) - getattr(line, shift) for line in lines])
    rest = known(rest)
    return max(sigma_by_median(rest) / 1000, LEAST_ERROR_M) if len(rest) else np.nan


def _judged(
    line: LineDifferences, ours_m: tuple[float, float], scatter_m: Sequence[float], ignore_shift: bool
) -> LineDifferences:
    """Add the standard errors of the reference to those of the other survey, and mark what has moved.

    Where one of them is unknown, the scatter of the differences stands for both.
    """
    both, errors, moved = line.state == BOTH, [], np.zeros(len(line.moved), dtype=bool)
    columns = ((line.sigma_mm, line.across_mm, line.shift_mm), (line.sigmaz_mm, line.height_mm, line.shiftz_mm))
    for (theirs, value, shift), own_m, estimate_m in zip(columns, ours_m, scatter_m):
        stated = np.hypot(theirs, 1000 * own_m)
        estimate = np.fmax(np.fmax(theirs, 1000 * own_m), 1000 * estimate_m)
        error = np.where(both, np.where(np.isfinite(stated), stated, estimate), np.nan)
        moved |= np.abs(value - ignore_shift * np.nan_to_num(shift)) > SURE * error
        errors.append(error)
    return replace(line, sigma_mm=errors[0], sigmaz_mm=errors[1], moved=moved)


def _is_estimated(line: LineDifferences, ours_m: tuple[float, float]) -> bool:
    """Return whether a survey states no standard error across for part of a line."""
    return bool((np.isnan(line.sigma_mm + ours_m[0]) & (line.state == BOTH)).any())


def _extra(
    line: SurveyedLine, number: int, chords: tuple[Chords, Chords], settings: ComparisonParameters, progress: Progress
) -> LineDifferences | None:
    """Return the stations of a line of the other survey that the reference does not have; None if it has all."""
    t, places, left = _stations(line.xyz, settings.step_m)
    turned = chords[1], chords[0]
    parts = _parts(len(t), progress)
    found = np.concatenate([_paired(places[p], left[p], number, turned, settings.reach_m)[1] for p in parts])
    if (found >= 0).all():
        return None
    return LineDifferences.at(
        (t, places, left),
        line_id=line.number,
        name=line.name,
        state=np.where(found < 0, EXTRA, "").astype(object),
        input_id=np.full(len(t), line.number, dtype=object),
    )


@dataclass(frozen=True)
class _Gauges:
    """The rails of both surveys, and the distance of the two rails of most tracks; None if it is unknown."""

    chords: tuple[Chords, Chords]
    spacing_m: float | None

    @classmethod
    def of(cls, reference: Survey, other: Survey, chords: tuple[Chords, Chords]) -> _Gauges:
        """Take the rails of the surveys, or their lines if these may be rails."""
        if reference.rails and other.rails:
            before, after = (cut([rail.xyz for rail in survey.rails]) for survey in (reference, other))
            return cls((before, after), most_common_spacing(reference.rails, MIN_PAIRED_M))
        if not all(line.is_rail for line in (*reference.lines, *other.lines)):
            return cls(chords, None)
        lines = [RailLine(line.xyz, line.number, 0, 0, np.nan, np.nan, np.nan) for line in reference.lines]
        return cls(chords, most_common_spacing(lines, MIN_PAIRED_M))

    def differences(
        self, line: SurveyedLine, places: np.ndarray, left: np.ndarray, step: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the changes of gauge and cant at stations of a line, (n,) metres each, given the step to the other."""
        changes = np.full((len(places), 2), np.nan)
        if self.spacing_m is None:
            return changes[:, 0], changes[:, 1]
        for to_left, to_right in ((0.5, 0.5),) if not line.is_rail else ((0.0, 1.0), (1.0, 0.0)):
            to_left_m, to_right_m = to_left * self.spacing_m * left, to_right * self.spacing_m * left
            before = spacing_and_cant(places + to_left_m, places - to_right_m, self.chords[0])
            known = np.isfinite(step[:, 0]) & np.isnan(changes[:, 0])
            moved = places + np.nan_to_num(step)
            after = spacing_and_cant(moved + to_left_m, moved - to_right_m, self.chords[1])
            changes = np.where(known[:, None], after - before, changes)
        return changes[:, 0], changes[:, 1]


def cut(lines: Sequence[np.ndarray]) -> Chords:
    """Cut lines, (n, 3) each, into chords of equal length, at most `STEP_M`."""
    return Chords.of([Polyline(line) for line in lines], STEP_M)


def spacing_and_cant(left: np.ndarray, right: np.ndarray, rails: Chords) -> np.ndarray:
    """Measure the distance in space of the two rails of a track, and the height of the left one above the right one.

    The rails are expected at `left` and `right`, (n, 2) metres, and found in the chords of all rails. Returns (n, 2)
    metres; NaN where a rail is missing.
    """
    sides = []
    for place in (left, right):
        feet, _ = rails.nearest(place)
        astray = ~(np.linalg.norm(feet[:, :2] - place, axis=1) <= ASTRAY_M)
        sides.append(np.where(astray[:, None], np.nan, feet))
    step = sides[0] - sides[1]
    plan = np.hypot(step[:, 0], step[:, 1])
    return np.column_stack([np.hypot(plan, np.nan_to_num(step[:, 2])), step[:, 2]])


@dataclass(frozen=True)
class Shift:
    """A constant shift of the later survey, metres.

    `plan_m` is east and north; for tracks of one direction, the part across them, so that `both` is false. `up_m` is
    NaN without heights.
    """

    plan_m: np.ndarray
    up_m: float
    both: bool


def find_shift(across_m: np.ndarray, height_m: np.ndarray, left: np.ndarray) -> Shift:
    """Find the shift that most of the length shares: that with the smallest sum of absolute differences.

    Differences across, positive to the left, and in height are (n,) metres, NaN where unknown; `left`, (n, 2), holds
    unit vectors to the left. Up to half of the length may have moved without effect on the shift.
    """
    known = np.isfinite(across_m)
    values = np.linalg.svd(left[known], compute_uv=False) if known.any() else np.zeros(2)
    plan_m = _least_absolute(left[known], across_m[known]) if known.any() else np.zeros(2)
    heights = height_m[np.isfinite(height_m)]
    both = bool(len(values) > 1 and values[1] >= STRAIGHT * values[0] > 0)
    return Shift(plan_m, float(np.median(heights)) if len(heights) else np.nan, both)


def _least_absolute(rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Solve rows @ x = values for the smallest sum of absolute residuals, by weights of their reciprocals."""
    weight = np.ones(len(values))
    x: np.ndarray = np.zeros(rows.shape[1])
    for _ in range(STEPS):
        x, *_ = np.linalg.lstsq(rows * weight[:, None], values * weight, rcond=STRAIGHT)
        weight = 1 / np.sqrt(np.maximum(np.abs(values - rows @ x), SMALLEST_M))
    return x
