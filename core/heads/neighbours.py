"""Where the head of a neighbouring rail covers an edge: at switches, frogs and crossings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import interpolate, left_normals, length_along
from .edges import STATION_STEP_M, station_count

BESIDE_HEADS = 1.5
"""Distance of two axes, in head widths, from which the ground between the heads is wide enough to show their edges."""

CROSSED_M = 0.01
"""Offset on both sides of a line from which another line crosses it; less may be the error of the lines."""

MIN_RUN = 0.5
"""Cosine of the crossing angle below which each line hides the other for less than one window."""


def free_edges(lines: Sequence[np.ndarray], head_width_m: float) -> list[np.ndarray]:
    """Find the stations of each line where the right and the left edge of its head are free of other heads.

    Where a branch leaves its stock rail the heads overlap, and only the outer edge of each is free.

    Parameters
    ----------
    lines : sequence of (n, 2) arrays
    head_width_m : float

    Returns
    -------
    list of (2, s) bool arrays
        For each line, the right and the left edges at the stations of `edges.stations_along`.
    """
    free = [np.ones((2, station_count(length_along(line)[-1])), dtype=bool) for line in lines]
    for line, station, across in _close_runs(lines, BESIDE_HEADS * head_width_m):
        crossing = across.min() < -CROSSED_M and across.max() > CROSSED_M
        side = across if crossing else np.full(len(across), across.sum())
        overlap = crossing & (np.abs(across) < 0.5 * head_width_m)
        free[line][0, station[(side < 0) | overlap]] = False
        free[line][1, station[(side >= 0) | overlap]] = False
    return free


def _close_runs(lines: Sequence[np.ndarray], reach_m: float) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """List where another line is close: line, its stations, and the offsets of the other line to the left, (k,)."""
    number, station, places, normals = _stations(lines)
    if not len(number):
        return []
    pairs = cKDTree(places).query_pairs(np.hypot(reach_m, 0.5 * STATION_STEP_M), output_type="ndarray")
    pairs = pairs[number[pairs[:, 0]] != number[pairs[:, 1]]]
    own, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    across = _offset(places[other] - places[own], normals[own], normals[other])
    close = np.abs(across) <= reach_m
    own, other, across = own[close], number[other[close]], across[close]
    order = np.lexsort((own, other, number[own]))
    own, other, across = own[order], other[order], across[order]
    breaks = np.flatnonzero((np.diff(other) != 0) | (np.diff(own) > 1) | (np.diff(number[own]) != 0)) + 1
    runs = np.split(np.arange(len(own)), breaks) if len(own) else []
    return [(int(number[own[run[0]]]), station[own[run]], across[run]) for run in runs]


def _offset(step: np.ndarray, normal: np.ndarray, other_normal: np.ndarray) -> np.ndarray:
    """Return the offsets to the left of straight lines, (k,), given the `step` to a place on each and the normals."""
    tangent, other_tangent = (values @ np.array([[0.0, -1.0], [1.0, 0.0]]) for values in (normal, other_normal))
    ahead, across = (np.einsum("ij,ij->i", step, axis) for axis in (tangent, normal))
    run, rise = (np.einsum("ij,ij->i", other_tangent, axis) for axis in (tangent, normal))
    return across - ahead * rise / np.where(np.abs(run) > MIN_RUN, run, np.inf)


def _stations(lines: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return line and station numbers, (k,), places and unit vectors to the left, (k, 2), of all stations."""
    columns = []
    for number, line in enumerate(lines):
        along = length_along(line)
        station = np.arange(station_count(along[-1]))
        at = np.minimum((station + 0.5) * STATION_STEP_M, along[-1])
        places, normals = interpolate(line, along, at), interpolate(left_normals(line), along, at)
        columns.append((np.full(len(station), number), station, places, normals))
    if not columns:
        return np.empty(0, int), np.empty(0, int), np.empty((0, 2)), np.empty((0, 2))
    numbers, stations, places, normals = (np.concatenate(column) for column in zip(*columns))
    return numbers, stations, places, normals
