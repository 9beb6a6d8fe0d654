"""Rail points on disk, sorted into squares in one reading of the files: memory does not grow with the cloud."""

from __future__ import annotations

import hashlib
import json
import shutil
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..clouds.las import CloudHeader
from ..clouds.points import RailPoints, Request, origin_steps
from ..disk import writing
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from .grid import Key, Square, around, unique_keys

REPORT = "report.json"


@dataclass(frozen=True)
class SpooledFile:
    """What was found in one file of the cloud.

    Attributes
    ----------
    folder : str
        Where its points lie.
    report : dict
        Of each class by its code: count by square, smallest and largest x and y in units of the CRS; further the count
        of all points by class ("census"), and of the wanted ones by `origin_steps` for each axis ("steps").
    """

    folder: str
    report: dict


@dataclass(frozen=True)
class SpooledPoints:
    """The points of one class on disk, a `PointSource`.

    Attributes
    ----------
    frame, class_code, side_m, counts, span_m
        See `PointSource`.
    files : mapping of key to str
        The files that hold a square's points.
    """

    frame: LocalFrame
    class_code: int
    side_m: float
    counts: Mapping[Key, int]
    span_m: float
    files: Mapping[Key, tuple[str, ...]]

    def near(self, stretch: Square, margin_m: float) -> RailPoints:
        """See `PointSource`."""
        keys = around(stretch.key) if np.isfinite(stretch.side_m) else sorted(self.files)
        parts = [np.fromfile(file).reshape(-1, 3) for key in keys for file in self.files.get(key, ())]
        xyz = stretch.frame.to_local(np.concatenate(parts) if parts else np.empty((0, 3)))
        return RailPoints(xyz[stretch.holds(xyz, margin_m)], stretch.frame, self.class_code)

    def part(self, stretch: Square) -> SpooledPoints:
        """Leave out squares that neither are the stretch nor touch it: less to send to a worker."""
        if not np.isfinite(stretch.side_m):
            return self
        keys = [key for key in around(stretch.key) if key in self.files]
        return replace(
            self, counts={key: self.counts[key] for key in keys}, files={key: self.files[key] for key in keys}
        )


def spool(request: Request, side_m: float, folder: Path, progress: Progress = SILENT) -> tuple[SpooledPoints, ...]:
    """Read a cloud once and sort its points into squares on disk.

    Parameters
    ----------
    request : Request
    side_m : float
        Side of the squares.
    folder : Path
        Where to; whoever made it removes it.
    progress : Progress

    Returns
    -------
    tuple of SpooledPoints
        One for each wanted class that has points, by rising code, all in one local frame.

    Raises
    ------
    CloudError
        A file is damaged.
    DiskError
        The disk is full.
    NoRailPointsError
        No point of the wanted classes lies in the files and the extent.
    """
    shares = request.shares(progress)
    found = [spool_file(request, header, side_m, folder, share) for header, share in zip(request.headers, shares)]
    return gather(request, side_m, found)


def spool_file(
    request: Request, header: CloudHeader, side_m: float, folder: Path, progress: Progress = SILENT
) -> SpooledFile:
    """Sort the points of one file into squares; one that has not changed since it was sorted is not read again.

    Two that sort the same file at the same time do so each in a folder of its own, and the first to finish is right.
    """
    mine = folder / _fingerprint(request, header, side_m)
    if not mine.exists():
        unfinished = folder / f"{mine.name}.{uuid.uuid4().hex}"
        try:
            with writing(folder):
                unfinished.mkdir()
            _sort(request, header, side_m, unfinished, progress)
            with writing(folder):
                _name_first(unfinished, mine)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)
    return SpooledFile(str(mine), json.loads((mine / REPORT).read_text(encoding="ascii")))


def _sort(request: Request, header: CloudHeader, side_m: float, folder: Path, progress: Progress) -> None:
    """Write the points of a file into files of their squares, and the report on them."""
    found = _Census()
    for xyz, codes, census in request.read(header, progress):
        found.census += census
        with writing(folder.parent):
            for code in np.unique(codes).tolist():
                found.add(code, xyz[codes == code], request.zero, side_m, folder)
    with writing(folder.parent):
        (folder / REPORT).write_text(json.dumps(found.report()), encoding="ascii")


