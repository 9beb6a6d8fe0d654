"""Cleaning of a raster with FRPDF in several passes, each along the rails only."""

from __future__ import annotations

import numpy as np

from ..errors import DeviceExhaustedError
from ..progress import SILENT, Progress
from ..raster import TILE, RailRaster
from . import DEFAULT_PASSES, FEEDBACK_THRESHOLD, MAX_PASSES, OUTPUT_THRESHOLD, START
from .corridor import Field, Piece, lay_fields
from .engine import Engine

MARGIN = 64
"""Width in cells, per pass, of the frame of context around a raster that was cut out of a larger one."""

UNTIL_STABLE = 0
"""Number of passes with which a run continues until the result is stable."""
STABLE_SHARE = 0.001
"""Share of the rail cells below which a change ends the passes."""


def max_passes(passes: int) -> int:
    """Return the number of passes after which a run ends in any case."""
    return MAX_PASSES if passes == UNTIL_STABLE else passes


def is_stable(changed: int, cells: int) -> bool:
    """Return whether the number of cells that a pass changed is negligible compared with the number of rail cells."""
    return changed < STABLE_SHARE * max(cells, 1)


def clean(raster: RailRaster, engine: Engine, passes: int = DEFAULT_PASSES, progress: Progress = SILENT) -> RailRaster:
    """Remove noise and close gaps with the network (Gribov and Chang, sections 5 and 7).

    Parameters
    ----------
    raster : RailRaster
    engine : Engine
    passes : int
        Number of passes; with 0, passes run until the result is stable, at most `MAX_PASSES`.
    progress : Progress

    Returns
    -------
    RailRaster
        The cleaned raster, on the same grid.
    """
    most = max_passes(passes)
    state, output = None, raster
    laid: dict[int, list[Field]] = {}
    for number in range(most):
        step = progress.span(number / most, (number + 1) / most)
        before = output
        state, output = _run_pass(raster, state, engine, number, laid, step)
        if passes == UNTIL_STABLE and number > 0 and is_stable(_changed(before, output), output.count()):
            break
    return output


def _run_pass(
    raster: RailRaster,
    state: RailRaster | None,
    engine: Engine,
    number: int,
    laid: dict[int, list[Field]],
    progress: Progress,
) -> tuple[RailRaster, RailRaster]:
    """Run one pass; return the state of the next pass, and the result if this pass is the last one.

    Parameters
    ----------
    raster : RailRaster
    state : RailRaster, optional
        Result of the pass before.
    engine : Engine
    number : int
        Number of the pass, from 0.
    laid : dict of int to list of Field
        Fields by the engine's `max_cells`, which all passes share; the missing ones are added.
    progress : Progress
    """
    while True:
        following, output = _Canvas(raster), _Canvas(raster)
        if engine.max_cells not in laid:
            laid[engine.max_cells] = lay_fields(raster, engine.max_cells)
        fields = laid[engine.max_cells]
        try:
            for field, step in zip(fields, progress.split(len(fields))):
                seen = [raster.read(*piece.window).astype(np.float32) for piece in field.pieces]
                known = [_state(state, piece) for piece in field.pieces]
                found = engine.sweep(seen, known, number, field.pieces, step)
                for piece, probability in zip(field.pieces, found):
                    following.paint(piece, probability >= FEEDBACK_THRESHOLD, field.inside)
                    output.paint(piece, probability >= OUTPUT_THRESHOLD, field.inside)
            return following.raster(), output.raster()
        except DeviceExhaustedError:
            pass  # outside this block the error is released, and with it the memory that its frames hold
        progress.warning(engine.retreat())


def _state(state: RailRaster | None, piece: Piece) -> np.ndarray:
    """Return the state of a piece."""
    if state is None:
        return np.full((piece.height, piece.width), START, dtype=np.float32)
    return state.read(*piece.window).astype(np.float32)


def _changed(before: RailRaster, after: RailRaster) -> int:
    """Count the cells that differ."""
    windows = [(*(TILE * np.array(index)), TILE, TILE) for index in set(before.tiles) | set(after.tiles)]
    return sum(int(np.count_nonzero(before.read(*window) != after.read(*window))) for window in windows)


class _Canvas:
    """A raster under construction, on the grid of another one."""

    def __init__(self, grid: RailRaster) -> None:
        self._grid = grid
        self._cells: list[np.ndarray] = []

    def paint(self, piece: Piece, block: np.ndarray, inside: Piece) -> None:
        """Set the cells of a piece that are inside a rectangle.

        Parameters
        ----------
        piece : Piece
        block : (height, width) bool array
            Cells of the piece.
        inside : Piece
        """
        cells = np.argwhere(block) + np.array([piece.row, piece.column])
        self._cells.append(cells[inside.holds(cells)])

    def raster(self) -> RailRaster:
        """Return the raster."""
        cells = np.concatenate(self._cells) if self._cells else np.empty((0, 2), dtype=np.int64)
        return self._grid.with_cells(cells)
