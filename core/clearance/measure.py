"""Measure clearance: the pass over the cloud, the sections, and what they show together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..clouds.points import Request
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from ..rails import Kilometres
from ..run.loop import Runner
from ..run.tasks import Task
from ..tiles.grid import Key
from ..tiles.store import files_of
from .frame import Course
from .intrusions import VEHICLE_WORDS, Intrusion, intrusions_of
from .neighbours import Side, near, neighbours
from .platforms import Platform, platforms_of
from .profiles import NO_RULE
from .section import BANDS_M, Section, measure_section, read_points, third_least
from .settings import LEAVE_OUT, Settings
from .sweep import HALO_M, SECTION_M, Swept, sweep
from .widening import EBO, widening
from .wires import Wire, wires_of

MEASURE_S = 3e-6
"""Run time of a section per point, in seconds."""

PICTURES, SLICE_M, MOST_DRAWN = 20, 0.25, 4000
"""Cross-sections that are kept for the report, the half length of their points along the track, and the most points of
each."""

UNSEEN_POINTS, UNSEEN_SHARE = 50.0, 0.10
"""Points per metre within reach below which nothing can be judged, and the share of the length on which that is so."""


@dataclass(frozen=True)
class Stations:
    """Stations of a track; (n,) arrays, NaN where nothing is seen.

    `wide_m`, (n, 2), is the widening on the left and on the right. `aside_m` and `margin_m`, (n, 2, 5), are those of the
    third nearest point, by side, left first, and band.
    """

    course: Course
    s: np.ndarray
    xyz: np.ndarray
    wide_m: np.ndarray
    aside_m: np.ndarray
    margin_m: np.ndarray
    points: np.ndarray
    left: Side
    right: Side
    kilometres: Kilometres | None = None

    @property
    def least_m(self) -> np.ndarray:
        """Least margin on the left and on the right, (n, 2)."""
        return np.min(np.where(np.isfinite(self.margin_m), self.margin_m, np.inf), axis=2)


@dataclass(frozen=True)
class CrossSection:
    """The points around the worst place of an intrusion: v, w, and class, (n,) each."""

    intrusion: Intrusion
    v: np.ndarray
    w: np.ndarray
    code: np.ndarray
    wide_m: tuple[float, float]


@dataclass(frozen=True)
class Clearance:
    """All that was measured; `frame` has its origin at the zero of the coordinate system."""

    settings: Settings
    frame: LocalFrame
    courses: tuple[Course, ...]
    intrusions: tuple[Intrusion, ...]
    stations: tuple[Stations, ...]
    platforms: tuple[Platform, ...]
    wires: tuple[Wire, ...]
    sections: tuple[CrossSection, ...]
    vehicle: tuple[tuple[int, float, float, float], ...]
    swept: Swept
    warnings: tuple[str, ...] = field(default=())

    @property
    def sure(self) -> list[Intrusion]:
        """Objects that are surely inside and not known to be allowed there."""
        return [one for one in self.intrusions if one.counts]

    @property
    def least_margin_m(self) -> float:
        """Least margin: that of the deepest sure object, else the least of all stations; NaN if nothing is seen."""
        if self.sure:
            return -max(one.pen_mm for one in self.sure) / 1000
        known = [one.least_m[np.isfinite(one.least_m)] for one in self.stations]
        known = [one for one in known if len(one)]
        return max(float(min(one.min() for one in known)), 0.0) if known else np.nan

    @property
    def point_count(self) -> int:
        """Points within reach."""
        return int(sum(one.points.sum() for one in self.stations))

    def unseen(self, stations: Stations) -> np.ndarray:
        """Return which stations, (n,), have too few points around them to judge anything."""
        return stations.points < UNSEEN_POINTS * self.settings.step_m


def measure(
    request: Request,
    courses: Sequence[Course],
    settings: Settings,
    folder: Path,
    runner: Runner,
    progress: Progress = SILENT,
) -> Clearance:
    """Measure the clearance along tracks; the folder is for the points, and the caller removes it."""
    courses = [_widened(course, settings) for course in courses]
    reading, measuring = progress.divide((1.0, 2.0))
    progress.status("Reading the points along the tracks")
    request.announce(progress)
    swept = sweep(request, courses, settings, folder, runner, reading)
    progress.status("Measuring the clearance")
    found: dict[Key, Section] = dict(runner.run(_tasks(courses, swept, settings), measuring))
    tracks = [[found[key] for key in sorted(found) if key[0] == at] for at in range(len(courses))]
    objects = intrusions_of(courses, [[part for one in own for part in one.parts] for own in tracks])
    if settings.trains == LEAVE_OUT:
        objects = [one for one in objects if not one.what.startswith(VEHICLE_WORDS.format(""))]
    return Clearance(
        settings,
        request.zero,
        tuple(courses),
        tuple(objects),
        tuple(_stations(courses, at, swept, own, settings) for at, own in enumerate(tracks)),
        tuple(one for at, own in enumerate(tracks) for one in platforms_of(at, _rows([each.edges for each in own], 6))),
        tuple(one for at, own in enumerate(tracks) for one in wires_of(at, _rows([each.nodes for each in own], 4))),
        tuple(_cross_section(one, courses[one.course], swept, settings) for one in objects[:PICTURES]),
        tuple((at, *cell) for at, own in enumerate(tracks) for one in own for cell in one.vehicle),
        swept,
    )


def _widened(course: Course, settings: Settings) -> Course:
    """Return a course with the widening of the profile."""
    if settings.widening != EBO or settings.profile.rule == NO_RULE:
        return course
    return replace(course, wide_m=widening(course.curvature, course.gauge_m, settings.profile.rule, course.step_m))


def _tasks(courses: Sequence[Course], swept: Swept, settings: Settings) -> dict[Key, Task]:
    """Return the tasks that measure the sections."""
    tasks = {}
    for (at, section), count in sorted(swept.sections.items()):
        own = _part(courses[at], section)
        others = (near(own, other) for number, other in enumerate(courses) if number != at)
        arguments = ([own, *filter(None, others)], section, _files(swept, at, section), settings)
        label = f"The section {section} of track {own.track_id}"
        tasks[at, section] = Task(label, measure_section, arguments, weight=MEASURE_S * count)
    return tasks


def _files(swept: Swept, at: int, section: int) -> list[list[str]]:
    """Return the files of the section before, the section, and the one after it."""
    return [files_of((at, section + off), swept.files) for off in (-1, 0, 1)]


def _part(course: Course, section: int) -> Course:
    """Return the stations of a section with its halo."""
    low = int(np.floor((section * SECTION_M - HALO_M) / course.step_m)) - 1
    high = int(np.ceil(((section + 1) * SECTION_M + HALO_M) / course.step_m)) + 2
    return course.part(max(low, 0), min(high, len(course.xyz)))


def _rows(parts: Sequence[np.ndarray], columns: int) -> np.ndarray:
    """Return the rows of all sections, (n, columns)."""
    return np.concatenate([np.empty((0, columns)), *parts])


def _stations(
    courses: Sequence[Course], at: int, swept: Swept, sections: Sequence[Section], settings: Settings
) -> Stations:
    """Return the stations of a track."""
    course = courses[at]
    s = settings.step_m * np.arange(int(course.length_m / settings.step_m) + 1)
    shape = len(s), 2, len(BANDS_M)
    aside, margin = (
        third_least([getattr(one, name) for one in sections], int(np.prod(shape))).reshape(shape)
        for name in ("aside", "margin")
    )
    borders = np.append(s - settings.step_m / 2, s[-1] + settings.step_m / 2)
    passed = np.interp(borders, course.s + course.step_m / 2, swept.passed(at, course), left=0.0)
    points = np.rint(np.diff(passed)).astype(np.int64)
    nearest = course.station(s)
    left, right = (
        Side(*(column[nearest] for column in vars(one).values())) for one in neighbours(courses, at, settings)
    )
    return Stations(course, s, course.at(s, course.xyz), course.wide_m[nearest], aside, margin, points, left, right)


def _cross_section(one: Intrusion, course: Course, swept: Swept, settings: Settings) -> CrossSection:
    """Return the points around the worst place of an intrusion."""
    section = int(one.chainage_m // SECTION_M)
    points = read_points(_part(course, section), section, _files(swept, one.course, section), settings)
    near = np.flatnonzero(np.abs(points.place[:, 0] - one.chainage_m) <= SLICE_M)
    near = near[:: max(len(near) // MOST_DRAWN, 1)]
    left_m, right_m = course.wide_m[course.station(np.array([one.chainage_m]))][0].tolist()
    return CrossSection(one, *points.place[near, 1:].T, points.code[near], (left_m, right_m))
