"""The points around guides, sorted into squares on disk: of any cloud, only what the fit needs is kept."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..clouds.points import Request
from ..clouds.readers import Extent, read_classes
from ..squares.store import SortedFile, append
from ..tasks import READ_S, Context, Task
from .beside import WIDE_M
from .ridges import HALF_M
from .run import Run
from .squares import Key, Piece, areas_along, cells_around, in_cells, numbers_of

POINT = np.dtype([("xyz", "<f8", 3), ("mark", "<u4")])
"""A point on disk: metres from the zero of the coordinate system, and its mark, see `passes.marks_of`."""

PLACE_M = 2.0
"""Side of the squares in which the density is counted."""


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
    return [one for _, one in sorted(run.runner.run(tasks, run.progress), key=lambda pair: pair[0])]


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
