"""The pass over the cloud: points near tracks are sorted into sections of the tracks on disk, in the tracks' frames.

Each file is read once, by a task. A section is a hundred metres of one track, so that memory holds a few sections and
the stations, however large the cloud is, and results do not depend on how files are cut.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
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
from ..tiles.store import SortedFile, append
from .frame import Cells, Course

SECTION_M = 100.0
"""Length of a section: with 1,500 points per square metre on all sides, its points take 0.2 GB."""

HALO_M = 30.0
"""Length beyond the ends of a section that is read with it: a wire is followed and an object joined over this
length."""

BESIDE_M = 1.6
"""Points this far beyond the half width of the profile and its margin are kept, so that stations have distances."""

LEAST_REACH_M = 3.0
"""Platforms are looked for up to here, however narrow the profile is."""

TOP_M = 7.0
"""Nothing higher is measured: the highest contact wire is 6.5 m high."""

BELOW_M = 0.05
"""Points within this distance below the lowest height that counts are kept: the rough height of a point is off by
that."""

LOWEST_M = 0.12
"""Platform edges begin here, even where the lowest height that counts is above."""

POINT = np.dtype([("s", "<f4"), ("v", "<f4"), ("w", "<f4"), ("code", "u1")])
"""A point on disk: chainage from the start of its section, v and w in metres, and class."""

EVERY_CLASS = tuple(range(LAST_CLASS + 1))

AREA_M = 200.0
"""Length of track in a rectangle in which points are read."""


@dataclass(frozen=True)
class Plan:
    """What is swept.

    Attributes
    ----------
    courses : sequence of Course
    reach_m, floor_m : float
        How far aside, and how high over the rail tops, points are kept.
    left_out : tuple of int
        Classes that count nowhere.
    """

    courses: tuple[Course, ...]
    reach_m: float
    floor_m: float
    left_out: tuple[int, ...] = ()

    @property
    def lowest_m(self) -> float:
        """Height from which points are kept."""
        return min(self.floor_m, LOWEST_M) - BELOW_M

    @property
    def far_m(self) -> float:
        """Distance in plan within which all points to keep lie: cant moves the highest ones aside."""
        leaning = max(float(np.abs(np.sin(one.roll)).max()) for one in self.courses)
        return self.reach_m + TOP_M * leaning


@dataclass(frozen=True)
class Swept:
    """The points of a cloud along the tracks.

    Attributes
    ----------
    files : tuple of SortedFile
        Points by track and section.
    census : (256,) int array
        Points read by class.
    nearby : int
        Points within ten metres of a track in plan, at any height.
    above_m : float
        Median height of these points over the tracks, NaN without any.
    seen : tuple of (n,) int arrays
        Points within reach in plan, at any height, at the stations of each track.
    """

    files: tuple[SortedFile, ...]
    census: np.ndarray
    nearby: int
    above_m: float
    seen: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class SweptFile:
    """What one file gave; `seen` has stations and numbers of points by track, see `Swept`."""

    points: SortedFile
    census: np.ndarray
    nearby: int
    above_m: float
    seen: Mapping[int, tuple[np.ndarray, np.ndarray]]


def sweep(request: Request, plan: Plan, folder: Path, runner: Runner, progress: Progress = SILENT) -> Swept:
    """Sort the points along tracks into sections on disk."""
    unit_m = request.zero.horizontal_unit_m
    areas = [areas_along(course, NEARBY_M) / unit_m for course in plan.courses]
    tasks = {}
    for number, header in enumerate(request.headers):
        touched = [_touching(area, header.extent) for area in areas]
        if any(map(len, touched)):
            label, weight = f"Reading {header.path.name}", READ_S * (header.point_count + 1)
            tasks[number] = Task(label, sweep_file, (request, number, plan, touched, folder), weight=weight)
    found = [one for _, one in runner.run(tasks, progress)]
    seen = tuple(np.zeros(len(course.xyz), dtype=np.int64) for course in plan.courses)
    for one in found:
        for at, (stations, counts) in one.seen.items():
            seen[at][stations] += counts
    heights = [one.above_m for one in found if np.isfinite(one.above_m)]
    return Swept(
        tuple(one.points for one in found),
        np.sum([np.zeros(LAST_CLASS + 1, dtype=np.int64), *(one.census for one in found)], axis=0),
        sum(one.nearby for one in found),
        float(np.median(heights)) if heights else np.nan,
        seen,
    )


NEARBY_M = 10.0
"""A cloud without a point this near to a track, in plan, is one of another place."""


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
    request: Request, number: int, plan: Plan, touched: Sequence[np.ndarray], folder: Path, context: Context
) -> SweptFile:
    """Sort the points of one file into sections; a task."""
    header, mine = request.headers[number], SortedFile.new_folder(folder)
    near = {at: Cells.around(plan.courses[at], plan.far_m) for at, areas in enumerate(touched) if len(areas)}
    wide = {at: Cells.around(plan.courses[at], max(NEARBY_M, plan.far_m)) for at in near}
    counts: Counter[Key] = Counter()
    seen = {at: np.zeros(len(plan.courses[at].xyz), dtype=np.int64) for at in near}
    census, nearby, heights = np.zeros(LAST_CLASS + 1, dtype=np.int64), 0, []
    wanted = [code for code in EVERY_CLASS if code not in plan.left_out]
    chunks = read_classes(header.path, wanted, context.progress, np.concatenate(touched), request.leave_out)
    for xyz, codes, _, counted in chunks:
        context.progress.check()
        census += counted
        kept = request.holds(xyz)
        local, codes = request.zero.to_local(xyz[kept]), codes[kept]
        for at in near:
            course = plan.courses[at]
            within, station = wide[at].find(local[:, :2])
            nearby += len(within)
            some = local[within]
            seen[at] += np.bincount(near[at].find(some[:, :2])[1], minlength=len(course.xyz))
            heights.append(local[within[::STRIDE], 2] - course.xyz[station[::STRIDE], 2])
            for key, points in _sorted(course, near[at], plan, some, codes[within]):
                append(mine, (at, key), points)
                counts[at, key] += len(points)
    above = np.concatenate([np.empty(0), *heights])
    above_m = float(np.median(above)) if len(above) else np.nan
    sparse = {at: (np.flatnonzero(one), one[one > 0]) for at, one in seen.items()}
    return SweptFile(SortedFile(str(mine), counts), census, nearby, above_m, sparse)


STRIDE = 100
"""One of this number of points near a track shows the height of the cloud."""


def _sorted(
    course: Course, cells: Cells, plan: Plan, xyz: np.ndarray, codes: np.ndarray
) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the points to keep of a chunk by section of a track."""
    near, station = cells.find(xyz[:, :2])
    place = xyz[near]
    east, north = (place[:, :2] - course.xyz[station, :2]).T
    heading, roll = course.heading[station], course.roll[station]
    aside = north * np.cos(heading) - east * np.sin(heading)
    rough = (place[:, 2] - course.xyz[station, 2] - np.sin(roll) * aside) * np.cos(roll)
    slack = BELOW_M + np.abs(course.grade[station]) * 2.0
    high = (rough > plan.lowest_m - slack) & (rough < TOP_M + slack)
    near, station, place = near[high], station[high], place[high]
    s, v, w = course.located(place, station)
    kept = np.flatnonzero(np.isfinite(s) & (np.abs(v) <= plan.reach_m) & (w >= plan.lowest_m) & (w <= TOP_M))
    section = np.floor(s[kept] / SECTION_M).astype(np.int64)
    order = np.argsort(section, kind="stable")
    borders = np.flatnonzero(np.diff(section[order])) + 1
    for part in np.split(order, borders) if len(order) else ():
        number, chosen = int(section[part[0]]), kept[part]
        points = np.empty(len(part), POINT)
        points["s"], points["v"], points["w"] = s[chosen] - number * SECTION_M, v[chosen], w[chosen]
        points["code"] = codes[near[chosen]]
        yield number, points


def sections_of(swept: Swept) -> list[Key]:
    """Return the tracks and sections that have points, in order."""
    return sorted({key for one in swept.files for key in one.counts})


def counted(swept: Swept) -> Mapping[Key, int]:
    """Return the number of points by track and section."""
    return sum((Counter(one.counts) for one in swept.files), Counter())
