"""Formats of point clouds: which module reads which suffix, and which files a path stands for.

To add a format, write a module with the functions of `Reader` and add its suffix to `READERS`.
"""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Protocol, Union, cast

import numpy as np

from ..errors import Cancelled, CloudError, EmptyCloudError, RailExtractError
from ..progress import SILENT, Progress
from .vpc import list_tiles

READERS = {".las": "las", ".laz": "las"}
"""Module of this package by the suffix of the files it reads. It is imported on first use, because QGIS lacks the
packages that readers need. COPC files end in .copc.laz."""

OTHER_FORMATS = {".ply": "a PLY", ".e57": "an E57", ".pts": "a PTS", ".ptx": "a PTX", ".xyz": "an XYZ"}
"""Formats of point clouds that are not read: rail points have a class, and lengths need a coordinate system."""

CATALOGUES: dict[str, Callable[[Path], Sequence[Path]]] = {".vpc": list_tiles}
"""Functions that list the clouds named in a file, by its suffix."""

NOT_OF_THE_FILE = (RailExtractError, Cancelled, MemoryError, KeyboardInterrupt, SystemExit, GeneratorExit)
"""What a reader raises for other reasons than an unforeseen damage of the file."""

NO_THREADS = "ThreadPoolBuildError"
"""Word of what lazrs raises where there is too little memory for its threads."""

IMPOSSIBLE = (None, errno.EINVAL, errno.EOVERFLOW)
"""Codes of an `OSError` that a damaged file causes, such as by a position before its start."""

Extent = tuple[float, float, float, float]
"""Smallest x, smallest y, largest x, largest y, in units of the CRS."""

Chunk = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Coordinates (n, 3) in units of the CRS, classes (n,) and marks (n,) of the points that were kept, and the number of
points read by class (256,), kept or not."""

Points = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Coordinates (n, 3) in units of the CRS, classes (n,), marks (n,), and which points are not withheld, (n,) bool."""

Part = tuple[Callable[[Union[np.ndarray, slice]], np.ndarray], np.ndarray, np.ndarray, np.ndarray, bool]
"""A chunk of points: a function that returns the coordinates (k, 3) of some of them, classes (n,), marks (n,) and which
are valid (n,) bool, as in `Points`, and whether the file is read as a whole."""

WILDCARDS = "*?"
"""Characters of patterns such as tiles/2024_*.laz, which not every shell replaces with the names of files."""

Paths = Union[str, Path, Sequence[Union[str, Path]]]
"""Files, or folders of them."""


@dataclass(frozen=True)
class CloudHeader:
    """What the header of a file states.

    Attributes
    ----------
    path : Path
    point_count : int
    extent : tuple of float
        Smallest x, smallest y, largest x, largest y in units of the CRS.
    crs_wkt : str or None
        Coordinate system as WKT 2; None if the file states none that PROJ understands.
    """

    path: Path
    point_count: int
    extent: Extent
    crs_wkt: str | None


class Reader(Protocol):
    """What a module in `READERS` offers."""

    def read_header(self, path: Path) -> CloudHeader:
        """Read and check the header of a file, without its points; see `read_header`."""

    def read_chunks(
        self, path: Path, progress: Progress, extent: Extent | np.ndarray | None, leave_out: Sequence[str]
    ) -> Iterator[Part]:
        """Read all points of a file chunk by chunk, or those that may be in an extent; see `read_classes`."""

    def shows_scanner(self, path: Path) -> bool:
        """Return whether the first points of a file have what only a scanner measures; see `shows_scanner`."""


def read_header(path: Path) -> CloudHeader:
    """Read and check the header of one file, without its points.

    Raises
    ------
    CloudError
        The file has an unknown suffix, is damaged, is cut off or has no points.
    """
    with explained(path):
        return _reader(path).read_header(path)


