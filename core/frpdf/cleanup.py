"""Cleaning of a raster with FRPDF in several passes, each along the rails only."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec

import numpy as np

from ..errors import DeviceExhaustedError, ModelError
from ..progress import SILENT, Progress
from ..raster import TILE, RailRaster
from . import AUTO, DEFAULT_PASSES, FEEDBACK_THRESHOLD, MAX_PASSES, OUTPUT_THRESHOLD, START
from .corridor import Batch, Rectangle, lay_batches
from .engine import Engine

MARGIN = 64
"""Width in cells, per pass, of the frame of context around a raster that was cut out of a larger one."""

NO_CELLS = np.empty((0, 2), dtype=np.int64)

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
    """Remove noise and close gaps with the network, on the same grid (Gribov and Chang, sections 5 and 7).

    With 0, passes run until the result is stable, at most `MAX_PASSES`.
    """
    most = max_passes(passes)
    state, output = None, raster
    batches = lay_batches(raster, engine.max_cells)
    for number in range(most):
        step = progress.span(number / most, (number + 1) / most)
        before = output
        while (found := _run_pass(raster, state, engine, number, batches, step)) is None:
            progress.warning(engine.retreat())
            batches = lay_batches(raster, engine.max_cells)
        state, output = found
        if passes == UNTIL_STABLE and number > 0 and is_stable(_changed(before, output), output.count()):
            break
    return output


def _run_pass(
    raster: RailRaster,
    state: RailRaster | None,
    engine: Engine,
    number: int,
    batches: Sequence[Batch],
    progress: Progress,
) -> tuple[RailRaster, RailRaster] | None:
    """Run a pass, numbered from 0, on batches, given the result of the pass before.

    Returns the state of the next pass, and the result if this pass is the last one; None, with the memory released, if
    the device has not enough of it for a batch.
    """
    cells: dict[float, list[np.ndarray]] = {FEEDBACK_THRESHOLD: [NO_CELLS], OUTPUT_THRESHOLD: [NO_CELLS]}
    try:
        for batch, step in zip(batches, progress.split(len(batches))):
            seen = [raster.read(*piece.window).astype(np.float32) for piece in batch.pieces]
            known = [_state(state, piece) for piece in batch.pieces]
            found = engine.sweep(seen, known, number, batch.pieces, step)
            for piece, probability in zip(batch.pieces, found):
                for threshold, kept in cells.items():
                    some = np.argwhere(probability >= threshold) + [piece.row, piece.column]
                    kept.append(some[batch.inside.holds(some)])
    except DeviceExhaustedError:
        return None
    following, output = (raster.with_cells(np.concatenate(kept)) for kept in cells.values())
    return following, output


def _state(state: RailRaster | None, piece: Rectangle) -> np.ndarray:
    """Return the state of a piece."""
    if state is None:
        return np.full((piece.height, piece.width), START, dtype=np.float32)
    return state.read(*piece.window).astype(np.float32)


def _changed(before: RailRaster, after: RailRaster) -> int:
    """Count the cells that differ."""
    windows = [(*(TILE * np.array(index)), TILE, TILE) for index in set(before.tiles) | set(after.tiles)]
    return sum(int(np.count_nonzero(before.read(*window) != after.read(*window))) for window in windows)


_PACKAGES = {"TORCH": ("torch", "torch"), "OPENCV": ("cv2", "opencv-python-headless")}
"""Module and package of each engine."""


def make_engine(arrays: dict[str, np.ndarray], engine: str = AUTO, device: str = AUTO) -> Engine:
    """Set up the engine that the user chose; with AUTO, PyTorch where it is installed and OpenCV elsewhere.

    `engine` is AUTO, TORCH or OPENCV, `device` AUTO, CPU or CUDA. Raises ModelError if the engine's package or device
    is not available, or the weights are not those of FRPDF.
    """
    if choose_engine(engine, device) == "TORCH":
        try:
            from .torch_engine import TorchEngine
        except (ImportError, OSError) as error:  # Windows: a missing library, or one of another plugin with its name
            if engine != AUTO or device == "CUDA" or not find_spec("cv2"):
                raise ModelError(
                    f"PyTorch is installed but does not start ({error}): set ENGINE to OPENCV, or reinstall PyTorch."
                ) from error
        else:
            return TorchEngine(arrays, device)
    from .opencv_engine import OpenCvEngine

    return OpenCvEngine(arrays)


def choose_engine(engine: str, device: str) -> str:
    """Return the name of the engine to use, without importing it.

    Raises ModelError if its package is not installed, or it cannot use the device.
    """
    if engine == AUTO:
        engine = "TORCH" if find_spec("torch") else "OPENCV"
    module, package = _PACKAGES[engine]
    if not find_spec(module):
        raise ModelError(f"ENGINE {engine} needs the package {package}: install it, or set ENGINE to AUTO.")
    if engine == "OPENCV" and device == "CUDA":
        raise ModelError("ENGINE OPENCV runs on the CPU only: set DEVICE to AUTO, or ENGINE to TORCH.")
    return engine
