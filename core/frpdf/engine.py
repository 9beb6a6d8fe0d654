"""Engines: they run the passes of FRPDF on PyTorch or OpenCV, layer by layer over pieces (docs/network.md).

Each layer is computed on all pieces before the next layer starts, and reads the surroundings of a piece from its
neighbours. So nothing is computed twice, and nothing along the track is cut off, however far a dilated kernel reaches.
Off the corridor the value is what the layer makes of an empty raster. Threads share the pieces of a layer.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from threading import local
from typing import Any, Callable

import numpy as np

from ..errors import DeviceExhaustedError
from ..kernels import Library, one_thread, threads
from ..progress import Progress
from . import START, STATISTICS
from .architecture import from_blocks, into_blocks
from .corridor import MAX_PIECE_CELLS, Rectangle

Array = Any
"""(channels, height, width) array of the library that computes."""


@dataclass(frozen=True)
class Step:
    """A layer, ready to run, which takes information from `reach` cells, or blocks of cells, away.

    `run` takes the input with its surroundings, `reach` cells larger on each side, and the input alone; it returns an
    array of the input's height and width.
    """

    reach: int
    run: Callable[[Array, Array], Array]


class Engine(ABC):
    """Runs the folded network; subclasses add the library that computes.

    `max_cells` are computed at once, at least those of a piece. `block` is the side of the blocks of cells on which the
    layers work, which divides the sides and corners of all pieces. `library` computes on one thread; `description` has
    library, device and number type, as shown in ENGINE_USED.
    """

    max_cells = 1 << 22
    block: int
    library: Library
    description: str

    def __init__(self) -> None:
        self._scratch = local()

    def sweep(
        self,
        seen: Sequence[np.ndarray],
        known: Sequence[np.ndarray],
        number: int,
        pieces: Sequence[Rectangle],
        progress: Progress,
    ) -> list[np.ndarray]:
        """Run the pass of a number, from 0, over pieces, which do not overlap, of a raster that is empty elsewhere.

        `seen` (0 or 1) and `known` (as in `network.Recurrent.logits`) are raster and state of each piece, (height,
        width) float32. Returns the probability of rail of each piece likewise. After DeviceExhaustedError, the same
        call can be repeated after `retreat`.
        """
        try:
            with one_thread(self.library):
                return self._sweep(seen, known, number, pieces, progress)
        except Exception as error:
            if self._means_no_memory(error):
                raise DeviceExhaustedError from error
            raise

    def _sweep(self, seen, known, number, pieces, progress) -> list[np.ndarray]:
        """Run one pass; see `sweep`."""
        steps, side = self._steps(min(number, STATISTICS - 1)), self.block
        held = [self._load(into_blocks(np.stack([raster, state]) * 2 - 1, side)) for raster, state in zip(seen, known)]
        empty = np.array([0.0, 0.0 if number else START], dtype=np.float32)[:, None, None]
        outside = self._load(np.repeat(empty * 2 - 1, side**2, axis=0))
        windows = np.array([piece.window for piece in pieces]) // side
        near = {reach: overlaps(windows, reach) for reach in {step.reach for step in steps} - {0}}
        with self._threads() as on_each:
            for step, share in zip(steps, progress.split(len(steps))):
                run = partial(self._run, step, held, outside, near.get(step.reach))
                held = list(share.follow(on_each(run, range(len(held))), len(held)))
                width = 2 * step.reach + 1
                outside = step.run(self._filled(outside, width, width), outside)
        return [from_blocks(self._probabilities(logits), side) for logits in held]

    def _run(
        self, step: Step, held: Sequence[Array], outside: Array, near: Sequence[Sequence[Overlap]] | None, number: int
    ) -> Array:
        """Run a layer on the piece of a number, given its input for each piece and `outside`, that on an empty raster.

        `near` is what surrounds each piece; None for a layer without reach.
        """
        own, reach = held[number], step.reach
        if near is None:
            return step.run(own, own)
        around = self._filled(outside, own.shape[1] + 2 * reach, own.shape[2] + 2 * reach)
        for other, (rows, columns), (other_rows, other_columns) in near[number]:
            around[:, rows, columns] = held[other][:, other_rows, other_columns]
        return step.run(around, own)

    def retreat(self) -> str:
        """Demand less memory, or change to the CPU, and return a message for the user; MemoryError if nothing is left.

        Call it after `sweep` raised `DeviceExhaustedError`.
        """
        self._scratch = local()
        if self.max_cells // 4 < MAX_PIECE_CELLS:
            raise MemoryError
        self.max_cells //= 4
        return f"{self._place} has too little free memory: continuing with smaller parts."

    @property
    def _place(self) -> str:
        """What computes, as the subject of a sentence."""
        return "The computer"

    def _means_no_memory(self, error: Exception) -> bool:
        """Return whether an error says that there is not enough memory; libraries have their own ways to say so."""
        return isinstance(error, MemoryError)

    @contextmanager
    def _threads(self) -> Iterator[Callable]:
        """Provide a function like `map`, on as many threads as compute at a time; in this one if that is one."""
        count = self._thread_count()
        if count == 1:
            yield map
            return
        # The number of threads of a library may belong to the thread that sets it.
        with ThreadPoolExecutor(count, initializer=self.library.set, initargs=(1,)) as pool:
            try:
                yield pool.map
            finally:
                pool.shutdown(cancel_futures=True)

    def _thread_count(self) -> int:
        """Return how many threads compute at a time."""
        return threads()

    def _memory(self, size: int) -> Any:
        """Return an array of `size` numbers, which the next call in the same thread reuses.

        New memory costs more than writing into it: the system clears every page first.
        """
        if size > len(getattr(self._scratch, "array", ())):
            self._scratch.array = self._empty(size)
        return self._scratch.array[:size]

    @abstractmethod
    def _empty(self, size: int) -> Any:
        """Return a new array of `size` numbers."""

    @abstractmethod
    def _steps(self, number: int) -> Sequence[Step]:
        """Return the layers in order, for a set of batch statistics."""

    @abstractmethod
    def _load(self, array: np.ndarray) -> Array:
        """Convert a float32 array."""

    @abstractmethod
    def _filled(self, outside: Array, height: int, width: int) -> Array:
        """Return an array of `_memory` that is full of `outside`, (channels, 1, 1)."""

    @abstractmethod
    def _probabilities(self, logits: Array) -> np.ndarray:
        """Convert logits to a float32 array of probabilities."""


Overlap = tuple[int, tuple[slice, slice], tuple[slice, slice]]
"""Number of a piece; rows and columns of some of its cells within another piece extended by a reach, and within it."""


def overlaps(windows: np.ndarray, reach: int) -> list[list[Overlap]]:
    """Find, for each piece, the cells of all pieces that are at most `reach` cells away from it, its own among them.

    `windows`, (n, 4), are row, column, height and width of each piece.
    """
    corners, ends = windows[:, :2], windows[:, :2] + windows[:, 2:]
    first = np.maximum(corners, corners[:, None] - reach)
    last = np.minimum(ends, ends[:, None] + reach)
    found: list[list[Overlap]] = [[] for _ in windows]
    pairs = np.argwhere((first < last).all(axis=2))
    places = np.stack([first, last])[:, pairs[:, 0], pairs[:, 1]]
    around, within = places - corners[pairs[:, 0]] + reach, places - corners[pairs[:, 1]]
    columns = (pairs, *around, *within)
    for (one, other), top, end, other_top, other_end in zip(*(column.tolist() for column in columns)):
        found[one].append((other, _slices(top, end), _slices(other_top, other_end)))
    return found


def _slices(first: Sequence[int], last: Sequence[int]) -> tuple[slice, slice]:
    return slice(first[0], last[0]), slice(first[1], last[1])
