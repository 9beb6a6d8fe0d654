"""Point clouds in files: which files a path stands for, their headers and their points."""

from __future__ import annotations

import errno
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType
from typing import Union

import numpy as np

from ..errors import Cancelled, CloudError, EmptyCloudError, RailExtractError
from ..progress import SILENT, Progress
from .header import CloudHeader, Extent, list_tiles

SUFFIXES = (".las", ".laz")
"""Suffixes of files that are read. COPC files end in .copc.laz."""

OTHER_FORMATS = {".ply": "a PLY", ".e57": "an E57", ".pts": "a PTS", ".ptx": "a PTX", ".xyz": "an XYZ"}
"""Formats of point clouds that are not read: rail points have a class, and lengths need a coordinate system."""

CATALOGUE = ".vpc"
"""Suffix of files that name clouds."""

NOT_OF_THE_FILE = (RailExtractError, Cancelled, MemoryError, KeyboardInterrupt, SystemExit, GeneratorExit)
"""What a reader raises for other reasons than an unforeseen damage of the file."""

NO_THREADS = "ThreadPoolBuildError"
"""Word of what lazrs raises where there is too little memory for its threads."""

IMPOSSIBLE = (None, errno.EINVAL, errno.EOVERFLOW)
"""Codes of an `OSError` that a damaged file causes, such as by a position before its start."""

Chunk = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Coordinates (n, 3) in units of the CRS, classes (n,) and marks (n,) of the points that were kept, and the number of
points read by class (256,), kept or not."""

Points = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Coordinates (n, 3) in units of the CRS, classes (n,), marks (n,), and which points are not withheld, (n,) bool."""

WILDCARDS = "*?"
"""Characters of patterns such as tiles/2024_*.laz, which not every shell replaces with the names of files."""

Paths = Union[str, Path, Sequence[Union[str, Path]]]
"""Files, or folders of them."""


def read_header(path: Path) -> CloudHeader:
    """Read and check the header of one file, without its points."""
    with _reader(path) as las:
        return las.read_header(path)


def shows_scanner(path: Path) -> bool:
    """Return whether the first points of a file have intensities, GPS times or several returns, as a scanner's have.

    Points that are matched from images have none of these. Raises errors as `read_header` does.
    """
    with _reader(path) as las:
        return las.shows_scanner(path)


def first_header(paths: Paths) -> CloudHeader:
    """Read the header of the first file that has points; errors as for `read_header`."""
    *others, last = list_files(paths)
    for path in others:
        with suppress(EmptyCloudError):
            return read_header(path)
    return read_header(last)


def read_classes(
    path: Path,
    class_codes: Sequence[int],
    progress: Progress = SILENT,
    extent: Extent | np.ndarray | None = None,
    leave_out: Sequence[str] = (),
) -> Iterator[Chunk]:
    """Read a file chunk by chunk and keep the points of some classes, 0 to 255; withheld points are left out.

    `extent` is where points are needed, a rectangle or several, (k, 4): those elsewhere may be left out if that saves
    time, as in COPC files. Points with the flags in `leave_out`, some of `parameters.LEAVE_OUT`, are treated like
    withheld ones.

    Of each chunk it yields the points kept, (n, 3) in units of the CRS, their classes, (n,), their marks, (n,), see
    `passes.marks_of`, all 0 where the file states neither source ids nor times, and the number of its points by class,
    (256,), kept or not, without withheld ones; of a file that is not read as a whole, only those of the classes to
    keep. Raises CloudError if the file has an unknown suffix, or turns out to be cut off or damaged.
    """
    wanted = np.zeros(256, dtype=bool)
    wanted[list(class_codes)] = True
    with _reader(path) as las:
        for places, codes, marks, valid, whole in las.read_chunks(path, progress, extent, leave_out):
            keep = np.flatnonzero(wanted[codes] & valid)
            counted = codes[valid] if whole else codes[keep]
            yield places(keep), codes[keep], marks[keep], np.bincount(counted, minlength=256)


