"""Cells for rails that are too thin for FRPDF: drawn along the lines on which the cells of a rail were found.

They show the network where the rail runs and carry no measurement: as points they would cost accuracy.
"""

from __future__ import annotations

import numpy as np

from .lines import Lines

ENOUGH_PER_M = 10.0
"""Cells per metre of rail from which nothing is drawn, of those that are thinned to one of each block of 2 x 2. FRPDF
finds all of a rail from 18 cells per metre, and 91 to 99 % at 7 to 10; a dense rail has 12 blocks per metre."""

WITHIN_M = 1.0
"""Length to one side in which cells are counted."""


def drawn(lines: Lines, pairs: np.ndarray, cell_m: float) -> np.ndarray:
    """Places along thin rails, half a cell apart, (k, 2) local metres.

    Parameters
    ----------
    lines : Lines
        Cells of rails, one of each block of 2 x 2.
    pairs : (m, 2) int array
        Cells that continue each other.
    cell_m : float
    """
    if not len(pairs):
        return np.empty((0, 2))
    step = lines.axis[pairs[:, 1]] - lines.axis[pairs[:, 0]]
    length_m = np.linalg.norm(step, axis=1)
    thin = (_per_m(lines, pairs, step)[pairs] < ENOUGH_PER_M).all(axis=1)
    start, step, length_m = lines.axis[pairs[thin, 0]], step[thin], length_m[thin]
    count = np.ceil(length_m / (cell_m / 2)).astype(np.int64) + 1
    pair = np.repeat(np.arange(len(count)), count)
    share = (np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)) / (count[pair] - 1)
    return start[pair] + share[:, None] * step[pair]


def _per_m(lines: Lines, pairs: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Cells per metre around each cell, (n,); at the end of a rail, those on the side where it is."""
    counts = []
    for ahead in (True, False):
        count = np.zeros(len(lines.axis))
        for own, direction in ((pairs[:, 0], 1), (pairs[:, 1], -1)):
            distance = direction * np.einsum("ij,ij->i", step, lines.along[own])
            near = (np.abs(distance) < WITHIN_M) & ((distance > 0) == ahead)
            count += np.bincount(own[near], minlength=len(count))
        counts.append(count)
    return np.maximum(*counts) / WITHIN_M
