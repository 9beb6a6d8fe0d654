"""Re-measurement of the heights and the support of finished rails, square by square."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..heads.elevation import measure_again
from ..heads.head_points import Widths
from ..lines.finishing import united
from ..lines.smoothing import GAP_SIGMAS, PROFILE_SIGMA_M
from ..polyline import runs
from ..progress import SILENT, Progress
from ..rails import RailLine
from ..run.tasks import Context, Runner, Task
from ..tiles.grid import Key, PointSource, Square, Tiling, drawn_from, lay_out

CONTEXT_M = 10.0
"""Distance beyond a square over which its rails are measured as well: the disc reaches 1 m, and what is further away
moves a smoothed height by a third of its standard error, and by half of it where heads are blunt."""

LOOKUP_STEP_M = 1.0
"""Spacing of the stations whose square is looked up."""

Section = tuple[int, float, float]
"""The part of a rail in a square: number of the rail, and chainages of start and end."""


def measure_rails(
    rails: Sequence[RailLine],
    sources: Sequence[PointSource],
    head_width_m: Widths,
    runner: Runner,
    progress: Progress = SILENT,
    align: bool = False,
) -> list[RailLine]:
    """Measure rails again for track geometry, like `elevation.measure_again`, using the points of one square at a time.

    Rails of other classes than the sources remain as they are, and so do heights and support where a square fails.
    `head_width_m` is that of all rails or of each, (n,); `align` moves strips onto their mean.
    """
    measured, widths_m = list(rails), np.broadcast_to(head_width_m, len(rails))
    for source, share in zip(sources, progress.split(len(sources))):
        squares, sections = _sections(rails, source, sources)
        tasks = {}
        for key in sorted(sections):
            square = squares[key]
            pieces = tuple(_with_context(rails[one[0]], one, square, source) for one in sections[key])
            label = f"Measuring the rails of class {source.class_code} in square {key}"
            own = widths_m[[number for number, _, _ in sections[key]]]
            tasks[key] = Task(label, _measure, (source.part(square), square, pieces, own, align))
        parts: dict[int, list[tuple[float, RailLine]]] = defaultdict(list)
        for key, pieces in runner.run(tasks, share):
            shift = squares[key].frame.shift_to(source.frame)
            for (number, start, end), piece in zip(sections[key], pieces):
                before = min(start, CONTEXT_M)
                part = piece.between(before, before + end - start)
                parts[number].append((start, replace(part, xyz=part.xyz + shift)))
        for number, found in parts.items():
            whole = united([part for _, part in sorted(found, key=lambda part: part[0])])
            measured[number] = _straight_across_gaps(whole)
    return measured


def _measure(
    source: PointSource,
    square: Square,
    rails: Sequence[RailLine],
    widths_m: np.ndarray,
    align: bool,
    context: Context,
) -> tuple[RailLine, ...]:
    """Measure the rails of a square, in its frame; a task."""
    points = source.near(square, CONTEXT_M)
    return tuple(measure_again(rails, points, widths_m, context.progress, align))


def _with_context(rail: RailLine, section: Section, square: Square, source: PointSource) -> RailLine:
    """Cut a section out of a rail, with `CONTEXT_M` on either side, and move it into the frame of the square."""
    _, start, end = section
    piece = rail.between(start - CONTEXT_M, end + CONTEXT_M)
    return replace(piece, xyz=piece.xyz - square.frame.shift_to(source.frame))


def _straight_across_gaps(rail: RailLine) -> RailLine:
    """Interpolate heights across long gaps, as an undivided profile does; a square may show only one side of a gap."""
    t, xyz = rail.line.t, rail.xyz.copy()
    for start, end in rail.gaps:
        if end - start > GAP_SIGMAS * PROFILE_SIGMA_M and start > 0 and end < t[-1]:
            inside = (t > start) & (t < end)
            heights = np.interp([start, end], t[~inside], rail.xyz[~inside, 2])
            xyz[inside, 2] = np.interp(t[inside], [start, end], heights)
    return replace(rail, xyz=xyz)


def _sections(
    rails: Sequence[RailLine], source: PointSource, sources: Sequence[PointSource]
) -> tuple[dict[Key, Square], dict[Key, list[Section]]]:
    """Divide the rails of a class among the squares that they cross; the sections of a rail follow without gaps."""
    squares = {square.key: square for square in lay_out(sources, source)}
    whole = next((key for key, square in squares.items() if square.is_whole_plane), None)
    zero = Square.on_grid((0, 0), source.side_m, source.frame).frame.shift_to(source.frame)
    sections: dict[Key, list[Section]] = defaultdict(list)
    for number, rail in enumerate(rails):
        if not drawn_from(rail, source):
            continue
        stations = rail.line.resampled(LOOKUP_STEP_M)
        t = stations.t
        if whole is not None:
            sections[whole].append((number, 0.0, float(t[-1])))
            continue
        keys, index = Tiling(source.side_m).keys(stations.xy - zero[:2])
        for place, key in enumerate(keys):
            for first, last in runs(index == place):
                start = 0.0 if first == 0 else 0.5 * (t[first - 1] + t[first])
                end = t[-1] if last == len(t) - 1 else 0.5 * (t[last] + t[last + 1])
                sections[key].append((number, float(start), float(end)))
                squares.setdefault(key, Square.on_grid(key, source.side_m, source.frame))
    return squares, sections