def read_points(path: Path, progress: Progress = SILENT, leave_out: Sequence[str] = ()) -> Iterator[Points]:
    """Read all points of a file chunk by chunk, in the order of the file; see `Points` and `read_classes`.

    Points that are withheld or have a flag to leave out are yielded, too, and marked as such.
    """
    with _reader(path) as las:
        for places, codes, marks, valid, _ in las.read_chunks(path, progress, None, leave_out):
            yield places(slice(None)), codes, marks, valid


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn whatever a reader raises because of a file into a `CloudError` that names the file."""
    try:
        yield
    except NOT_OF_THE_FILE:
        raise
    except BaseException as error:  # such as lazrs' PanicException, which is not an Exception
        if isinstance(error, OSError) and error.errno not in IMPOSSIBLE:
            raise CloudError(
                f"{path.name} can't be read ({error.strerror}): check its permissions, the disk or the network drive."
            ) from error
        reason = " ".join(str(error).split()) or type(error).__name__
        if NO_THREADS in reason:
            raise MemoryError(reason) from error
        raise CloudError(f"{path.name} is cut off or damaged ({reason}): copy or export it again.") from error


def paths_of(paths: Paths) -> list[Path]:
    """Return one path or several as a list."""
    return [Path(path) for path in ([paths] if isinstance(paths, (str, Path)) else paths)]


def list_files(paths: Paths) -> tuple[Path, ...]:
    """List the cloud files of one path or several, each file once.

    A folder stands for the cloud files in it, sorted by name, and a virtual point cloud for its tiles. Raises
    CloudError if a path does not exist or has an unknown suffix, a folder contains no cloud, or a virtual point cloud
    is damaged.
    """
    files: list[Path] = []
    for path in paths_of(paths):
        with explained(path):
            files.extend(file.absolute() for file in _files_of(path))  # a worker may run in another folder
    if not files:
        raise CloudError("No point cloud was given: name a file or a folder of tiles.")
    for file in files:
        _check_format(file)
    return tuple({file.resolve(): file for file in reversed(files)}.values())[::-1]


def _files_of(path: Path) -> Sequence[Path]:
    """List the files that one path stands for."""
    if not path.exists() and set(WILDCARDS) & set(str(path)):
        matches = sorted(Path(path.anchor).glob(str(path.relative_to(path.anchor))))
        if not matches:
            raise CloudError(f"No file matches {path}: check the folder and the pattern.")
        return [file for match in matches for file in _files_of(match)]
    if not path.exists():
        raise CloudError(
            f"{path} does not exist: give a {either(*SUFFIXES, CATALOGUE)} file, or a folder of tiles, on this "
            "computer."
        )
    if not path.is_dir() and not path.is_file():
        raise CloudError(f"{path} is a pipe or a device, not a file: copy the cloud into a file.")
    if not path.is_dir():
        return list_tiles(path) if path.suffix.lower() == CATALOGUE else [path]
    # On file systems other than its own, macOS puts a hidden file next to each: its name starts with a dot.
    tiles = sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES and file.name[0] != ".")
    if not tiles:
        raise CloudError(f"The folder {path} contains no {either(*SUFFIXES)} file: choose another folder.")
    return tiles


@contextmanager
def _reader(path: Path) -> Iterator[ModuleType]:
    """Provide the module that reads a file; what it raises because of the file becomes a `CloudError`."""
    _check_format(path)
    with explained(path):
        from . import las  # not before: QGIS lacks the packages that it needs

        yield las


def _check_format(path: Path) -> None:
    suffix = path.suffix.lower()
    if suffix in OTHER_FORMATS:
        raise CloudError(
            f"{path.name} is {OTHER_FORMATS[suffix]} file, which states neither classes nor a coordinate "
            "system in a standard way: convert it to LAS or LAZ, for example with CloudCompare or PDAL."
        )
    if suffix not in SUFFIXES:
        raise CloudError(f"{path.name} has no suffix of a known cloud format: export the cloud as {either(*SUFFIXES)}.")


def either(*words: str) -> str:
    """Enumerate words: .las, .laz or .vpc."""
    *others, last = words
    return f"{', '.join(others)} or {last}" if others else last
