"""Cells for rails that are too thin for FRPDF: drawn along the lines on which the cells of a rail were found.

They show the network where the rail runs and carry no measurement: as points they would cost accuracy.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .lines import Lines

ENOUGH_PER_M = 18.0
"""Cells per metre of rail from which nothing is drawn: FRPDF finds all of a rail from here on, and 91 to 99 % of one
with 7 to 10 cells per metre."""

WITHIN_M = 1.0
"""Length to one side in which cells are counted."""


def drawn(lines: Lines, pairs: np.ndarray, heads: np.ndarray, half_m: float, cell_m: float) -> np.ndarray:
    """Places along thin rails, half a cell apart, (k, 2) local metres.

    Parameters
    ----------
    lines : Lines
        Cells of rails, one of each block of 2 x 2.
    pairs : (m, 2) int array
        Cells that continue each other.
    heads : (c, 2) array
        Middles of all cells of railheads.
    half_m : float
        Distance across within which these are on a line.
    cell_m : float
    """
    if not len(pairs):
        return np.empty((0, 2))
    thin = _per_m(lines, heads, half_m) < ENOUGH_PER_M
    pairs = _nearest_on_each_side(lines, pairs[thin[pairs].all(axis=1)])
    start, end = lines.axis[pairs[:, 0]], lines.axis[pairs[:, 1]]
    count = np.ceil(np.linalg.norm(end - start, axis=1) / (cell_m / 2)).astype(np.int64) + 1
    pair = np.repeat(np.arange(len(count)), count)
    share = (np.arange(count.sum()) - (np.cumsum(count) - count)[pair]) / (count[pair] - 1)
    return start[pair] + share[:, None] * (end - start)[pair]


def _nearest_on_each_side(lines: Lines, pairs: np.ndarray) -> np.ndarray:
    """Keep the shortest pair of each cell ahead of it and behind it, (k, 2)."""
    both = np.concatenate([pairs, pairs[:, ::-1]])
    step = lines.axis[both[:, 1]] - lines.axis[both[:, 0]]
    ahead = np.einsum("ij,ij->i", step, lines.along[both[:, 0]])
    order = np.lexsort((both[:, 1], np.abs(ahead)))
    side = 2 * both[order, 0] + (ahead[order] > 0)
    return both[order[np.unique(side, return_index=True)[1]]]


def _per_m(lines: Lines, heads: np.ndarray, half_m: float) -> np.ndarray:
    """Cells of railheads per metre around each line's cell, (n,); at the end of a rail, on the side where it is."""
    near = cKDTree(lines.axis).sparse_distance_matrix(cKDTree(heads), WITHIN_M, output_type="ndarray")
    own = near["i"]
    step = heads[near["j"]] - lines.axis[own]
    on = np.abs(np.einsum("ij,ij->i", step, lines.across[own])) < half_m
    own, ahead = own[on], np.einsum("ij,ij->i", step, lines.along[own])[on] > 0
    counts = [np.bincount(own[ahead == side], minlength=len(lines.axis)) for side in (True, False)]
    return np.maximum(*counts) / WITHIN_M
