"""The points around guides, sorted into squares on disk: of any cloud, only what the fit needs is kept."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..clouds.points import Request
from ..clouds.readers import read_classes
from ..disk import writing
from ..progress import Progress
from ..tasks import READ_S, Context, Runner, Task
from .beside import WIDE_M
from .ridges import HALF_M
from .squares import Key, Piece, areas_along, cells_around, in_cells

POINT = np.dtype([("xyz", "<f8", 3), ("mark", "<u4")])
"""A point on disk: metres from the zero of the coordinate system, and its mark, see `passes.marks_of`."""

PLACE_M = 2.0
"""Side of the squares in which the density is counted."""


def spool(
    request: Request,
    squares: Mapping[Key, tuple[Piece, ...]],
    reach_m: float,
    folder: Path,
    runner: Runner,
    progress: Progress,
) -> dict[Key, int]:
    """Sort the points around the guides into squares on disk, and return the number in each.

    Parameters
    ----------
    request : Request
    squares : mapping of Key to tuple of Piece
    reach_m : float
        Largest distance of a track from its guide.
    folder : Path
    runner : Runner
        Executes one task per file.
    progress : Progress
    """
    wide_m = reach_m + WIDE_M + HALF_M
    areas = areas_along(squares, wide_m) / request.zero.horizontal_unit_m
    around = {key: cells_around([piece.axis for piece in pieces], wide_m) for key, pieces in squares.items()}
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    tasks = {}
    for number, header in enumerate(request.headers):
        low, high = np.array(header.extent[:2]), np.array(header.extent[2:])
        touched = ~((areas[:, :2] > high) | (areas[:, 2:] < low)).any(axis=1)  # an extent of NaN may be anywhere
        if touched.any():
            arguments = (request, number, areas[touched], around, folder)
            tasks[number] = Task(header.path.name, spool_file, arguments, weight=READ_S * (header.point_count + 1))
    counts: dict[Key, int] = {}
    for _, one in runner.run(tasks, progress):
        for key, count in one.items():
            counts[key] = counts.get(key, 0) + count
    return counts


def spool_file(
    request: Request, number: int, areas: np.ndarray, around: Mapping[Key, np.ndarray], folder: Path, context: Context
) -> dict[Key, int]:
    """Sort the points of a file into squares, and return the number in each; a task.

    Parameters
    ----------
    request : Request
    number : int
        Of the file.
    areas : (k, 4) array
        Rectangles in which points are needed, units of the CRS.
    around : mapping of Key to (m,) array
        Cells whose points each square needs.
    folder : Path
    context : Context
    """
    header = request.headers[number]
    counts: dict[Key, int] = {}
    chunks = read_classes(header.path, request.class_codes, context.progress, areas, request.leave_out)
    for xyz, _, marks, _ in chunks:
        kept = request.holds(xyz)
        local, marks = request.zero.to_local(xyz[kept]), marks[kept]
        for key, cells in around.items():
            inside = in_cells(local[:, :2], cells)
            if not inside.any():
                continue
            points = np.empty(int(inside.sum()), POINT)
            points["xyz"], points["mark"] = local[inside], marks[inside]
            counts[key] = counts.get(key, 0) + len(points)
            with writing(folder), _file(folder, key, number).open("ab") as file:
                file.write(points.tobytes())
    return counts


def _file(folder: Path, key: Key, number: int) -> Path:
    return folder / f"{key[0]}_{key[1]}_{number}"


def points_of(folder: Path, key: Key) -> np.ndarray:
    """Return the points of a square, (n,) `POINT`."""
    files = sorted(folder.glob(f"{key[0]}_{key[1]}_*"))
    return np.concatenate([np.fromfile(file, POINT) for file in files])


def density_of(xy: np.ndarray) -> np.ndarray:
    """Return the number of places, (n, 2), in each square of `PLACE_M` that has one, per square metre."""
    _, number = np.unique(np.floor(xy / PLACE_M).astype(np.int64), axis=0, return_counts=True)
    return number / PLACE_M**2
