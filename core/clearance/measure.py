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
from ..tiles.store import counts_of
from .along import Trace
from .frame import Course
from .intrusions import VEHICLE_WORDS, Intrusion, intrusions_of
from .neighbours import Side, near, neighbours
from .platforms import platforms_of
from .section import BANDS_M, Section, measure_section, third_least
from .settings import LEAVE_OUT, Settings
from .sweep import Swept, part_of, sweep
from .widening import EBO, widening
from .wires import wires_of

MEASURE_S = 3e-6
"""Run time of a section per point, in seconds."""

UNSEEN_POINTS, UNSEEN_SHARE = 50.0, 0.10
"""Points per metre within reach below which nothing can be judged, and the share of the length on which that is so."""


@dataclass(frozen=True)
class Stations:
    """Stations of a track; (n,) arrays, NaN where nothing is seen.

    `wide_m`, (n, 2), is the widening on the left and on the right. `aside_m` and `margin_m`, (n, 2, 5), are of the
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
class Clearance:
    """All that was measured; `frame` has its origin at the zero of the coordinate system.

    `vehicle` has the number of the track and the section of the places where the vehicle of the scanner was left out.
    """

    settings: Settings
    frame: LocalFrame
    courses: tuple[Course, ...]
    intrusions: tuple[Intrusion, ...]
    stations: tuple[Stations, ...]
    platforms: tuple[Trace, ...]
    wires: tuple[Trace, ...]
    vehicle: tuple[Key, ...]
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
        least_m = min((float(one.least_m.min()) for one in self.stations), default=np.inf)
        return max(least_m, 0.0) if np.isfinite(least_m) else np.nan

    @property
    def point_count(self) -> int:
        """Points within reach."""
        return int(sum(map(np.sum, self.swept.seen)))

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
    reading, measuring = progress.divide((1.0, 2.0))
    progress.status("Reading the points along the tracks")
    request.announce(progress)
    swept = sweep(request, courses, settings, folder, runner, reading)
    progress.status("Measuring the clearance")
    if settings.widening == EBO:
        rule = settings.profile.rule
        courses = [replace(one, wide_m=widening(one.curvature, one.gauge_m, rule, one.step_m)) for one in courses]
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
        tuple(one for at, own in enumerate(tracks) for one in platforms_of(at, _rows([each.edges for each in own]))),
        tuple(one for at, own in enumerate(tracks) for one in wires_of(at, _rows([each.nodes for each in own]))),
        tuple(key for key, one in sorted(found.items()) if one.has_vehicle),
        swept,
    )


def _tasks(courses: Sequence[Course], swept: Swept, settings: Settings) -> dict[Key, Task]:
    """Return the tasks that measure the sections."""
    tasks = {}
    for (at, section), count in sorted(counts_of(swept.files).items()):
        own = part_of(courses[at], section)
        others = (near(own, other) for number, other in enumerate(courses) if number != at)
        arguments = ([own, *filter(None, others)], section, swept.files_around(at, section), settings)
        label = f"The section {section} of track {own.track_id}"
        tasks[at, section] = Task(label, measure_section, arguments, weight=MEASURE_S * count)
    return tasks


def _rows(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Return the rows of all sections, (n, 5)."""
    return np.concatenate([np.empty((0, 5)), *parts])


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
    passed = np.interp(borders, course.s + course.step_m / 2, np.cumsum(swept.seen[at]), left=0.0)
    points = np.rint(np.diff(passed)).astype(np.int64)
    nearest = course.station(s)
    left, right = (
        Side(*(column[nearest] for column in vars(one).values())) for one in neighbours(courses, at, settings)
    )
    return Stations(course, s, course.at(s, course.xyz), course.wide_m[nearest], aside, margin, points, left, right)
