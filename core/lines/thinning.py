"""Thin finished lines, the last step in making them (docs/method.md section 5.7).

All chords between vertices of a curve are inside it, on average by half the tolerance. The remaining vertices
are therefore moved so that the thinned line fits the whole one best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from scipy.linalg import solveh_banded

from ..polyline import length_along
from ..rails import Centerline, RailLine

Line = TypeVar("Line", RailLine, Centerline)

EXACT_M = 1e-9
"""Smallest effective tolerance: a vertex closer to the chord is dropped even at a tolerance of zero."""


def thin(lines: Sequence[Line], tolerance_xy_m: float, tolerance_z_m: float) -> tuple[Line, ...]:
    """Drop needless vertices of lines, but none in which another line ends, so that lines stay connected.

    Parameters
    ----------
    lines : sequence of RailLine or Centerline
    tolerance_xy_m, tolerance_z_m : float
        Largest distance of a dropped vertex from the result, in plan and in height.
    """
    ends = np.unique([_as_complex(line.xyz[[0, -1]]) for line in lines])
    return tuple(replace(line, xyz=_thinned(line.xyz, ends, tolerance_xy_m, tolerance_z_m)) for line in lines)


def _as_complex(xyz: np.ndarray) -> np.ndarray:
    """Return places in plan, (n,), as single numbers, which can be looked up."""
    return xyz[:, 0] + 1j * xyz[:, 1]


def _thinned(xyz: np.ndarray, ends: np.ndarray, tolerance_xy_m: float, tolerance_z_m: float) -> np.ndarray:
    """Thin the pieces between the vertices in which other lines end, (k, 3)."""
    inner = np.flatnonzero(np.isin(_as_complex(xyz[1:-1]), ends)) + 1
    knots = [0, *inner.tolist(), len(xyz) - 1]
    pieces = [xyz[first : last + 1] for first, last in zip(knots, knots[1:])]
    return np.concatenate([*(_fitted(piece, tolerance_xy_m, tolerance_z_m)[:-1] for piece in pieces), xyz[-1:]])


def essential_vertices(xyz: np.ndarray, tolerance_xy_m: float, tolerance_z_m: float) -> np.ndarray:
    """Mark the vertices needed to keep a line within the tolerances (Douglas and Peucker, 1973).

    Plan and height are judged together, so that the line keeps both tolerances.

    Parameters
    ----------
    xyz : (n, 3) array
        Heights may be NaN; then only the plan counts.
    tolerance_xy_m, tolerance_z_m : float
        Largest distance of a vertex from the line, in plan and in height.

    Returns
    -------
    (n,) bool array
        The first and the last are always marked.
    """
    keep = np.zeros(len(xyz), dtype=bool)
    keep[[0, -1]] = True
    spans = [(0, len(xyz) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        beside, above = _deviation(xyz[first : last + 1])
        excess = np.fmax(beside / max(tolerance_xy_m, EXACT_M), above / max(tolerance_z_m, EXACT_M))
        worst = int(excess.argmax())
        if excess[worst] > 1:
            keep[first + 1 + worst] = True
            spans += [(first, first + 1 + worst), (first + 1 + worst, last)]
    return keep


def _deviation(xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measure how far inner vertices are from the segment between the outer ones, in plan and height, (n - 2,) each."""
    chord, inner = xyz[-1] - xyz[0], xyz[1:-1] - xyz[0]
    length_squared = chord[0] ** 2 + chord[1] ** 2
    share = np.clip(inner[:, :2] @ chord[:2] / length_squared, 0, 1) if length_squared > 0 else np.zeros(len(inner))
    off = inner - share[:, None] * chord
    return np.hypot(off[:, 0], off[:, 1]), np.abs(off[:, 2])


def _fitted(xyz: np.ndarray, tolerance_xy_m: float, tolerance_z_m: float) -> np.ndarray:
    """Thin one piece and move its inner vertices so that the line through them fits all vertices best, (k, 3).

    Vertices whose move would take the line out of the tolerance stay.
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
    """Fit a polyline that is 0 at both ends to (n, 3) values; returns its vertices."""
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
