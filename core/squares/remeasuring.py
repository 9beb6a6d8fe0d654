"""Re-measurement of the heights and the support of finished rails, square by square."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..heads.elevation import measure_again
from ..lines.smoothing import GAP_SIGMAS
from ..lines.uniting import united
from ..polyline import length_along, resample, runs
from ..progress import SILENT, Progress
from ..rails import RailLine
from ..tracks.geometry import PROFILE_SIGMA_M
from .grid import Key, PointSource, Square, unique_keys

CONTEXT_M = 10.0
"""Distance beyond a square over which its rails are measured as well: the disc reaches 1 m, the smoothing of heights
over 1 m at most 3 m, and that of the lateral figures 2.4 m."""

LOOKUP_STEP_M = 1.0
"""Spacing of the stations whose square is looked up."""


def measure_in_squares(
    rails: Sequence[RailLine],
    source: PointSource,
    squares: Sequence[Square],
    head_width_m: float,
    progress: Progress = SILENT,
) -> list[RailLine]:
    """Measure rails again for track geometry, like `elevation.measure_again`, using the points of one square at a time.

    Parameters
    ----------
    rails : sequence of RailLine
        In the frame of the source.
    source : PointSource
    squares : sequence of Square
        All squares that have points.
    head_width_m : float
    progress : Progress

    Returns
    -------
    list of RailLine
        In the order given.
    """
    if squares[0].is_whole_plane:
        points = source.near(squares[0], 0.0)
        return measure_again(rails, points, head_width_m, PROFILE_SIGMA_M, progress)
    zero = Square.on_grid((0, 0), source.side_m, source.frame).frame.shift_to(source.frame)
    wanted: dict[Key, list[tuple[int, float, float]]] = {}
    for number, rail in enumerate(rails):
        for key, start, end in _by_square(rail, zero, source.side_m):
            wanted.setdefault(key, []).append((number, start, end))
    by_key = {square.key: square for square in squares}
    measured: list[list[tuple[float, RailLine]]] = [[] for _ in rails]
    for key in progress.follow(sorted(wanted)):
        square = by_key.get(key) or Square.on_grid(key, source.side_m, source.frame)
        shift = square.frame.shift_to(source.frame)
        points = source.near(square, CONTEXT_M)
        pieces = [
            replace(piece, xyz=piece.xyz - shift)
            for piece in (
                rails[number].between(start - CONTEXT_M, end + CONTEXT_M) for number, start, end in wanted[key]
            )
        ]
        again = measure_again(pieces, points, head_width_m, PROFILE_SIGMA_M)
        for (number, start, end), piece in zip(wanted[key], again):
            before = min(start, CONTEXT_M)
            part = piece.between(before, before + end - start)
            measured[number].append((start, replace(part, xyz=part.xyz + shift)))
    return [
        _straight_across_gaps(united([part for _, part in sorted(parts, key=lambda part: part[0])])) if parts else rail
        for parts, rail in zip(measured, rails)
    ]


def _straight_across_gaps(rail: RailLine) -> RailLine:
    """Interpolate heights across long gaps, as an undivided profile does; a square may show only one side of a gap."""
    t, xyz = length_along(rail.xyz[:, :2]), rail.xyz.copy()
    for start, end in rail.gaps:
        if end - start > GAP_SIGMAS * PROFILE_SIGMA_M and start > 0 and end < t[-1]:
            inside = (t > start) & (t < end)
            heights = np.interp([start, end], t[~inside], rail.xyz[~inside, 2])
            xyz[inside, 2] = np.interp(t[inside], [start, end], heights)
    return replace(rail, xyz=xyz)


def _by_square(rail: RailLine, zero: np.ndarray, side_m: float) -> list[tuple[Key, float, float]]:
    """Divide a rail among the squares it crosses; returns square and chainages of start and end, without gaps."""
    stations, t = resample(rail.xyz[:, :2], LOOKUP_STEP_M)
    keys, number = unique_keys(stations - zero[:2], side_m)
    parts = []
    for place, key in enumerate(keys):
        for first, last in runs(number == place):
            start = 0.0 if first == 0 else 0.5 * (t[first - 1] + t[first])
            end = t[-1] if last == len(t) - 1 else 0.5 * (t[last] + t[last + 1])
            parts.append((key, float(start), float(end)))
    return parts
