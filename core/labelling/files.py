"""Classified copies of the files of a raw cloud: one file, or a folder of the same tiles with a catalogue."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..classify.settings import Settings
from ..clouds.header import catalogue_text
from ..clouds.points import Request
from ..clouds.readers import CATALOGUE, SUFFIXES, list_files
from ..clouds.rewriting import Places, check_class, rewrite
from ..disk import NEW, Destination, alone_in, identity, replace_folder, scratch_folder, writing
from ..errors import DiskError, ParameterError, RailExtractError
from ..grow.growth import Stop
from ..progress import SILENT, Progress
from ..rails import SearchFigures
from ..run.tasks import READ_S, Context, Runner, Task
from ..standards import RAIL_CLASS
from .finding import find_rail_points, report

UNCLASSIFIED = 1
"""Class of a point that loses the rail class."""

COPC = ".copc"


@dataclass(frozen=True)
class Content:
    """What is written: the class of rail points, and whether other points are left out.

    With `reset`, points that have the rail class and are not found lose it.
    """

    class_code: int = RAIL_CLASS
    only_rails: bool = False
    reset: bool = True


@dataclass(frozen=True)
class OutputFiles:
    """Files to write: the one that opens the result (the only one, or the catalogue of the tiles), and names of tiles.

    `before` is the identity of the folder of the tiles that was there when the run began.
    """

    destination: Destination
    names: tuple[str, ...] = ()
    before: tuple[int, int] | None = None

    @property
    def file(self) -> Path:
        """The file that opens the result."""
        return self.destination.path

    @property
    def folder(self) -> Path:
        """Folder of the tiles; if it is a symbolic link, the folder itself."""
        return _folder_at(self.file)


@dataclass(frozen=True)
class ClassifiedFiles:
    """What was written: the file of `OutputFiles`, the number of points that were read, and the figures of the search.

    `stops` are where rails that grew from seeds were not followed further, in metres from the zero of the request; each
    place once.
    """

    file: Path
    point_count: int
    figures: SearchFigures
    stops: tuple[Stop, ...] = ()


def _folder_at(catalogue: Path) -> Path:
    return Path(os.path.realpath(catalogue.with_suffix("")))


def plan_output(paths: Sequence[Path], output: Path, class_code: int, progress: Progress = SILENT) -> OutputFiles:
    """Decide which files to write for an input (files, folders, virtual point clouds), and check that this is possible.

    `output` is where the user wants the result; for tiles, its name without the suffix is that of their folder. Warns
    if a COPC file was asked for. Raises CloudError if a path does not lead to cloud files, DiskError if nothing can be
    written there, and ParameterError if the output has no suffix of a cloud, would replace the input, or its format
    lacks the class.
    """
    files = list_files(paths)
    for file in files:
        check_class(file, class_code)
    is_single = len(files) == 1 and Path(paths[0]).is_file() and Path(paths[0]).suffix.lower() != CATALOGUE
    suffixes = SUFFIXES if is_single else (*SUFFIXES, CATALOGUE)
    if output.suffix.lower() not in suffixes:
        raise ParameterError(
            f"{output.name} is not a name for the classified cloud: let it end in {' or '.join(suffixes)}."
        )
    plain = _without_copc(output, progress)
    names = () if is_single else _tile_names(files, progress)
    main = plain if is_single else plain.with_name(plain.stem + CATALOGUE)
    folder = _folder_at(main)
    written = [main] if is_single else [folder / name for name in names]
    if set(map(os.path.realpath, files)) & set(map(os.path.realpath, written)):
        raise ParameterError("The classified cloud would replace the cloud that is read: choose another name.")
    if names:
        _check_folder(folder, names)
    return OutputFiles(Destination.at(main), names, identity(folder) if names else None)


def classify_files(
    request: Request,
    settings: Settings,
    choice: Content,
    output: OutputFiles,
    folder: Path,
    runner: Runner,
    progress: Progress = SILENT,
) -> ClassifiedFiles:
    """Find the rail points of a cloud, in `standards.SEARCHED_CLASSES`, and write its files with their classes.

    `output` is from `plan_output`, for the files of the request. The caller removes the folder, which gets 42 bytes per
    point. Results of the runner are complete, or there is no output.
    """
    finding, rewriting = progress.divide((2.0, 1.0))
    labels = Labels(request, folder)
    figures = SearchFigures()
    with writing(folder):
        squares = folder / "squares"
        squares.mkdir()
    for found in find_rail_points(request, settings, squares, runner, finding):
        with writing(folder):
            labels.add(found.number)
        figures += found.figures
    _check_complete(runner)
    report(figures, request, progress)
    write_labelled(request, choice, labels, output, runner, rewriting)
    return ClassifiedFiles(output.file, labels.point_count, figures)


def write_labelled(
    request: Request, choice: Content, labels: Labels, output: OutputFiles, runner: Runner, progress: Progress
) -> None:
    """Write the files of a cloud with the classes that follow from the labels; see `classify_files`."""
    progress.status("Writing the classes")
    writer = _Writer(request, choice, labels)
    if output.names:
        writer.write_tiles(output, runner, progress)
    else:
        with output.destination.replacing() as new:
            writer.write(0, new, progress)


def _check_complete(runner: Runner) -> None:
    """Refuse to continue without the results of tasks that failed."""
    if runner.failures:
        raise RailExtractError(f"{runner.failures[-1]} Nothing was written.")


class Labels:
    """Numbers of the rail points of each file, on disk."""

    def __init__(self, request: Request, folder: Path) -> None:
        counts = [header.point_count for header in request.headers]
        self.starts = np.append(0, np.cumsum(counts)).astype(np.int64)
        self.folder = folder

    @property
    def point_count(self) -> int:
        """Points in all files."""
        return int(self.starts[-1])

    def add(self, number: np.ndarray) -> None:
        """Append rail points by their numbers among all points of all files, (k,) int."""
        file = np.searchsorted(self.starts, number, side="right") - 1
        for place in np.unique(file).tolist():
            with self._file(place).open("ab") as stream:
                stream.write((number[file == place] - self.starts[place]).tobytes())

    def of(self, place: int) -> np.ndarray:
        """Return the numbers of a file's rail points within the file, ascending."""
        file = self._file(place)
        return np.sort(np.fromfile(file, np.int64)) if file.exists() else np.empty(0, np.int64)

    def _file(self, place: int) -> Path:
        return self.folder / f"labels_{place}"


