"""A pass of the network layer by layer over the pieces of a corridor.

Every layer is computed on all pieces before the next, and sees around each piece what the others hold. So nothing is
computed twice and nothing along the track is cut off, however far a dilated kernel reaches. Off the corridor stands
what the layer makes of an empty raster.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Callable

import numpy as np

from ..progress import Progress
from . import START, STATISTICS
from .corridor import Piece

Array = Any
"""(channels, height, width) array of whatever library computes."""


@dataclass(frozen=True)
class Step:
    """A layer of the network.

    Attributes
    ----------
    reach : int
        How far, in cells, it looks around a cell.
    run : callable
        Maps what it sees, `reach` cells larger on each side than its result, and what stands in the middle of that.
    """

    reach: int
    run: Callable[[Array, Array], Array]


class LayeredEngine(ABC):
    """What engines share; they say how a step runs and where arrays live.

    Attributes
    ----------
    most_cells : int
        How many cells are computed at once.
    """

    most_cells = 1 << 22

    def sweep(
        self,
        seen: Sequence[np.ndarray],
        known: Sequence[np.ndarray],
        number: int,
        pieces: Sequence[Piece],
        progress: Progress,
    ) -> list[np.ndarray]:
        """Run one pass over pieces; see `Engine.sweep`."""
        held = [self._load(np.stack([raster, state]) * 2 - 1) for raster, state in zip(seen, known)]
        empty = np.array([0.0, 0.0 if number else START], dtype=np.float32)[:, None, None]
        outside = self._load(empty * 2 - 1)
        steps = self._steps(min(number, STATISTICS - 1))
        for step, stage in zip(steps, progress.split(len(steps))):
            held, outside = self._advance(step, held, outside, pieces, stage)
        return [self._probabilities(logits) for logits in held]

    def _advance(
        self, step: Step, held: Sequence[Array], outside: Array, pieces: Sequence[Piece], progress: Progress
    ) -> tuple[list[Array], Array]:
        """Run a layer on all pieces, and on an empty raster."""
        results = []
        for piece, own in progress.follow(list(zip(pieces, held))):
            around = self._surroundings(outside, piece.height + 2 * step.reach, piece.width + 2 * step.reach)
            for other, target, source in overlaps(piece, pieces, step.reach):
                around[(slice(None), *target)] = held[other][(slice(None), *source)]
            results.append(step.run(around, own))
        side = 2 * step.reach + 1
        return results, step.run(self._surroundings(outside, side, side), outside)

    @abstractmethod
    def _steps(self, number: int) -> Sequence[Step]:
        """Give the layers for a set of batch statistics."""

    @abstractmethod
    def _load(self, array: np.ndarray) -> Array:
        """Take in a float32 array."""

    @abstractmethod
    def _surroundings(self, outside: Array, height: int, width: int) -> Array:
        """Make an array full of `outside`, (channels, 1, 1), to write into; the next call may reuse it."""

    @abstractmethod
    def _probabilities(self, logits: Array) -> np.ndarray:
        """Hand out (1, height, width) logits as (height, width) float32 probabilities."""


def overlaps(
    piece: Piece, pieces: Sequence[Piece], reach: int
) -> Iterator[tuple[int, tuple[slice, slice], tuple[slice, slice]]]:
    """Find what lies within `reach` cells of a piece: number of the other piece, where it goes, and what part of it."""
    corners = np.array([other.window[:2] for other in pieces])
    ends = corners + [other.window[2:] for other in pieces]
    corner = np.array(piece.window[:2]) - reach
    end = corner + piece.window[2:] + 2 * reach
    first, last = np.maximum(corners, corner), np.minimum(ends, end)
    for other in np.flatnonzero((first < last).all(axis=1)):
        target = _slices(first[other] - corner, last[other] - corner)
        yield int(other), target, _slices(first[other] - corners[other], last[other] - corners[other])


def _slices(first: np.ndarray, last: np.ndarray) -> tuple[slice, slice]:
    (top, left), (bottom, right) = first.tolist(), last.tolist()
    return slice(top, bottom), slice(left, right)
