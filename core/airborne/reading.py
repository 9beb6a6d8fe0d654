"""The points around guides: guides are divided into squares, and the points sorted by them on disk.

The squares are those of a grid anchored at the zero of the coordinate system, so that memory does not grow with the
length of a railway. In each, the pieces of all guides are fitted together, with as much of them around it as their
curves depend on. Of any cloud, only what the fit needs is kept.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..clouds.points import Request
from ..clouds.readers import Extent, read_classes
from ..parameters import AirborneParameters
from ..polyline import Polyline
from ..progress import SILENT, Progress
from ..run.loop import Runner
from ..run.tasks import READ_S, Context, Task
from ..tiles.grid import Key
from ..tiles.store import SortedFile, append
from .cross_sections import STATION_M
from .ridges import HALF_M
from .rivals import WIDE_M

SIDE_M = 1000.0
"""Side of the squares: with 40 points per square metre and four tracks, one needs 0.3 GB."""

MARGIN_M = 120.0
"""Length of a guide beyond the square on which a curve within it depends: twelve stations."""

CELL_M = 16.0
"""Side of the cells that make up the surroundings of guides."""

AREA_M = 200.0
"""Length of guide in a rectangle in which points are read."""

ROW = 2**31
"""Cells in a row, so that one number stands for a cell."""

POINT = np.dtype([("xyz", "<f8", 3), ("mark", "<u4")])
"""A point on disk: metres from the zero of the coordinate system, and its mark, see `passes.marks_of`."""

PLACE_M = 2.0
"""Side of the squares in which the density is counted."""


@dataclass(frozen=True)
class Run:
    """A run on an airborne cloud: one task per file and one per square.

    The caller removes the folder, which holds 28 bytes for each point around the guides.
    """

    request: Request
    parameters: AirborneParameters
    folder: Path
    runner: Runner
    progress: Progress = SILENT


@dataclass(frozen=True)
class Piece:
    """The part of guide `number` in a square, whose stations are those between two chainages of the guide.

    The axis has margins, and its first chainage is a multiple of `STATION_M`.
    """

    number: int
    axis: Polyline
    first_m: float
    last_m: float


def pieces_by_square(axes: Sequence[Polyline]) -> dict[Key, tuple[Piece, ...]]:
    """Divide guides into squares."""
    found: dict[Key, list[Piece]] = {}
    for number, axis in enumerate(axes):
        for key, first_m, last_m in _stays(axis):
            low_m = max(np.floor((first_m - MARGIN_M) / STATION_M) * STATION_M, 0.0)
            inside = slice(*np.searchsorted(axis.t, [low_m, np.nextafter(last_m + MARGIN_M, np.inf)]))
            around = Polyline(axis.xy[inside], axis.t[inside])
            found.setdefault(key, []).append(Piece(number, around, first_m, last_m))
    return {key: tuple(pieces) for key, pieces in sorted(found.items())}


def _stays(axis: Polyline) -> Iterator[tuple[Key, float, float]]:
    """Yield each stay of a guide in a square, by the middles of its sections, with the chainages of its ends."""
    count = max(int(np.ceil(axis.t[-1] / STATION_M)), 1)
    middles = (np.arange(count) + 0.5) * STATION_M
    keys = np.floor(axis.at(middles) / SIDE_M).astype(np.int64)
    turns = np.flatnonzero((np.diff(keys, axis=0) != 0).any(axis=1)) + 1
    for run in np.split(np.arange(count), turns):
        key = (int(keys[run[0], 0]), int(keys[run[0], 1]))
        yield key, float(run[0] * STATION_M), float((run[-1] + 1) * STATION_M)


def cells_around(axes: Sequence[Polyline], reach_m: float) -> np.ndarray:
    """Return the numbers of the cells within reach of lines, rising."""
    steps = np.arange(-int(np.ceil(reach_m / CELL_M)), int(np.ceil(reach_m / CELL_M)) + 1)
    around = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    cells = np.unique(np.concatenate([np.floor(axis.xy / CELL_M).astype(np.int64) for axis in axes]), axis=0)
    return np.unique(numbers_of((cells[:, None] + around).reshape(-1, 2)))


def in_cells(xy: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return which places, (n, 2), lie in cells, given by their numbers, (n,) bool."""
    number = numbers_of(np.floor(xy / CELL_M).astype(np.int64))
    at = np.minimum(np.searchsorted(cells, number), len(cells) - 1)
    return cells[at] == number


