"""The pass over the cloud: points near tracks are sorted into sections of the tracks on disk, in the tracks' frames.

Each file is read once, by a task. A section is a hundred metres of one track, so that memory holds a few sections and
the stations, however large the cloud is, and results do not depend on how files are cut. What is stored depends on the
tracks, and on the profile only by how far it reaches, so that a later run with another one finds the points there.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from .. import disk
from ..clouds.header import CloudHeader
from ..clouds.points import Request, read_each, touching
from ..clouds.readers import read_classes
from ..progress import SILENT, Progress, counted
from ..run.tasks import Context, Runner, version
from ..standards import LAST_CLASS
from ..tiles.grid import Key
from ..tiles.store import SortedFile, append, files_of, fingerprint, kept_points
from .frame import Course
from .settings import Settings, Space

SECTION_M = 100.0
"""Length of a section: with 1,500 points per square metre on all sides, its points take 0.2 GB."""

HALO_M = 30.0
"""Length beyond the ends of a section that is read with it: a wire is followed and an object joined over this
length."""

POINT = np.dtype([("s", "<f4"), ("v", "<f4"), ("w", "<f4"), ("code", "u1")])
"""A point on disk: chainage from the start of its section, v and w in metres, and class."""

EVERY_CLASS = tuple(range(LAST_CLASS + 1))

STRIDE = 100
"""One of this number of points near a track shows the height of the cloud."""


@dataclass(frozen=True)
class Swept:
    """The points of a cloud along the tracks.

    `files` has them by track and section, and `census`, (256,), the points read by class. `seen` has, for each track,
    the number of points near it in plan by station, (n,), and `heights` that of some of these by the whole metres that
    they lie above the track.
    """

    files: tuple[SortedFile, ...]
    census: np.ndarray
    seen: tuple[np.ndarray, ...]
    heights: Counter[int]

    def files_around(self, number: int, section: int) -> list[list[str]]:
        """Return the files of the section of a track before the given one, of this one, and of the one after it."""
        keys = [(number, section + off) for off in (-1, 0, 1)]
        return [files_of(key, [one for one in self.files if key in one.counts]) for key in keys]


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
    """Sort the points along tracks into sections on disk, but for those that an earlier run has left in the folder."""
    with disk.writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    disk.sweep(folder)
    space = settings.space
    areas = np.concatenate([request.areas_along(one.xyz[:, :2], _far_m(one, space)) for one in courses])
    near = tuple(header for header in request.headers if len(touching(areas, header.extent)))
    arguments = [(courses, space, folder)] * len(near)
    found = read_each(replace(request, headers=near), sweep_file, arguments, runner, progress)
    kept = sum(is_kept for _, _, is_kept in found)
    if kept:
        verb, whose = ("is", "its") if kept == 1 else ("are", "their")
        said = f"{counted(kept, 'file')} of {len(found)} {verb} not read again"
        progress.info(f"{said}: an earlier run has kept {whose} points.")
    seen = tuple(np.zeros(len(one.xyz), dtype=np.int64) for one in courses)
    heights: Counter[int] = Counter()
    for _, report, _ in found:
        heights.update(dict(report["heights"]))
        for at, station, count in report["seen"]:
            seen[at][station] += count
    census = np.sum([np.zeros(LAST_CLASS + 1, dtype=np.int64), *(report["census"] for _, report, _ in found)], axis=0)
    return Swept(tuple(one for one, _, _ in found), census, seen, heights)


def _far_m(course: Course, space: Space) -> float:
    """Return the distance in plan within which all points to store lie: cant moves the highest ones aside."""
    return space.reach_m + space.high_m * float(np.abs(np.sin(course.roll)).max())


def sweep_file(
    request: Request, header: CloudHeader, courses: Sequence[Course], space: Space, folder: Path, context: Context
) -> tuple[SortedFile, dict, bool]:
    """Sort the points of a file into sections, unless an earlier run has done so; a task. See `_sort`."""
    stations = b"".join(values.tobytes() for one in courses for values in one.by_station.values())
    mine = folder / fingerprint(request, header, space, hashlib.sha256(stations).hexdigest(), version())
    sort = partial(_sort, request, header, courses, space, context.progress)
    report, is_kept = kept_points(mine, header, sort, context.progress)
    counts = {(at, section): count for at, section, count in report["counts"]}
    return SortedFile(str(mine), counts), report, is_kept


def _sort(
    request: Request, header: CloudHeader, courses: Sequence[Course], space: Space, progress: Progress, folder: Path
) -> dict:
    """Write the points of a file to the files of their sections; returns what `Swept` has, as lists."""
    areas = [request.areas_along(one.xyz[:, :2], _far_m(one, space)) for one in courses]
    own_areas = [touching(one, header.extent) for one in areas]
    touched = [at for at, areas in enumerate(own_areas) if len(areas)]
    seen = {at: np.zeros(len(courses[at].xyz), dtype=np.int64) for at in touched}
    counts, heights = Counter[Key](), Counter[int]()
    checks: dict[str, int] = {}
    census = np.zeros(LAST_CLASS + 1, dtype=np.int64)
    wanted = [code for code in EVERY_CLASS if code not in space.left_out]
    for xyz, codes, _, read in read_classes(
        header.path, wanted, progress, np.concatenate(own_areas), request.leave_out
    ):
        census += read
        kept = request.holds(xyz)
        local, codes = request.zero.to_local(xyz[kept]), codes[kept]
        for at in touched:
            progress.check()
            near, station = courses[at].near(local[:, :2], _far_m(courses[at], space))
            seen[at] += np.bincount(station, minlength=len(seen[at]))
            above = local[near[::STRIDE], 2] - courses[at].xyz[station[::STRIDE], 2]
            heights.update(np.rint(above).astype(int).tolist())
            for section, points in _sorted(courses[at], station, space, local[near], codes[near]):
                append(folder, (at, section), points, checks)
                counts[at, section] += len(points)
    return {
        "checks": checks,
        "counts": [(*key, count) for key, count in counts.items()],
        "seen": [(at, one, int(own[one])) for at, own in seen.items() for one in np.flatnonzero(own).tolist()],
        "heights": list(heights.items()),
        "census": census.tolist(),
    }


def _sorted(
    course: Course, station: np.ndarray, space: Space, place: np.ndarray, codes: np.ndarray
) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the points to keep of those near a track, (n, 3), given the station nearest to each, by section."""
    s, v, w = course.located(place, station)
    kept = np.flatnonzero((np.abs(v) <= space.reach_m) & (w >= space.low_m) & (w <= space.high_m) & np.isfinite(s))
    section = np.floor(s[kept] / SECTION_M).astype(np.int64)
    for number in np.unique(section).tolist():
        mine = kept[section == number]
        points = np.empty(len(mine), POINT)
        points["s"], points["v"], points["w"] = s[mine] - number * SECTION_M, v[mine], w[mine]
        points["code"] = codes[mine]
        yield number, points