def shows_scanner(path: Path) -> bool:
    """Return whether the first points of a file have intensities, GPS times or several returns, as a scanner's have.

    Points that are matched from images have none of these. Raises errors as `read_header` does.
    """
    with explained(path):
        return _reader(path).shows_scanner(path)


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
    """Read a file chunk by chunk and keep the points of some classes; withheld points are left out.

    Parameters
    ----------
    path : Path
    class_codes : sequence of int
        Classes to keep, 0 to 255.
    progress : Progress
    extent : tuple of float or (k, 4) array, optional
        Where points are needed, one rectangle or several: those elsewhere may be left out where that saves time, as in
        COPC files.
    leave_out : sequence of str
        Some of `parameters.LEAVE_OUT`: points with these flags are treated like withheld ones.

    Yields
    ------
    xyz : (n, 3) array
        Points kept from a chunk, in units of the CRS.
    codes : (n,) uint8 array
        Their classes.
    marks : (n,) uint32 array
        What tells their passes apart, see `passes.marks_of`. All 0 where the file states neither source ids nor times.
    census : (256,) int array
        Points in the chunk by class, kept or not, without withheld ones. Of a file that is not read as a whole, only
        those of the classes to keep.

    Raises
    ------
    CloudError
        The file has an unknown suffix, or turns out to be cut off or damaged.
    """
    wanted = np.zeros(256, dtype=bool)
    wanted[list(class_codes)] = True
    with explained(path):
        for places, codes, marks, valid, whole in _reader(path).read_chunks(path, progress, extent, leave_out):
            keep = np.flatnonzero(wanted[codes] & valid)
            counted = codes[valid] if whole else codes[keep]
            yield places(keep), codes[keep], marks[keep], np.bincount(counted, minlength=256)


def read_points(path: Path, progress: Progress = SILENT, leave_out: Sequence[str] = ()) -> Iterator[Points]:
    """Read all points of a file chunk by chunk, in the order of the file.

    Parameters
    ----------
    path : Path
    progress : Progress
    leave_out : sequence of str
        See `read_classes`.

    Yields
    ------
    xyz : (n, 3) array
        In units of the CRS.
    codes : (n,) uint8 array
        Classes.
    marks : (n,) uint32 array
        See `read_classes`.
    valid : (n,) bool array
        Points that are neither withheld nor to be left out.

    Raises
    ------
    CloudError
        See `read_classes`.
    """
    with explained(path):
        for places, codes, marks, valid, _ in _reader(path).read_chunks(path, progress, None, leave_out):
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

    A folder stands for the cloud files in it, sorted by name, and a virtual point cloud for its tiles.

    Raises
    ------
    CloudError
        A path does not exist or has an unknown suffix, a folder contains no cloud, or a virtual point cloud is damaged.
    """
    files: list[Path] = []
    for path in paths_of(paths):
        with explained(path):
            files.extend(file.absolute() for file in _files_of(path))  # a worker may run in another folder
    if not files:
        raise CloudError("No point cloud was given: name a file or a folder of tiles.")
    for file in files:
        _module_of(file)
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
            f"{path} does not exist: give a {_any_of((*READERS, *CATALOGUES))} file, or a folder of tiles, on this "
            "computer."
        )
    if not path.is_dir() and not path.is_file():
        raise CloudError(f"{path} is a pipe or a device, not a file: copy the cloud into a file.")
    if not path.is_dir():
        return CATALOGUES.get(path.suffix.lower(), lambda file: [file])(path)
    # On file systems other than its own, macOS puts a hidden file next to each: its name starts with a dot.
    tiles = sorted(file for file in path.iterdir() if file.suffix.lower() in READERS and file.name[0] != ".")
    if not tiles:
        raise CloudError(f"The folder {path} contains no {_any_of(READERS)} file: choose another folder.")
    return tiles


def _reader(path: Path) -> Reader:
    return cast(Reader, import_module(f".{_module_of(path)}", __package__))


def _module_of(path: Path) -> str:
    """Name the module that reads a file."""
    module = READERS.get(path.suffix.lower())
    if module is None and path.suffix.lower() in OTHER_FORMATS:
        raise CloudError(
            f"{path.name} is {OTHER_FORMATS[path.suffix.lower()]} file, which states neither classes nor a coordinate "
            "system in a standard way: convert it to LAS or LAZ, for example with CloudCompare or PDAL."
        )
    if module is None:
        raise CloudError(f"{path.name} has no suffix of a known cloud format: export the cloud as {_any_of(READERS)}.")
    return module


def _any_of(suffixes: Iterable[str]) -> str:
    """Enumerate suffixes: .las, .laz or .vpc."""
    *others, last = suffixes
    return f"{', '.join(others)} or {last}" if others else last
