"""The one store of points on disk: sorted into the squares of a tiling, so that memory holds those of one square.

Each file of a cloud is read once, by a task that appends its points to files in a folder of its own. See docs/method.md
section 7.1.
"""

from __future__ import annotations

import hashlib
import json
import os
import uuid
import zlib
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..clouds.on_heads import heads_of
from ..clouds.passes import number_passes
from ..clouds.points import RailPoints, Request, origin_steps
from ..clouds.readers import CloudHeader
from ..disk import discard, scratch_folder, writing
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from .grid import Key, Square, Tiling, around

REPORT = "report.json"

POINT_BYTES = 24
"""Bytes of a sorted point: three coordinates."""

LAYOUT = 3
"""Number of the layout of sorted points, so that those of an earlier version are read again."""


@dataclass(frozen=True)
class SortedFile:
    """The points of one file of a cloud, sorted into a folder with one file per square, and their number by square.

    Squares with points in their margin only have a file, too. `sources` has the number of points by square for each
    source, as of `passes.sources_of`, where this is asked for.
    """

    folder: str
    counts: Mapping[Key, int]
    sources: Mapping[int, Mapping[Key, int]] = field(default_factory=dict)

    @classmethod
    def new_folder(cls, folder: Path) -> Path:
        """Make the folder of an execution of a task: one that ended half-way has left its own."""
        mine = folder / uuid.uuid4().hex
        with writing(folder):
            mine.mkdir(parents=True)
        return mine


def append(folder: Path, key: tuple[int, ...], points: np.ndarray, checks: dict[str, int] | None = None) -> str:
    """Append points to the file of a square, or of a square and other whole numbers; returns its name.

    The checksums of files are kept up to date if they are given, by name.
    """
    name = "_".join(map(str, key))
    with writing(folder.parent), (folder / name).open("ab") as file:
        file.write(points.data)
    if checks is not None:
        checks[name] = zlib.crc32(points.data, checks.get(name, 0))
    return name


def key_of(file: str) -> tuple[int, ...]:
    """Return the numbers that name a file; see `append`."""
    return tuple(map(int, Path(file).name.split("_")))


def counts_of(found: Iterable[SortedFile]) -> Counter[Key]:
    """Return the number of points of all files by square."""
    return sum((Counter(one.counts) for one in found), Counter())


def sources_among(found: Iterable[SortedFile]) -> dict[int, Counter[Key]]:
    """Return the number of points of all files by source and square, in ascending order of sources."""
    total: dict[int, Counter[Key]] = {}
    for one in found:
        for source, counts in one.sources.items():
            total.setdefault(source, Counter()).update(counts)
    return dict(sorted(total.items()))


def files_of(key: Key, found: Iterable[SortedFile]) -> list[str]:
    """List the files that may hold points of a square."""
    return [str(Path(one.folder, "_".join(map(str, key)))) for one in found]


def read_stored(files: Iterable[str], dtype: np.dtype) -> np.ndarray:
    """Read the points of a square, (n,) array of their type."""
    parts = [np.empty(0, np.uint8), *(np.fromfile(file, np.uint8) for file in files if Path(file).exists())]
    return np.concatenate(parts).view(dtype)  # joining bytes takes a fifth of the time that joining fields does


@dataclass(frozen=True)
class SpooledFile:
    """The sorted points of one file of the cloud, in a folder, and a report on them.

    "classes" has, for each class code, the number of points by square, and the smallest and largest x and y in units of
    the CRS. "census" has the number of all points by class, "steps", for each axis, the number of points of the
    requested classes by `origin_steps`, and "checks" the checksum of each file.
    """

    folder: str
    report: dict


