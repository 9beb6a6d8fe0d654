"""Thinning of finished lines: the last step of making them.

Chords between vertices of a curve all lie inside of it, by 1 mm on average at a tolerance of 2 mm. The vertices that
stay are therefore moved to where the thinned line fits the whole one best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from scipy.linalg import solveh_banded

from ..rails import Centerline, RailLine, length_along
from .smoothing import essential_vertices

Line = TypeVar("Line", RailLine, Centerline)


def thin(lines: Sequence[Line], tolerance_xy_m: float, tolerance_z_m: float) -> tuple[Line, ...]:
    """Leave out needless vertices of lines, but none in which another line ends, so that lines stay connected.

    Parameters
    ----------
    lines : sequence of RailLine or Centerline
    tolerance_xy_m, tolerance_z_m : float
        How far a vertex left out may lie beside the result in plan, and above or below it.

    Returns
    -------
    tuple of RailLine or Centerline
    """
    ends = {tuple(end) for line in lines for end in line.xyz[[0, -1], :2].tolist()}
    return tuple(replace(line, xyz=_thinned(line.xyz, ends, tolerance_xy_m, tolerance_z_m)) for line in lines)


def _thinned(xyz: np.ndarray, ends: set[tuple[float, ...]], tolerance_xy_m: float, tolerance_z_m: float) -> np.ndarray:
    """Thin the stretches between the vertices that other lines end in, (k, 3)."""
    inner = [number for number, vertex in enumerate(xyz[:-1, :2].tolist()) if number and tuple(vertex) in ends]
    knots = [0, *inner, len(xyz) - 1]
    pieces = [xyz[first : last + 1] for first, last in zip(knots, knots[1:])]
    return np.concatenate([*(_fitted(piece, tolerance_xy_m, tolerance_z_m)[:-1] for piece in pieces), xyz[-1:]])


def _fitted(xyz: np.ndarray, tolerance_xy_m: float, tolerance_z_m: float) -> np.ndarray:
    """Thin one stretch, and move its vertices but the ends to where the line through them fits all others best, (k, 3).

    Where the line would leave the tolerance, its vertices stay.
    """
    kept = np.flatnonzero(essential_vertices(xyz, tolerance_xy_m, tolerance_z_m))
    if len(kept) < 3 or len(kept) == len(xyz):
        return xyz[kept]
    span = np.clip(np.searchsorted(kept, np.arange(len(xyz)), side="right") - 1, 0, len(kept) - 2)
    along = length_along(xyz[:, :2])
    share = (along - along[kept][span]) / (along[kept][span + 1] - along[kept][span])
    missing = xyz - _between(xyz[kept], span, share)
    moves = _least_squares(missing, span, share, np.gradient(along))
    while True:
        left = missing - _between(moves, span, share)
        off = (np.hypot(left[:, 0], left[:, 1]) > tolerance_xy_m) | (np.abs(left[:, 2]) > tolerance_z_m)
        stay = np.unique([span[off], span[off] + 1])
        if not moves[stay].any():
            return xyz[kept] + moves
        moves[stay] = 0.0


def _between(vertices: np.ndarray, span: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Interpolate between vertices `span` and `span` + 1, (n, 3)."""
    return vertices[span] + share[:, None] * (vertices[span + 1] - vertices[span])


def _least_squares(values: np.ndarray, span: np.ndarray, share: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Fit a polyline to (n, 3) values, 0 at both its ends; returns its vertices."""
    count = int(span[-1]) + 2
    before, after = weight * (1 - share), weight * share
    diagonal = np.bincount(span, before * (1 - share), count) + np.bincount(span + 1, after * share, count)
    beside = np.bincount(span, before * share, count)
    right = [
        np.bincount(span, before * column, count) + np.bincount(span + 1, after * column, count)
        for column in np.nan_to_num(values).T
    ]
    sums, beside = np.stack(right, axis=1), np.concatenate([[0.0], beside[:-1]])
    diagonal[[0, -1]], beside[[1, -1]], sums[[0, -1]] = 1.0, 0.0, 0.0
    return solveh_banded(np.stack([beside, diagonal]), sums)