class _Writer:
    """Writes the files of a cloud with their new classes."""

    def __init__(self, request: Request, choice: Content, labels: Labels) -> None:
        self._request, self._choice, self._labels = request, choice, labels

    def write(self, place: int, new: Path, progress: Progress) -> int:
        """Write one file; returns how many points it has."""
        numbers, done = self._labels.of(place), 0

        def change(codes: np.ndarray, places: Places) -> tuple[np.ndarray, np.ndarray]:
            nonlocal done
            rail = np.zeros(len(codes), dtype=bool)
            first, last = np.searchsorted(numbers, (done, done + len(codes)))
            rail[numbers[first:last] - done] = True
            done += len(codes)
            return self._classes(codes, places, rail), rail | (not self._choice.only_rails)

        return rewrite(self._request.headers[place].path, new, change, progress)

    def write_tiles(self, output: OutputFiles, runner: Runner, progress: Progress) -> None:
        """Write all tiles into a temporary folder, then move it to its name and write the catalogue."""
        parent = output.folder.parent
        with writing(parent), scratch_folder(parent) as scratch:
            new = scratch / NEW / output.folder.name
            new.mkdir(parents=True)
            tasks = {
                place: Task(
                    f"Writing {name}",
                    _write_tile,
                    (self, place, str(new / name)),
                    weight=READ_S * (header.point_count + 1),
                )
                for place, (name, header) in enumerate(zip(output.names, self._request.headers))
            }
            counts = [count for _, count in runner.run(tasks, progress)]
            _check_complete(runner)
            tiles = [
                (f"./{output.file.stem}/{name}", count, header.extent)
                for name, count, header in zip(output.names, counts, self._request.headers)
            ]
            with output.destination.replacing() as catalogue:
                catalogue.write_text(catalogue_text(tiles, self._request.zero.crs_wkt), encoding="utf-8")
                _move_tiles(output, scratch)

    def _classes(self, codes: np.ndarray, places: Places, rail: np.ndarray) -> np.ndarray:
        """Return the new classes of points, (n,)."""
        choice, changed = self._choice, codes.copy()
        if choice.reset:
            were = np.flatnonzero(codes == choice.class_code)
            changed[were[self._request.holds(places(were))]] = UNCLASSIFIED
        changed[rail] = choice.class_code
        return changed


def _write_tile(writer: _Writer, place: int, new: str, context: Context) -> int:
    """Write one of several files; returns how many points it has. A task."""
    with writing(Path(new).parent):
        return writer.write(place, Path(new), context.progress)


def _without_copc(file: Path, progress: Progress) -> Path:
    """Return the name without the part that marks a COPC file, which can't be written."""
    if Path(file.stem).suffix.lower() != COPC:
        return file
    plain = file.with_name(Path(file.stem).stem + file.suffix)
    progress.warning(f"{file.name} is written as {plain.name}: COPC files can't be written.")
    return plain


def _tile_names(files: Sequence[Path], progress: Progress) -> tuple[str, ...]:
    """Return the name of each new tile; no two may have the same."""
    names = tuple(_without_copc(file, progress).name for file in files)
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice:
        raise ParameterError(f"Two tiles are called {twice}: classify them one folder at a time.")
    return names


def _check_folder(folder: Path, names: Sequence[str]) -> None:
    """Refuse to replace a folder that holds anything else than tiles of these names."""
    if folder.exists() and (not folder.is_dir() or {one.name for one in folder.iterdir()} - set(names)):
        raise DiskError(f"{folder} exists and holds other files: choose another name.")


def _move_tiles(output: OutputFiles, scratch: Path) -> None:
    """Move a new folder of tiles to its name; the old one stays if that fails, or if it was changed."""
    folder = output.folder
    with alone_in(folder.parent):
        if identity(folder) not in (None, output.before):
            raise DiskError(f"{folder} was changed by another program in the meantime. Nothing was written.")
        _check_folder(folder, output.names)
        replace_folder(scratch, folder)
