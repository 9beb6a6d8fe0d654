"""Measure clearance: the pass over the cloud, what each section shows, and what the sections show together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..clouds.points import Request
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from ..rails import Kilometres
from ..run.tasks import Context, Runner, Task
from ..tiles.grid import Key
from ..tiles.store import counts_of, read_stored
from .along import LIVE_M, Trace, away, edges_of, nodes_of, on_platforms, platforms_of, wires_of
from .frame import Course
from .intrusions import (
    OTHER,
    PLATFORM,
    VEHICLE_WORDS,
    WIRE,
    Intrusion,
    Part,
    Points,
    intrusions_of,
    own_vehicle,
    parts_of,
)
from .neighbours import Side, near, neighbours
from .settings import EBO, LEAVE_OUT, Settings, widening
from .sweep import HALO_M, POINT, SECTION_M, Swept, part_of, sweep

MEASURE_S = 3e-6
"""Run time of a section per point, in seconds."""

UNSEEN_POINTS, UNSEEN_SHARE = 50.0, 0.10
"""Points per metre within reach below which nothing can be judged, and the share of the length on which that is so."""

BANDS_M = (0.380, 1.170, 3.250, 4.310, 7.000)
"""Upper ends of the height bands: feet of profiles and platforms, bodies, upper corners, roofs, pantographs."""

THIRD = 3
"""The third nearest point of a station and band counts: one or two stray points do not."""

MOST_POINTS, FINE_M = 2_000_000, 0.01
"""Points of a section above which only the deepest of each cell is kept, with their number, and the side of these
cells: a surface that is fitted has hundreds of them."""

PIECE_M = 10.0
"""Length of the pieces in which points are put in order, so that a run is cancelled between them."""

Least = tuple[np.ndarray, np.ndarray]
"""Numbers of cells and the `THIRD` least values in each, rising. A cell is a station, side and band: ten times the
station, plus the band, plus five on the right."""


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


@dataclass(frozen=True)
class Section:
    """What a section shows: least distances from the middle and margins, metres, and parts of objects.

    `edges` and `nodes` are rows of `edges_of` and of `nodes_of`; `has_vehicle` says whether the vehicle
    of the scanner was left out.
    """

    aside: Least
    margin: Least
    edges: np.ndarray
    nodes: np.ndarray
    parts: list[Part]
    has_vehicle: bool


def measure_section(
    courses: Sequence[Course], section: int, files: Sequence[Sequence[str]], settings: Settings, context: Context
) -> Section:
    """Measure a section; a task.

    Given are the track and those around it, and the files of the section before, the section, and the one after it.
    """
    course, ends = courses[0], (section * SECTION_M, (section + 1) * SECTION_M)
    points = read_points(course, section, files, settings, context.progress)
    is_vehicle = own_vehicle(points.place)
    points = points.kept(~is_vehicle)
    context.progress.check()
    nodes, edges = nodes_of(points.place, course), edges_of(points.place)
    context.progress.check()
    points.kind[on_platforms(edges, points.place)] = PLATFORM
    points.kind[away(nodes, points.place) <= LIVE_M / 2] = WIRE
    parts = parts_of(points, nodes, courses, ends, settings, context.progress)
    edges, nodes = (one[(one[:, 0] >= ends[0]) & (one[:, 0] < ends[1])] for one in (edges, nodes))
    s, v, w = points.place.T
    band = np.searchsorted(BANDS_M, w)
    beside = points.is_own & (points.kind != WIRE) & (w >= settings.outline.floor_m) & (band < len(BANDS_M))
    cell = 2 * len(BANDS_M) * np.rint(s / settings.step_m).astype(np.int64) + len(BANDS_M) * (v < 0) + band
    aside, margin = (least_three(cell[beside], one[beside]) for one in (np.abs(v), -points.depth))
    return Section(aside, margin, edges, nodes, parts, bool(is_vehicle.any()))


def read_points(
    course: Course, section: int, files: Sequence[Sequence[str]], settings: Settings, progress: Progress = SILENT
) -> Points:
    """Read the points of a section with its halo, in an order that does not depend on the files."""
    columns = []
    for off, own in zip((-1, 0, 1), files):
        stored = read_stored(own, POINT)
        s = stored["s"].astype(float) + off * SECTION_M
        near = (s >= -HALO_M) & (s < SECTION_M + HALO_M) & (np.abs(stored["v"]) <= settings.reach_m)
        is_own = np.full(int(near.sum()), off == 0)
        columns.append((s[near] + section * SECTION_M, *(stored[name][near] for name in ("v", "w", "code")), is_own))
    s, v, w, code, is_own = (np.concatenate(column) for column in zip(*columns))
    piece = np.floor(s / PIECE_M).astype(np.int64)
    order = np.argsort(piece, kind="stable")
    parts = []
    for some in np.split(order, np.flatnonzero(np.diff(piece[order])) + 1):
        progress.check()
        some = some[np.lexsort((code[some], w[some], v[some], s[some]))]
        place = np.column_stack([s[some], v[some].astype(float), w[some].astype(float)])
        alone, others = np.ones(len(some), dtype=np.int64), np.full(len(some), OTHER, dtype=np.int8)
        points = Points(place, settings.depth(course, place), code[some], is_own[some], others, alone)
        parts.append(points if len(s) <= MOST_POINTS else _thinned(points))
    return Points(*(np.concatenate(column) for column in zip(*(vars(one).values() for one in parts))))


def _thinned(points: Points) -> Points:
    """Return the deepest point of each fine cell, with the number of points that it stands for."""
    cell = np.floor(points.place / FINE_M).astype(np.int64)
    cell -= cell.min(axis=0)
    order = np.argsort(-points.depth, kind="stable")
    number = np.ravel_multi_index(tuple(cell[order].T), tuple(cell.max(axis=0) + 1))
    _, first, count = np.unique(number, return_index=True, return_counts=True)
    rank = np.argsort(order[first])
    return replace(points.kept(order[first][rank]), number=count[rank])


def least_three(cell: np.ndarray, value: np.ndarray) -> Least:
    """Return the least values of each cell."""
    order = np.lexsort((value, cell))
    cell, value = cell[order], value[order]
    kept = np.append(np.ones(min(len(cell), THIRD), dtype=bool), cell[THIRD:] != cell[:-THIRD])
    return cell[kept], value[kept]


def third_least(parts: Sequence[Least], size: int) -> np.ndarray:
    """Return the third least values of cells, (size,), NaN where there are fewer, given the least ones of sections."""
    found = np.full(size, np.nan)
    if parts:
        cell, value = least_three(*(np.concatenate(column) for column in zip(*parts)))
        at = np.flatnonzero(cell[THIRD - 1 :] == cell[: len(cell) - THIRD + 1]) + THIRD - 1
        at = at[cell[at] < size]
        found[cell[at]] = np.where(np.isfinite(value[at]), value[at], np.nan)
    return found
