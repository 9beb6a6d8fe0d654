"""The pass over the cloud: points near tracks are sorted into sections of the tracks on disk, in the tracks' frames.

Each file is read once, by a task. A section is a hundred metres of one track, so that memory holds a few sections and
the stations, however large the cloud is, and results do not depend on how files are cut.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..clouds.points import Request
from ..clouds.readers import read_classes
from ..progress import SILENT, Progress
from ..run.loop import Runner
from ..run.tasks import READ_S, Context, Task
from ..standards import LAST_CLASS
from ..tiles.grid import Key
from ..tiles.store import SortedFile, append, files_of
from .frame import Cells, Course
from .settings import BELOW_M, Settings

SECTION_M = 100.0
"""Length of a section: with 1,500 points per square metre on all sides, its points take 0.2 GB."""

HALO_M = 30.0
"""Length beyond the ends of a section that is read with it: a wire is followed and an object joined over this
length."""

TOP_M = 7.0
"""Nothing higher is measured: the highest contact wire is 6.5 m high."""

POINT = np.dtype([("s", "<f4"), ("v", "<f4"), ("w", "<f4"), ("code", "u1")])
"""A point on disk: chainage from the start of its section, v and w in metres, and class."""

EVERY_CLASS = tuple(range(LAST_CLASS + 1))

AREA_M = 200.0
"""Length of track in a rectangle in which points are read."""

STRIDE = 100
"""One of this number of points near a track shows the height of the cloud."""


@dataclass(frozen=True)
class Swept:
    """The points of a cloud, or of one of its files, along the tracks.

    `files` has them by track and section, and `census`, (256,), the points read by class. `heights`, (k,), is how far
    some of the points that are near a track in plan lie above it, and `seen` the number of these by track and station.
    """

    files: tuple[SortedFile, ...]
    census: np.ndarray
    heights: np.ndarray
    seen: Counter[Key]

    @property
    def sections(self) -> Counter[Key]:
        """Number of points kept by track and section."""
        return sum((Counter(one.counts) for one in self.files), Counter())

    def files_around(self, number: int, section: int) -> list[list[str]]:
        """Return the files of the section of a track before the given one, of this one, and of the one after it."""
        return [files_of((number, section + off), self.files) for off in (-1, 0, 1)]

    def passed(self, number: int, course: Course) -> np.ndarray:
        """Return the number of points within reach of a track up to its stations, (n,)."""
        found = np.zeros(len(course.xyz), dtype=np.int64)
        for (track, station), count in self.seen.items():
            if track == number:
                found[station] = count
        return np.cumsum(found)


def part_of(course: Course, section: int) -> Course:
    """Return the stations of a section of a track with its halo."""
    low = int(np.floor((section * SECTION_M - HALO_M) / course.step_m)) - 1
    high = int(np.ceil(((section + 1) * SECTION_M + HALO_M) / course.step_m)) + 2
    return course.part(max(low, 0), min(high, len(course.xyz)))


def sweep(
    request: Request,
    courses: Sequence[Course],
    settings: Settings,
    folder: Path,
    runner: Runner,
    progress: Progress = SILENT,
) -> Swept:
    """Sort the points along tracks into sections on disk."""
    far_m = _far_m(courses, settings)
    areas = [areas_along(course, far_m) / request.zero.horizontal_unit_m for course in courses]
    tasks = {}
    for number, header in enumerate(request.headers):
        touched = [_touching(area, header.extent) for area in areas]
        if any(map(len, touched)):
            given = (request, number, courses, settings, touched, folder)
            tasks[number] = Task(
                f"Reading {header.path.name}", sweep_file, given, weight=READ_S * (header.point_count + 1)
            )
    found = [one for _, one in runner.run(tasks, progress)]
    return Swept(
        tuple(file for one in found for file in one.files),
        np.sum([np.zeros(LAST_CLASS + 1, dtype=np.int64), *(one.census for one in found)], axis=0),
        np.concatenate([np.empty(0), *(one.heights for one in found)]),
        sum((one.seen for one in found), Counter()),
    )


def _far_m(courses: Sequence[Course], settings: Settings) -> float:
    """Return the distance in plan within which all points to keep lie: cant moves the highest ones aside."""
    leaning = max(float(np.abs(np.sin(one.roll)).max()) for one in courses)
    return settings.reach_m + TOP_M * leaning


def areas_along(course: Course, reach_m: float) -> np.ndarray:
    """Return rectangles, (k, 4) metres, that hold all places within reach of a track."""
    parts = np.array_split(course.xyz[:, :2], max(int(course.length_m / AREA_M), 1))
    low, high = (np.array([reduce(part, axis=0) for part in parts]) for reduce in (np.min, np.max))
    return np.column_stack([low - reach_m, high + reach_m])


def _touching(areas: np.ndarray, extent: Sequence[float]) -> np.ndarray:
    """Return the rectangles, (k, 4), that touch an extent; one of NaN may be anywhere."""
    low, high = np.array(extent[:2]), np.array(extent[2:])
    return areas[~((areas[:, :2] > high) | (areas[:, 2:] < low)).any(axis=1)]


def sweep_file(
    request: Request,
    number: int,
    courses: Sequence[Course],
    settings: Settings,
    touched: Sequence[np.ndarray],
    folder: Path,
    context: Context,
) -> Swept:
    """Sort the points of one file into sections; a task."""
    path, mine, far_m = request.headers[number].path, SortedFile.new_folder(folder), _far_m(courses, settings)
    cells = {at: Cells.around(courses[at], far_m) for at, areas in enumerate(touched) if len(areas)}
    counts: Counter[Key] = Counter()
    seen = {at: np.zeros(len(courses[at].xyz), dtype=np.int64) for at in cells}
    census, heights = np.zeros(LAST_CLASS + 1, dtype=np.int64), [np.empty(0)]
    wanted = [code for code in EVERY_CLASS if code not in settings.left_out]
    chunks = read_classes(path, wanted, context.progress, np.concatenate(touched), request.leave_out)
    for xyz, codes, _, counted in chunks:
        context.progress.check()
        census += counted
        kept = request.holds(xyz)
        local, codes = request.zero.to_local(xyz[kept]), codes[kept]
        for at, own in cells.items():
            course = courses[at]
            near, station = own.find(local[:, :2])
            seen[at] += np.bincount(station, minlength=len(course.xyz))
            heights.append((local[near, 2] - course.xyz[station, 2])[::STRIDE])
            for section, points in _sorted(course, station, settings, local[near], codes[near]):
                append(mine, (at, section), points)
                counts[at, section] += len(points)
    sparse = {(at, station): int(one[station]) for at, one in seen.items() for station in np.flatnonzero(one).tolist()}
    return Swept((SortedFile(str(mine), counts),), census, np.concatenate(heights), Counter(sparse))


def _sorted(
    course: Course, station: np.ndarray, settings: Settings, place: np.ndarray, codes: np.ndarray
) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the points to keep of those near a track, (n, 3), given a station near each, by section."""
    east, north = (place[:, :2] - course.xyz[station, :2]).T
    heading, roll = course.heading[station], course.roll[station]
    aside = north * np.cos(heading) - east * np.sin(heading)
    rough = (place[:, 2] - course.xyz[station, 2] - np.sin(roll) * aside) * np.cos(roll)
    slack = BELOW_M + np.abs(course.grade[station]) * 2.0
    high = np.flatnonzero((rough > settings.lowest_m - slack) & (rough < TOP_M + slack))
    s, v, w = course.located(place[high], station[high])
    kept = np.isfinite(s) & (np.abs(v) <= settings.reach_m) & (w >= settings.lowest_m) & (w <= TOP_M)
    s, v, w, codes = s[kept], v[kept], w[kept], codes[high[kept]]
    section = np.floor(s / SECTION_M).astype(np.int64)
    for number in np.unique(section).tolist():
        chosen = section == number
        points = np.empty(int(chosen.sum()), POINT)
        points["s"], points["v"], points["w"] = s[chosen] - number * SECTION_M, v[chosen], w[chosen]
        points["code"] = codes[chosen]
        yield number, points
