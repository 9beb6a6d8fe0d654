"""FRPDF over a whole raster: overlapping windows, each pass stitched before the next."""

from __future__ import annotations

import numpy as np

from ..progress import SILENT, Progress
from ..raster import TILE, RailRaster
from . import DEFAULT_PASSES, FEEDBACK_THRESHOLD, OUTPUT_THRESHOLD, START
from .engine import Engine

WINDOW = 512
"""Cells along the side of what the network sees at once: a pass over it takes well below a second on two cores, so
that a cancel is heard in time."""
MARGIN = 64
"""Cells around a window's core that only give context. Twice the margin changes 1.5 % of the sample's rail cells, at
their edges, and no line by more than 0.7 mm rms, for more than twice the work."""
CORE = WINDOW - 2 * MARGIN
BLOCK = 32
"""Windows are placed to so many cells."""
REACH = 64
"""How far from a rail cell, in cells, the network may set another: half of a gap of 5 m at 4 cm."""

UNTIL_STABLE = 0
MOST_PASSES = 5
STABLE_SHARE = 0.001
"""Passes end once fewer than this share of the rail cells change."""


def clean(raster: RailRaster, engine: Engine, passes: int = DEFAULT_PASSES, progress: Progress = SILENT) -> RailRaster:
    """Remove noise and bridge gaps with the network (paper, sections 5 and 7).

    Parameters
    ----------
    raster : RailRaster
    engine : Engine
    passes : int
        Number of passes; 0 runs until the result is stable, five at most.
    progress : Progress

    Returns
    -------
    RailRaster
        On the same grid.
    """
    places = windows(raster)
    most = MOST_PASSES if passes == UNTIL_STABLE else passes
    state, output = None, raster
    for number in range(most):
        step = progress.span(number / most, (number + 1) / most)
        before = output
        state, output = _run_pass(raster, state, engine, number, places, step)
        if passes == UNTIL_STABLE and number > 0 and _change(before, output) < STABLE_SHARE:
            break
    return output


def windows(raster: RailRaster) -> list[tuple[int, int]]:
    """North-west corners (row, column) of the cores to compute: together they hold all within `REACH` of a rail cell.

    The cores lie in bands along the rows or along the columns, whichever takes fewer; within a band each begins where
    there is something to compute.
    """
    cells = raster.cells()
    shifts = [np.array([down, right]) for down in (-REACH, 0, REACH) for right in (-REACH, 0, REACH)]
    blocks = np.unique(np.concatenate([np.unique((cells + shift) // BLOCK, axis=0) for shift in shifts]), axis=0)
    along_rows = _cover(blocks)
    along_columns = [(row, column) for column, row in _cover(blocks[:, ::-1])]
    return sorted(min(along_rows, along_columns, key=len))


def _cover(blocks: np.ndarray) -> list[tuple[int, int]]:
    """Cover blocks, (n, 2), by cores in bands of equal first coordinate; give the corners of the cores in cells."""
    if len(blocks) == 0:
        return []
    side = CORE // BLOCK
    band = (blocks[:, 0] - blocks[:, 0].min()) // side
    corners = []
    for number in np.unique(band):
        places = np.unique(blocks[band == number, 1])
        first = (int(number) * side + int(blocks[:, 0].min())) * BLOCK
        index = 0
        while index < len(places):
            corners.append((first, int(places[index]) * BLOCK))
            index = int(np.searchsorted(places, places[index] + side))
    return corners


def _run_pass(
    raster: RailRaster,
    state: RailRaster | None,
    engine: Engine,
    number: int,
    places: list[tuple[int, int]],
    progress: Progress,
) -> tuple[RailRaster, RailRaster]:
    """Compute one pass at all places; give what the next pass is told, and what the user would get."""
    told, output = _Canvas(raster), _Canvas(raster)
    for row, column in progress.follow(places):
        frame = (row - MARGIN, column - MARGIN, WINDOW, WINDOW)
        seen = raster.read(*frame).astype(np.float32)
        known = np.full_like(seen, START) if state is None else state.read(*frame).astype(np.float32)
        probability = engine.probabilities(seen, known, number)[MARGIN : MARGIN + CORE, MARGIN : MARGIN + CORE]
        told.paint(row, column, probability >= FEEDBACK_THRESHOLD)
        output.paint(row, column, probability >= OUTPUT_THRESHOLD)
    return told.raster(), output.raster()


def _change(before: RailRaster, after: RailRaster) -> float:
    """Share of the rail cells that differ."""
    differing = sum(
        np.count_nonzero(
            before.read(*(TILE * np.array(index)), TILE, TILE) != after.read(*(TILE * np.array(index)), TILE, TILE)
        )
        for index in set(before.tiles) | set(after.tiles)
    )
    return differing / max(after.count(), 1)


class _Canvas:
    """A raster under construction, on another one's grid."""

    def __init__(self, grid: RailRaster) -> None:
        self._grid = grid
        self._cells: list[np.ndarray] = []

    def paint(self, row: int, column: int, block: np.ndarray) -> None:
        """Set the cells of a block whose north-west corner is given."""
        self._cells.append(np.argwhere(block) + np.array([row, column]))

    def raster(self) -> RailRaster:
        """Finish."""
        cells = np.concatenate(self._cells) if self._cells else np.empty((0, 2), dtype=np.int64)
        return self._grid.with_cells(cells)
