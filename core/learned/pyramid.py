"""Neighbours of the points of blocks, on each layer of the network.

The points of a block are in random order, so each layer keeps the first quarter of those of the layer before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

NEIGHBOURS = 16
"""Nearest points that each point looks at, itself included; Hu et al. use as many."""

RATIO = 4
"""Points of a layer for each one of the next layer."""

LAYERS = 4
"""Levels of the pyramid, each coarser than the one below it."""


@dataclass(frozen=True)
class Layer:
    """The points of a layer, those of all blocks behind each other.

    Attributes
    ----------
    position : (n, 3) float32 array
        Metres from the middle of the block.
    near : (n, NEIGHBOURS) int64 array
        Numbers of the nearest points of the same block. A block with fewer repeats them.
    kept : (m,) int64 array
        Numbers of the points that the next layer has.
    nearest : (n,) int64 array
        For each point, the nearest one of the next layer: its number there.
    """

    position: np.ndarray
    near: np.ndarray
    kept: np.ndarray
    nearest: np.ndarray


def build(blocks: Sequence[np.ndarray]) -> list[Layer]:
    """Find the neighbours of the points of blocks, (n, 3) each, on all layers."""
    layers = []
    for _ in range(LAYERS):
        parts = [_layer(position) for position in blocks]
        starts = np.cumsum([0, *(len(part.position) for part in parts)])
        next_starts = np.cumsum([0, *(len(part.kept) for part in parts)])
        layers.append(
            Layer(
                np.concatenate([part.position for part in parts]),
                np.concatenate([part.near + start for part, start in zip(parts, starts)]),
                np.concatenate([part.kept + start for part, start in zip(parts, starts)]),
                np.concatenate([part.nearest + start for part, start in zip(parts, next_starts)]),
            )
        )
        blocks = [part.position[part.kept] for part in parts]
    return layers


def _layer(position: np.ndarray) -> Layer:
    """Find the neighbours within one block."""
    count = len(position)
    near = cKDTree(position).query(position, k=np.arange(1, min(NEIGHBOURS, count) + 1))[1]
    near = np.resize(near.T, (NEIGHBOURS, count)).T if count < NEIGHBOURS else near
    kept = np.arange(-(-count // RATIO))
    nearest = cKDTree(position[kept]).query(position)[1]
    return Layer(position, near.astype(np.int64), kept, nearest.astype(np.int64))