def _name_first(folder: Path, name: Path) -> None:
    """Give a folder its name, unless there is one of this name by now."""
    try:
        folder.rename(name)
    except OSError:
        if not name.exists():
            raise


def gather(request: Request, side_m: float, found: Sequence[SpooledFile]) -> tuple[SpooledPoints, ...]:
    """Put together what was found in the files of a cloud; see `spool`."""
    codes = sorted({int(code) for file in found for code in file.report["classes"]})
    if not codes:
        raise request.explain_none(np.sum([file.report["census"] for file in found], axis=0))
    steps = [_merged([file.report["steps"][axis] for file in found]) for axis in range(3)]
    frame = request.frame_at([(np.array(list(one)), np.array(list(one.values()))) for one in steps])
    return tuple(_source(code, found, frame, side_m) for code in codes)


class _Census:
    """Counts of what goes to disk, in JSON's types."""

    def __init__(self) -> None:
        self.census = np.zeros(256, dtype=np.int64)
        self._classes: dict[int, dict] = {}
        self._steps: list[dict[float, int]] = [{}, {}, {}]

    def add(self, code: int, xyz: np.ndarray, zero: LocalFrame, side_m: float, folder: Path) -> None:
        """Append points of one class to the files of their squares."""
        keys, number = unique_keys(zero.to_local(xyz), side_m)
        mine = self._classes.setdefault(code, {"squares": {}, "low": [np.inf] * 2, "high": [-np.inf] * 2})
        for place, key in enumerate(keys):
            part = xyz[number == place]
            name = f"{code}_{key[0]}_{key[1]}"
            with (folder / name).open("ab") as file:
                file.write(part.tobytes())
            mine["squares"][name] = mine["squares"].get(name, 0) + len(part)
        mine["low"] = np.minimum(mine["low"], xyz[:, :2].min(axis=0)).tolist()
        mine["high"] = np.maximum(mine["high"], xyz[:, :2].max(axis=0)).tolist()
        self._steps = [
            _merged([list(steps.items()), np.transpose(np.unique(column, return_counts=True)).tolist()])
            for steps, column in zip(self._steps, origin_steps(xyz).T)
        ]

    def report(self) -> dict:
        """Give `SpooledFile.report`."""
        classes = {str(code): found for code, found in self._classes.items()}
        return {
            "classes": classes,
            "census": self.census.tolist(),
            "steps": [list(map(list, steps.items())) for steps in self._steps],
        }


def _merged(counts: Sequence[Sequence[Sequence[float]]]) -> dict[float, int]:
    """Add up lists of values and counts, by rising value."""
    total: dict[float, int] = {}
    for one in counts:
        for value, count in one:
            total[value] = total.get(value, 0) + int(count)
    return dict(sorted(total.items()))


def _source(code: int, found: Sequence[SpooledFile], frame: LocalFrame, side_m: float) -> SpooledPoints:
    """Put together what was found of one class."""
    counts: dict[Key, int] = {}
    files: dict[Key, tuple[str, ...]] = {}
    mine = [(file.folder, file.report["classes"][str(code)]) for file in found if str(code) in file.report["classes"]]
    for folder, of_class in mine:
        for name, count in of_class["squares"].items():
            key = (int(name.split("_")[1]), int(name.split("_")[2]))
            counts[key] = counts.get(key, 0) + count
            files[key] = (*files.get(key, ()), str(Path(folder) / name))
    low = np.min([of_class["low"] for _, of_class in mine], axis=0)
    high = np.max([of_class["high"] for _, of_class in mine], axis=0)
    return SpooledPoints(frame, code, side_m, counts, float((high - low).max() * frame.horizontal_unit_m), files)


def _fingerprint(request: Request, header: CloudHeader, side_m: float) -> str:
    """Name that changes with the file and with all that decides which of its points go where."""
    state = header.path.stat()
    facts = (
        str(header.path.resolve()),
        state.st_size,
        state.st_mtime_ns,
        sorted(request.class_codes),
        request.extent,
        side_m,
        request.zero.horizontal_unit_m,
        request.zero.vertical_unit_m,
    )
    return hashlib.sha256(repr(facts).encode()).hexdigest()[:24]
