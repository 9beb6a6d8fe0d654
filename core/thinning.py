"""Thinning of finished lines: the last step of making them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from .rails import Centerline, RailLine
from .smoothing import simplify

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
    pieces = [
        simplify(xyz[first : last + 1], tolerance_xy_m, tolerance_z_m)[:-1] for first, last in zip(knots, knots[1:])
    ]
    return np.concatenate([*pieces, xyz[-1:]])
