"""Measure clearance: the pass over the cloud, the sections, and what they show together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
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
from .neighbours import EBO_DISTANCE_M, REACH_M, Side, neighbours
from .outline import Outline
from .platforms import Platform, platforms_of
from .profiles import NO_RULE, Profile
from .section import BANDS_M, Least, Rules, Section, measure_section, read_points
from .sweep import BESIDE_M, HALO_M, LEAST_REACH_M, SECTION_M, Plan, Swept, counted, sections_of, sweep
from .widening import EBO, widening
from .wires import Nodes, Wire, wires_of

MARK, LEAVE_OUT = TRAINS = ("MARK", "LEAVE_OUT")
"""Choices of TRAINS: name vehicles on tracks, or omit them."""

MEASURE_S = 3e-6
"""Run time of a section per point, in seconds."""

PICTURES, SLICE_M, MOST_DRAWN = 20, 0.25, 4000
"""Cross-sections that are kept for the report, the half length of their points along the track, and the most points of
each."""

UNSEEN_POINTS, UNSEEN_SHARE = 50.0, 0.10
"""Points per metre within reach below which nothing can be judged, and the share of the length on which that is so."""


@dataclass(frozen=True)
class Settings:
    """What is measured.

    Attributes
    ----------
    profile : Profile
    margin_m, floor_m, step_m : float
    widening : str
        One of `widening.RULES`.
    distance_m : float or None
        Least distance of tracks; None for that of the profile's rules.
    left_out : tuple of int
        Classes that count nowhere.
    trains : str
        One of `TRAINS`.
    """

    profile: Profile
    margin_m: float = 0.0
    floor_m: float = 0.08
    step_m: float = 1.0
    widening: str = "NONE"
    distance_m: float | None = None
    left_out: tuple[int, ...] = ()
    trains: str = MARK

    @property
    def least_distance_m(self) -> float:
        """Least distance of tracks; NaN where nothing is judged."""
        if self.distance_m is not None:
            return self.distance_m
        return EBO_DISTANCE_M if self.profile.is_of_ebo else np.nan

    @property
    def reach_m(self) -> float:
        """How far aside of the track points are kept."""
        return max(self.profile.half_width_m + self.margin_m + BESIDE_M, LEAST_REACH_M)


@dataclass(frozen=True)
class Stations:
    """Stations of a track; (n,) arrays, NaN where nothing is seen.

    Attributes
    ----------
    xyz : (n, 3) array
    wide_m : (n, 2) array
        Widening on the left and on the right.
    aside_m, margin_m : (n, 2, 5) arrays
        Of the third nearest point, by side, left first, and band.
    left, right : Side
        Neighbour tracks at these stations.
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
    """Measure the clearance along tracks.

    Parameters
    ----------
    folder : Path
        For the points; the caller removes it.
    """
    plan = Plan(tuple(courses), settings.reach_m, settings.floor_m, settings.left_out)
    reading, measuring = progress.divide((1.0, 2.0))
    progress.status("Reading the points along the tracks")
    request.announce(progress)
    swept = sweep(request, plan, folder, runner, reading)
    progress.status("Measuring the clearance")
    wide = [_widened(course, settings) for course in courses]
    tasks = _tasks(plan, swept, settings, wide)
    found: dict[Key, Section] = dict(runner.run(tasks, measuring))
    platforms = [one for at in range(len(courses)) for one in platforms_of(at, _edges(found, at))]
    wires = [one for at in range(len(courses)) for one in wires_of(at, _nodes(found, at))]
    objects = intrusions_of(courses, {key: one.parts for key, one in found.items()})
    if settings.trains == LEAVE_OUT:
        objects = [one for one in objects if not one.what.startswith(VEHICLE_WORDS.format(""))]
    return Clearance(
        settings,
        request.zero,
        tuple(courses),
        tuple(objects),
        tuple(_stations(courses, at, swept, found, settings, wide[at]) for at in range(len(courses))),
        tuple(platforms),
        tuple(wires),
        tuple(_cross_section(one, courses, swept, settings, wide) for one in objects[:PICTURES]),
        tuple((key[0], *cell) for key, one in sorted(found.items()) for cell in one.vehicle),
        swept,
    )


def _widened(course: Course, settings: Settings) -> np.ndarray:
    """Return the widening at the stations of a course, (n, 2)."""
    if settings.widening != EBO or settings.profile.rule == NO_RULE:
        return np.zeros((len(course.xyz), 2))
    return widening(course.curvature, course.gauge_m, settings.profile.rule, course.step_m)