def numbers_of(cells: np.ndarray) -> np.ndarray:
    """Return a number for each cell, given by its column and row, (n, 2)."""
    return cells[:, 0] * ROW + cells[:, 1]


def areas_along(pieces: Sequence[Piece], reach_m: float) -> np.ndarray:
    """Return rectangles that hold all places within reach of the pieces, (k, 4) metres."""
    parts = [
        part for piece in pieces for part in np.array_split(piece.axis.xy, max(int(len(piece.axis.xy) / AREA_M), 1))
    ]
    low, high = (np.array([reduce(part, axis=0) for part in parts]) for reduce in (np.min, np.max))
    return np.column_stack([low - reach_m, high + reach_m])


def spool(run: Run, squares: Mapping[Key, tuple[Piece, ...]]) -> list[SortedFile]:
    """Sort the points around the guides into squares on disk."""
    request, folder = run.request, run.folder
    wide_m = run.parameters.reach_m + WIDE_M + HALF_M
    areas = {key: areas_along(pieces, wide_m) / request.zero.horizontal_unit_m for key, pieces in squares.items()}
    around = {key: cells_around([piece.axis for piece in pieces], wide_m) for key, pieces in squares.items()}
    tasks = {}
    for number, header in enumerate(request.headers):
        touched = {key: some for key, all_areas in areas.items() if len(some := _touched(all_areas, header.extent))}
        if touched:
            arguments = (request, number, np.concatenate([*touched.values()]), {key: around[key] for key in touched})
            weight = READ_S * (header.point_count + 1)
            tasks[number] = Task(header.path.name, spool_file, (*arguments, folder), weight=weight)
    return [one for _, one in run.runner.run(tasks, run.progress)]


def _touched(areas: np.ndarray, extent: Extent) -> np.ndarray:
    """Return the rectangles, (k, 4), that touch an extent; one of NaN may be anywhere."""
    low, high = np.array(extent[:2]), np.array(extent[2:])
    return areas[~((areas[:, :2] > high) | (areas[:, 2:] < low)).any(axis=1)]


def spool_file(
    request: Request, number: int, areas: np.ndarray, around: Mapping[Key, np.ndarray], folder: Path, context: Context
) -> SortedFile:
    """Sort the points of a file into squares; a task.

    Given are rectangles in which points are needed, (k, 4) in units of the CRS, and the cells whose points each square
    needs.
    """
    header, mine = request.headers[number], SortedFile.new_folder(folder)
    counts: Counter[Key] = Counter()
    anywhere = np.unique(np.concatenate([*around.values()]))
    chunks = read_classes(header.path, request.class_codes, context.progress, areas, request.leave_out)
    for xyz, _, marks, _ in chunks:
        local = request.zero.to_local(xyz)
        kept = in_cells(local[:, :2], anywhere) & request.holds(xyz)
        points = np.empty(int(kept.sum()), POINT)
        points["xyz"], points["mark"] = local[kept], marks[kept]
        for key, cells in around.items():
            own = points[in_cells(points["xyz"][:, :2], cells)]
            if len(own):
                counts[key] += len(own)
                append(mine, key, own)
    return SortedFile(str(mine), counts)


def density_of(xy: np.ndarray) -> np.ndarray:
    """Return the number of places, (n, 2), in each square of `PLACE_M` that has one, per square metre."""
    _, number = np.unique(numbers_of(np.floor(xy / PLACE_M).astype(np.int64)), return_counts=True)
    return number / PLACE_M**2
