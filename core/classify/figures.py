"""Length of rail that each cell stands for, so that lengths add up over squares."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .lines import Lines

GAP_M = 1.0
"""Longest gap between two cells of a rail that counts towards its length."""


def shares_of_length(lines: Lines, half_m: float) -> np.ndarray:
    """Length of rail that each cell stands for, (n,) metres: half the way to the next cell ahead and behind.

    Parameters
    ----------
    lines : Lines
    half_m : float
        Distance across within which two cells are on one line.
    """
    count = len(lines.axis)
    if count < 2:
        return np.zeros(count)
    pairs = cKDTree(lines.axis).query_pairs(np.hypot(GAP_M, half_m), output_type="ndarray")
    own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    step = lines.axis[other] - lines.axis[own]
    along = np.einsum("ij,ij->i", step, lines.along[own])
    beside = np.abs(np.einsum("ij,ij->i", step, lines.across[own])) < half_m
    share_m = np.zeros(count)
    for ahead in (True, False):
        mine = beside & ((along > 0) == ahead)
        gap_m = np.full(count, GAP_M)
        np.minimum.at(gap_m, own[mine], np.abs(along[mine]))
        share_m += np.where(gap_m < GAP_M, gap_m / 2, 0.0)
    return share_m