def _rules(course: Course, wide: np.ndarray, settings: Settings) -> Rules:
    """Return what is measured along a part of a course with its widening."""
    return Rules(Outline(settings.profile, settings.floor_m), settings.margin_m, wide, settings.step_m)


def _tasks(plan: Plan, swept: Swept, settings: Settings, wide: Sequence[np.ndarray]) -> dict[Key, Task]:
    """Return the tasks that measure the sections."""
    count, tasks = counted(swept), {}
    for at, section in sections_of(swept):
        course = plan.courses[at]
        low, high = _stations_of(course, section)
        own = course.part(low, high)
        around = [own, *(part for other in plan.courses if other is not course for part in _near(own, other))]
        files = _files(swept, at, section)
        arguments = (around, section, files, _rules(own, wide[at][low:high], settings))
        label = f"The section {section} of track {course.track_id}"
        tasks[at, section] = Task(label, measure_section, arguments, weight=MEASURE_S * count[at, section])
    return tasks


def _files(swept: Swept, at: int, section: int) -> list[list[str]]:
    """Return the files of the section before, the section, and the one after it."""
    return [files_of((at, section + off), swept.files) for off in (-1, 0, 1)]


def _stations_of(course: Course, section: int) -> tuple[int, int]:
    """Return the first station of a section with its halo, and the one after its last."""
    low = int(np.floor((section * SECTION_M - HALO_M) / course.step_m)) - 1
    high = int(np.ceil(((section + 1) * SECTION_M + HALO_M) / course.step_m)) + 2
    return max(low, 0), min(high, len(course.xyz))


def _near(own: Course, other: Course) -> list[Course]:
    """Return the part of another course that is near a part of a track; nothing if none is."""
    low, high = own.xyz[:, :2].min(axis=0) - REACH_M, own.xyz[:, :2].max(axis=0) + REACH_M
    inside = np.flatnonzero(((other.xyz[:, :2] >= low) & (other.xyz[:, :2] <= high)).all(axis=1))
    return [other.part(int(inside[0]), int(inside[-1]) + 1)] if len(inside) > 1 else []


def _edges(found: Mapping[Key, Section], at: int) -> list:
    return [edge for key, one in sorted(found.items()) if key[0] == at for edge in one.edges]


def _nodes(found: Mapping[Key, Section], at: int) -> Nodes:
    return Nodes.joined([one.nodes for key, one in sorted(found.items()) if key[0] == at])


def _stations(
    courses: Sequence[Course], at: int, swept: Swept, found: Mapping[Key, Section], settings: Settings, wide: np.ndarray
) -> Stations:
    """Return the stations of a track."""
    course = courses[at]
    s = settings.step_m * np.arange(int(course.length_m / settings.step_m) + 1)
    bands = np.full((2, len(s) * 2 * len(BANDS_M)), np.nan)
    borders = np.append(s - settings.step_m / 2, s[-1] + settings.step_m / 2)
    passed = np.interp(borders, course.s + course.step_m / 2, np.cumsum(swept.seen[at]), left=0.0)
    points = np.rint(np.diff(passed)).astype(np.int64)
    mine = [one for key, one in sorted(found.items()) if key[0] == at]
    if mine:
        least = Least.joined([one.least for one in mine])
        inside = least.cell < bands.shape[1]
        for row, values in zip(bands, (least.aside_m, least.margin_m)):
            row[least.cell[inside]] = np.where(np.isfinite(values[inside, -1]), values[inside, -1], np.nan)
    aside, margin = bands.reshape(2, len(s), 2, len(BANDS_M))
    sides = neighbours(courses, at, settings.least_distance_m, settings.profile.is_of_ebo)
    nearest = course.station(s)
    left, right = (Side(*(column[nearest] for column in vars(one).values())) for one in sides)
    return Stations(course, s, course.at(s, course.xyz), wide[nearest], aside, margin, points, left, right)


def _cross_section(
    one: Intrusion, courses: Sequence[Course], swept: Swept, settings: Settings, wide: Sequence[np.ndarray]
) -> CrossSection:
    """Return the points around the worst place of an intrusion."""
    section = int(one.chainage_m // SECTION_M)
    course = courses[one.course]
    low, high = _stations_of(course, section)
    part = course.part(low, high)
    points = read_points(
        part, section, _files(swept, one.course, section), _rules(part, wide[one.course][low:high], settings)
    )
    near = np.flatnonzero(np.abs(points.s - one.chainage_m) <= SLICE_M)
    near = near[:: max(len(near) // MOST_DRAWN, 1)]
    sides = wide[one.course][course.station(np.array([one.chainage_m]))][0]
    return CrossSection(one, points.v[near], points.w[near], points.code[near], (float(sides[0]), float(sides[1])))