@dataclass(frozen=True)
class SpooledPoints:
    """The points of one class on disk, a `PointSource`; `found`, `blunt` and `scanned` as in `RailPoints`.

    `files` hold the points of each square, one for each mark (see `passes.marks_of`), with which its name ends;
    `passes` has the number of the strip, a pass of the scanner, of each mark.
    """

    frame: LocalFrame
    class_code: int
    side_m: float
    counts: Mapping[Key, int]
    span_m: float
    files: Mapping[Key, tuple[str, ...]]
    passes: Mapping[int, int]
    found: bool = False
    blunt: bool | None = None
    scanned: bool = False
    fills = False

    @property
    def is_marked(self) -> bool:
        """See `PointSource`."""
        return len(set(self.passes.values())) > 1

    def near(self, square: Square, margin_m: float) -> RailPoints:
        """See `PointSource`."""
        keys = sorted(self.files) if square.is_whole_plane else around(square.key)
        files = [file for key in keys for file in self.files.get(key, ())]
        parts = [_read(file, square, margin_m) for file in files]
        xyz = parts[0] if len(parts) == 1 else np.concatenate(parts or [np.empty((0, 3))])
        strips = np.array([self.passes[key_of(file)[-1]] for file in files], dtype=np.int32)
        each = np.repeat(strips, [len(part) for part in parts]) if len(np.unique(strips)) > 1 else None
        points = RailPoints(xyz, square.frame, self.class_code, each, self.found, self.blunt, scanned=self.scanned)
        return heads_of(points)

    def judged(self, blunt: bool) -> SpooledPoints:
        """See `PointSource`."""
        return replace(self, blunt=blunt)

    def of_strips(self, strips: Collection[int], among: bool = True) -> SpooledPoints:
        """See `PointSource`."""
        files = {
            key: tuple(file for file in own if (self.passes[key_of(file)[-1]] in strips) == among)
            for key, own in self.files.items()
        }
        files = {key: own for key, own in files.items() if own}
        counts = {key: sum(Path(file).stat().st_size for file in own) // POINT_BYTES for key, own in files.items()}
        return replace(self, files=files, counts=counts)

    def part(self, square: Square) -> SpooledPoints:
        """Keep only a square and its neighbours, so that less is sent to a worker."""
        if square.is_whole_plane:
            return self
        keys = [key for key in around(square.key) if key in self.files]
        files = {key: self.files[key] for key in keys}
        marks = {key_of(file)[-1] for own in files.values() for file in own}
        passes = {mark: self.passes[mark] for mark in sorted(marks)}
        return replace(self, counts={key: self.counts[key] for key in keys}, files=files, passes=passes)


def _read(file: str, square: Square, margin_m: float) -> np.ndarray:
    """Read the points of a file that are in a square or at most `margin_m` outside, (n, 3), in the frame of the square.

    A single place may hold most of a cloud, so that each copy of its points counts.
    """
    xyz = square.frame.to_local(np.fromfile(file).reshape(-1, 3))
    inside = square.holds(xyz, margin_m)
    return xyz if inside.all() else xyz[inside]


def spool(request: Request, side_m: float, folder: Path, progress: Progress = SILENT) -> tuple[SpooledPoints, ...]:
    """Read a cloud once and sort its points into squares in a folder that the caller removes.

    Returns one for each requested class that has points, in ascending order of code, all in one local frame. Raises
    CloudError if a file is damaged, and NoRailPointsError if no point of the requested classes is within the extent.
    """
    shares = request.shares(progress)
    found = [spool_file(request, header, side_m, folder, share) for header, share in zip(request.headers, shares)]
    return gather(request, side_m, found)


def spool_file(
    request: Request, header: CloudHeader, side_m: float, folder: Path, progress: Progress = SILENT
) -> SpooledFile:
    """Sort the points of one file into squares, unless that has been done and nothing has changed since.

    Two processes may sort the same file at the same time: each writes to its own folder, and the first to finish
    provides the result.
    """

    def sort(unfinished: Path) -> dict:
        return _sort(request, header, side_m, unfinished, progress)

    mine = folder / fingerprint(request, header, side_m)
    report, _ = kept_points(mine, header, sort, progress)
    return SpooledFile(str(mine), report)


def kept_points(
    mine: Path, header: CloudHeader, sort: Callable[[Path], dict], progress: Progress = SILENT
) -> tuple[dict, bool]:
    """Return the report on the sorted points of a file, and whether an earlier run has left them in the folder `mine`.

    If it has not, or they are damaged, `sort` writes them to a folder and returns their report, whose "checks" are the
    checksums of the files. The name of the folder is to change with everything that they depend on; see `fingerprint`.
    """
    if os.path.lexists(mine):
        try:
            return _checked_report(mine), True
        except ValueError:
            progress.warning(f"The stored points of {header.path.name} are damaged: the file is read again.")
            discard(mine)
    with writing(mine.parent), scratch_folder(mine.parent) as scratch:
        unfinished = scratch / mine.name
        unfinished.mkdir()
        report = sort(unfinished)
        text = json.dumps(report)
        (unfinished / REPORT).write_text(f"{_digest(text)}\n{text}", encoding="ascii")
        _name_first(unfinished, mine)
    return report, False


def _sort(request: Request, header: CloudHeader, side_m: float, folder: Path, progress: Progress) -> dict:
    """Write the points of a file to the files of their squares; returns the report."""
    found = Census()
    for xyz, codes, marks, census in request.read(header, progress):
        found.census += census
        for code in np.unique(codes).tolist():
            found.add(code, xyz[codes == code], marks[codes == code], request.zero, side_m, folder)
    return found.report()


def _checked_report(folder: Path) -> dict:
    """Read the report of sorted points; `ValueError` unless all of them are still what was written."""
    try:
        digest, text = (folder / REPORT).read_text(encoding="ascii").split("\n")
        if digest != _digest(text):
            raise ValueError(REPORT)
        report = json.loads(text)
        for name, check in report["checks"].items():
            if zlib.crc32((folder / name).read_bytes()) != check:
                raise ValueError(name)
    except OSError as error:
        raise ValueError(str(error)) from error
    return report


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _name_first(folder: Path, name: Path) -> None:
    """Rename a folder, unless another process has created one of that name in the meantime."""
    try:
        folder.rename(name)
    except OSError:
        if not name.exists():
            raise


def gather(request: Request, side_m: float, found: Sequence[SpooledFile]) -> tuple[SpooledPoints, ...]:
    """Combine the sorted files of a cloud; see `spool`."""
    codes = sorted({int(code) for file in found for code in file.report["classes"]})
    if not codes:
        raise request.explain_none(np.sum([file.report["census"] for file in found], axis=0))
    steps: list[Counter[float]] = [Counter(), Counter(), Counter()]
    for total, axis in zip(steps, range(3)):
        for file in found:
            total.update(dict(file.report["steps"][axis]))
    frame = request.frame_at([tuple(np.array(sorted(one.items())).T) for one in steps])
    rows = [
        (mark, *key)
        for file in found
        for of_class in file.report["classes"].values()
        for _, *key, mark in map(key_of, of_class["squares"])
    ]
    marks, *places = np.array(rows).T
    passes = number_passes(marks, np.column_stack(places))
    scanned = request.is_scanned()
    return tuple(replace(_source(code, found, frame, side_m, passes), scanned=scanned) for code in codes)


class Census:
    """Counts of the points written to disk, in JSON types."""

    def __init__(self) -> None:
        self.census = np.zeros(256, dtype=np.int64)
        self._classes: dict[int, dict] = {}
        self._checks: dict[str, int] = {}
        self._steps: list[Counter[float]] = [Counter(), Counter(), Counter()]

    def add(self, code: int, xyz: np.ndarray, marks: np.ndarray, zero: LocalFrame, side_m: float, folder: Path) -> None:
        """Append points of one class, (n, 3) in units of the CRS, to the files of their squares and marks, (n,)."""
        if not len(xyz):
            return
        new = {"squares": {}, "low": [np.inf] * 2, "high": [-np.inf] * 2}
        mine = self._classes.setdefault(code, new)
        for mark in np.unique(marks).tolist():
            own = xyz[marks == mark]
            for key, numbers in Tiling(side_m).sort(zero.to_local(own)).items():
                name = append(folder, (code, *key, mark), own[numbers], self._checks)
                mine["squares"][name] = mine["squares"].get(name, 0) + len(numbers)
        mine["low"] = np.minimum(mine["low"], xyz[:, :2].min(axis=0)).tolist()
        mine["high"] = np.maximum(mine["high"], xyz[:, :2].max(axis=0)).tolist()
        for steps, column in zip(self._steps, origin_steps(xyz).T):
            values, counts = np.unique(column, return_counts=True)
            steps.update(dict(zip(values.tolist(), counts.tolist())))

    def report(self) -> dict:
        """Return `SpooledFile.report`."""
        classes = {str(code): found for code, found in self._classes.items()}
        return {
            "classes": classes,
            "checks": self._checks,
            "census": self.census.tolist(),
            "steps": [list(map(list, steps.items())) for steps in self._steps],
        }


def _source(
    code: int, found: Sequence[SpooledFile], frame: LocalFrame, side_m: float, passes: Mapping[int, int]
) -> SpooledPoints:
    """Combine the points of one class."""
    counts: dict[Key, int] = {}
    files: dict[Key, tuple[str, ...]] = {}
    mine = [(file.folder, file.report["classes"][str(code)]) for file in found if str(code) in file.report["classes"]]
    for folder, of_class in mine:
        for name, count in of_class["squares"].items():
            _, column, row, _ = key_of(name)
            key = (column, row)
            counts[key] = counts.get(key, 0) + count
            files[key] = (*files.get(key, ()), str(Path(folder) / name))
    low = np.min([of_class["low"] for _, of_class in mine], axis=0)
    high = np.max([of_class["high"] for _, of_class in mine], axis=0)
    span_m = float((high - low).max() * frame.horizontal_unit_m)
    return SpooledPoints(frame, code, side_m, counts, span_m, files, passes)


def fingerprint(request: Request, header: CloudHeader, *how: object) -> str:
    """Return a name that depends on the file, on which of its points are requested, and on how they are sorted."""
    state = header.path.stat()
    facts = (
        LAYOUT,
        str(header.path.resolve()),
        state.st_size,
        state.st_mtime_ns,
        request.class_codes if request.merged else sorted(request.class_codes),
        request.merged,
        request.extent,
        None if request.mask is None else hashlib.sha256(request.mask.edges.tobytes()).hexdigest(),
        sorted(request.leave_out),
        request.zero.horizontal_unit_m,
        request.zero.vertical_unit_m,
        *how,
    )
    return hashlib.sha256(repr(facts).encode()).hexdigest()[:24]
