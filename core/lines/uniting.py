"""Pieces of a rail become one: they fade into each other, and their figures are put together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..polyline import interpolate, length_along, project
from ..rails import RailLine, Support
from ..squares.grid import HALO_M
from ..squares.pieces import STATION_M

SAME_RAIL_M = 0.03
"""Lines this close together are one rail: two rails lie a head apart at least, and copies of one a few millimetres."""

HOLE_STATIONS = 3
HOLE_M = HOLE_STATIONS * STATION_M
"""Near a corner of squares, two stretches may show a rail up to so far apart before a third takes notice."""


def faded(part: RailLine, side: int, into: RailLine) -> RailLine:
    """Let one end of a line fade into the line it goes on in, over twice `HALO_M`.

    Where the other does not show it for so long, as near a corner of squares, it is taken to be as far off as there.
    """
    xyz = (part.xyz if side else part.xyz[::-1]).copy()
    along = length_along(xyz[:, :2])
    share = 1.0 - np.clip((along[-1] - along) / min(2 * HALO_M, along[-1]), 0.0, 1.0)
    last = np.flatnonzero(share > 0)
    ahead = into.xyz
    feet = project([ahead[:, :2]], xyz[last, :2], SAME_RAIL_M)
    if not len(feet.point):
        ahead = prolonged(into.xyz)
        feet = project([ahead[:, :2]], xyz[last, :2], SAME_RAIL_M)
    if len(feet.point):
        order = np.argsort(feet.point)
        shown = last[feet.point[order]]
        target = interpolate(ahead, length_along(ahead[:, :2]), feet.t[order])
        off = interpolate(target - xyz[shown], along[shown], along[last])
        xyz[last] += (3 * share[last] ** 2 - 2 * share[last] ** 3)[:, None] * off
    return replace(part, xyz=xyz if side else xyz[::-1])


def prolonged(line: np.ndarray) -> np.ndarray:
    """Let a line, (n, 2) or (n, 3), run on for `HOLE_M` at both ends, bent as it is there."""
    along = length_along(line[:, :2])
    out = np.arange(1, HOLE_STATIONS + 1) * STATION_M
    ends = [
        3 * line[end] - 3 * interpolate(line, along, abs(side - out)) + interpolate(line, along, abs(side - 2 * out))
        for end, side in ((0, 0.0), (-1, along[-1]))
    ]
    return np.concatenate([ends[0][::-1], line, ends[1]])


def closed_ring(line: RailLine) -> RailLine:
    """Let the ends of a ring meet exactly; what they differ by fades over twice `HALO_M` on either side."""
    along = length_along(line.xyz[:, :2])
    off = line.xyz[-1] - line.xyz[0]
    if along[-1] <= 4 * HALO_M or np.hypot(*off[:2]) > SAME_RAIL_M:
        return line
    share = 1.0 - np.clip(np.minimum(along, along[-1] - along) / (2 * HALO_M), 0.0, 1.0)
    half = np.copysign(0.5, 0.5 * along[-1] - along) * (3 * share**2 - 2 * share**3)
    xyz = line.xyz + half[:, None] * off
    xyz[-1] = xyz[0]
    return replace(line, xyz=xyz)


def united(parts: Sequence[RailLine]) -> RailLine:
    """Make one line of pieces that begin where the one before ends."""
    if len(parts) == 1:
        only = parts[0]
        return only if only.points == int(only.points) else _with_figures(parts, only.xyz)
    xyz = np.concatenate([parts[0].xyz[:1], *(part.xyz[1:] for part in parts)])
    return _with_figures(parts, xyz)


def _with_figures(parts: Sequence[RailLine], xyz: np.ndarray) -> RailLine:
    """Give a line made of pieces their figures, as if it had been measured as one."""
    lengths = [length_along(part.xyz[:, :2])[-1] for part in parts]
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    points = np.array([part.points for part in parts], dtype=float)
    squares = np.array([part.resid_mm**2 for part in parts])
    supports = [part.support for part in parts if part.support is not None]
    support, sigma_mm = None, parts[0].sigma_mm
    if len(supports) == len(parts):
        support = Support(
            np.concatenate([one.t + start for one, start in zip(supports, starts)]),
            np.concatenate([one.points for one in supports]),
            np.concatenate([one.sigma_m for one in supports]),
        )
        sigma_mm = 1000 * support.rms_m if len(support.t) else sigma_mm
    gaps = _merged_gaps(np.concatenate([part.gaps + start for part, start in zip(parts, starts)]))
    return replace(
        parts[0],
        xyz=xyz,
        points=int(round(points.sum())),
        resid_mm=float(np.sqrt((points * squares).sum() / max(points.sum(), 1.0))),
        sigma_mm=sigma_mm,
        bridged_m=float(np.sum(gaps[:, 1] - gaps[:, 0])),
        gaps=gaps,
        support=support,
    )


def _merged_gaps(gaps: np.ndarray) -> np.ndarray:
    """Unite gaps, (k, 2) in order, that touch."""
    if len(gaps) < 2:
        return gaps
    apart = gaps[1:, 0] > gaps[:-1, 1] + SAME_RAIL_M
    return np.column_stack([gaps[np.append(True, apart), 0], gaps[np.append(apart, True), 1]])
