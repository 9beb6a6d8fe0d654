"""FRPDF over a whole raster: pass after pass, each along the rails only."""

from __future__ import annotations

import numpy as np

from ..errors import DeviceExhaustedError
from ..progress import SILENT, Progress
from ..raster import TILE, RailRaster
from . import DEFAULT_PASSES, FEEDBACK_THRESHOLD, MAX_PASSES, OUTPUT_THRESHOLD, START
from .corridor import Piece, lay_fields
from .engine import Engine

MARGIN = 64
"""Cells around a raster that was cut out of a larger one that only give context, for each pass."""

UNTIL_STABLE = 0
STABLE_SHARE = 0.001
"""Passes end once fewer than this share of the rail cells change."""


def max_passes(passes: int) -> int:
    """Give the number of passes after which a run ends in any case."""
    return MAX_PASSES if passes == UNTIL_STABLE else passes


def is_stable(changed: int, cells: int) -> bool:
    """Tell whether a pass that changed so many cells, and found so many, changed next to nothing."""
    return changed < STABLE_SHARE * max(cells, 1)


def clean(raster: RailRaster, engine: Engine, passes: int = DEFAULT_PASSES, progress: Progress = SILENT) -> RailRaster:
    """Remove noise and bridge gaps with the network (Gribov and Chang, sections 5 and 7).

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
    most = max_passes(passes)
    state, output = None, raster
    for number in range(most):
        step = progress.span(number / most, (number + 1) / most)
        before = output
        state, output = _run_pass(raster, state, engine, number, step)
        if passes == UNTIL_STABLE and number > 0 and is_stable(_changed(before, output), output.count()):
            break
    return output


def _run_pass(
    raster: RailRaster, state: RailRaster | None, engine: Engine, number: int, progress: Progress
) -> tuple[RailRaster, RailRaster]:
    """Compute one pass; give what the next pass is told, and what the user would get."""
    while True:
        told, output = _Canvas(raster), _Canvas(raster)
        fields = lay_fields(raster, engine.max_cells)
        try:
            for field, step in zip(fields, progress.split(len(fields))):
                seen = [raster.read(*piece.window).astype(np.float32) for piece in field.pieces]
                known = [_state(state, piece) for piece in field.pieces]
                found = engine.sweep(seen, known, number, field.pieces, step)
                for piece, probability in zip(field.pieces, found):
                    told.paint(piece, probability >= FEEDBACK_THRESHOLD, field.inside)
                    output.paint(piece, probability >= OUTPUT_THRESHOLD, field.inside)
            return told.raster(), output.raster()
        except DeviceExhaustedError:
            pass  # and let go of the error first: what it passed through still holds the device's memory
        progress.warning(engine.retreat())


def _state(state: RailRaster | None, piece: Piece) -> np.ndarray:
    """Give what the network is told of a piece."""
    if state is None:
        return np.full((piece.height, piece.width), START, dtype=np.float32)
    return state.read(*piece.window).astype(np.float32)


def _changed(before: RailRaster, after: RailRaster) -> int:
    """Count the cells that differ."""
    windows = [(*(TILE * np.array(index)), TILE, TILE) for index in set(before.tiles) | set(after.tiles)]
    return sum(np.count_nonzero(before.read(*window) != after.read(*window)) for window in windows)


class _Canvas:
    """A raster under construction, on another one's grid."""

    def __init__(self, grid: RailRaster) -> None:
        self._grid = grid
        self._cells: list[np.ndarray] = []

    def paint(self, piece: Piece, block: np.ndarray, inside: Piece) -> None:
        """Set the cells of a piece that count."""
        cells = np.argwhere(block) + np.array([piece.row, piece.column])
        self._cells.append(cells[inside.holds(cells)])

    def raster(self) -> RailRaster:
        """Finish."""
        cells = np.concatenate(self._cells) if self._cells else np.empty((0, 2), dtype=np.int64)
        return self._grid.with_cells(cells)
