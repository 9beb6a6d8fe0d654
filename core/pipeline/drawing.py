"""The first step of the walk: the rails of every class, drawn square by square by the tasks of a runner."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..classify.ways import blunt_among
from ..errors import RailExtractError
from ..frpdf.models import choose
from ..heads.strips import rows_of
from ..parameters import Parameters
from ..progress import Progress, counted
from ..rails import Centerline, RailLine, RailNetwork, SearchFigures
from ..raster import RailRaster
from ..run.loop import Runner
from ..run.tasks import Context, Task
from ..squares.seams import NO_KINDS, SquareRails, rows_in_frame
from ..squares.steps import assembled, clean_square, engine_for, merged, rails_of_square, whole_rails
from ..tiles.grid import (
    Filling,
    Key,
    PointSource,
    SortedPoints,
    Square,
    around,
    occupied_squares,
    parted,
)

CLEAN_S, DRAW_S = 1.5e-5, 2.5e-5
"""Run times per point, in seconds, of the two tasks of a square: cleaning its raster with the network, and drawing its
lines. At 400 points per metre of track, a kilometre takes 15 s."""


def drawn(
    points: SortedPoints, parameters: Parameters, runner: Runner, progress: Progress
) -> tuple[RailNetwork, np.ndarray, SortedPoints]:
    """Draw the rails of all classes.

    Also returns the rows of `pieces.rows_in_frame` that show strips, (k, 7), and points that know how blunt they are.
    """
    progress.status("Drawing the rails")
    rails: list[RailLine] = []
    strips: list[np.ndarray] = []
    cleaned: dict[int, RailRaster] = {}
    judged: list[PointSource] = []
    any_square = False
    shares = progress.split(len(points.classes))
    waiting = list(zip(points.classes, shares))
    while waiting:
        source, share = waiting.pop(0)
        if isinstance(source, Filling):
            sharp = tuple(rail.xyz for rail in rails if rail.class_code == source.class_code)
            source = replace(source, lines=sharp)
        squares = {square.key: square for square in occupied_squares(points.classes, source)}
        _announce_squares(source, squares, parameters, share)
        parts, rasters = _draw_squares(source, squares, parameters, runner, share)
        blunt = _blunt_strips(parts)
        if blunt:
            share.info(f"Class {source.class_code}: sharp and blunt points are drawn apart.")
            waiting[:0] = [(one.judged(False), share.span(1.0, 1.0)) for one in parted(source, blunt)]
            continue
        parts, source = _drawn_alike(parts, source, squares, parameters, runner, share)
        judged.append(source)
        any_square |= bool(parts) or not squares
        strips += [rows_in_frame(part, source.frame) for part in parts]
        found = whole_rails(_released(parts), source.frame, parameters, len(rails) + 1, share) if parts else []
        alone = " that only blunt points show" if source.fills else ""
        share.info(f"Class {source.class_code}: {lengths_of(found, 'rail')}{alone}.")
        rails += [replace(rail, fills=source.fills) for rail in found]
        if rasters:
            own, before = assembled(rasters, squares, source.frame), cleaned.get(source.class_code)
            cleaned[source.class_code] = own if before is None else merged(before, own)
    if not any_square:
        raise RailExtractError(f"Not one square could be extracted; the last error was: {runner.failures[-1]}")
    frame = points.classes[0].frame
    network = RailNetwork(tuple(rails), (), frame, cleaned=tuple(cleaned.values()), cleaned_classes=tuple(cleaned))
    return network, np.concatenate(strips or [rows_of((), ())]), replace(points, classes=judged)


def _released(parts: list[SquareRails]) -> Iterator[SquareRails]:
    """Yield the results of squares and let go of them."""
    while parts:
        yield parts.pop()


def _announce_squares(
    source: PointSource, squares: Mapping[Key, Square], parameters: Parameters, progress: Progress
) -> None:
    """Say which points are processed, and with which network."""
    what = "blunt point" if source.fills else "point"
    points, where = counted(sum(source.counts.values()), what), counted(len(squares), "square")
    model = choose(parameters.gauge_m, parameters.head_width_m, parameters.model).name
    passes = counted(parameters.passes, "pass", "passes") if parameters.passes else "passes until it is stable"
    progress.info(f"Class {source.class_code}: {points} in {where}; network {model}, {passes}.")


def lengths_of(lines: Sequence[RailLine] | Sequence[Centerline], what: str) -> str:
    """Write number and length of lines."""
    return f"{counted(len(lines), what)}, {sum(line.length_m for line in lines):,.0f} m"


def _draw_squares(
    source: PointSource,
    squares: Mapping[Key, Square],
    parameters: Parameters,
    runner: Runner,
    progress: Progress,
    drawn: Collection[Key] | None = None,
) -> tuple[list[SquareRails], dict[Key, RailRaster]]:
    """Clean the raster of every square of a class, and draw the lines of each square once its neighbours are clean.

    Given `drawn`, only the lines of these squares are drawn. Returns the lines, and cleaned rasters if they are kept.
    """
    parts: list[SquareRails] = []
    rasters: dict[Key, RailRaster] = {}
    for (step, key), result in runner.run(dict(_square_tasks(source, squares, parameters, drawn or squares)), progress):
        if step is _draw:
            parts.append(result)
        else:
            rasters[key] = result
    return parts, rasters


def _blunt_strips(parts: Sequence[SquareRails]) -> frozenset[int]:
    """Return the strips that are blunt while others of the class are sharp, by the lengths that each shows."""
    seen: dict[int, SearchFigures] = {}
    for strip, sharp_m, round_m in np.concatenate([NO_KINDS, *(part.kinds for part in parts)]).tolist():
        seen[int(strip)] = seen.get(int(strip), SearchFigures()) + SearchFigures(sharp_m=sharp_m, round_m=round_m)
    return blunt_among(seen)


def _drawn_alike(
    parts: list[SquareRails],
    source: PointSource,
    squares: Mapping[Key, Square],
    parameters: Parameters,
    runner: Runner,
    progress: Progress,
) -> tuple[list[SquareRails], PointSource]:
    """Draw the squares again that took the cloud for blunt while the most length shows that it is sharp, or vice versa.

    Also returns the source of points that know it.
    """
    shown_m = np.zeros(2)
    for part in parts:
        shown_m[int(bool(part.blunt))] += sum(rail.length_m for rail in part.rails)
    source = source.judged(bool(shown_m[1] > shown_m[0]))
    odd = {part.square.key for part in parts if part.blunt not in (None, shown_m[1] > shown_m[0])}
    if odd:
        near = {key: square for key, square in squares.items() if odd.intersection(around(key))}
        settings = replace(parameters, keep_cleaned=False)
        again, _ = _draw_squares(source, near, settings, runner, progress.span(1.0, 1.0), odd)
        parts = [part for part in parts if part.square.key not in odd] + again
    return parts, source


def _square_tasks(
    source: PointSource, squares: Mapping[Key, Square], parameters: Parameters, drawn: Collection[Key]
) -> Iterator[tuple[tuple[Callable, Key], Task]]:
    """Yield the tasks of squares of a class: first those that clean all, then those that draw the lines of some."""
    # These two do not change the lines: without them, a runner that keeps results finds those of earlier runs.
    settings = replace(parameters, quality_step_m=None, keep_cleaned=False)
    arguments = {key: (source.part(square), square, settings) for key, square in squares.items()}
    where = {key: f"square {key} of class {source.class_code}" for key in squares}
    weights = {key: source.counts.get(key, 1) for key in squares}
    for key in squares:
        yield (
            (_clean, key),
            Task(
                f"Cleaning {where[key]}",
                _clean,
                arguments[key],
                weight=CLEAN_S * weights[key],
                returned=parameters.keep_cleaned,
            ),
        )
    for key in drawn:
        neighbours = tuple((_clean, near) for near in around(key) if near in squares and near != key)
        yield (
            (_draw, key),
            Task(
                f"Drawing the lines of {where[key]}",
                _draw,
                arguments[key],
                needs=((_clean, key),),
                uses=neighbours,
                weight=DRAW_S * weights[key],
            ),
        )


def _clean(source: PointSource, square: Square, parameters: Parameters, context: Context) -> RailRaster:
    """Clean the raster of a square; a task."""
    return clean_square(source, square, parameters, context.network(engine_for, parameters), context.progress)


def _draw(source: PointSource, square: Square, parameters: Parameters, context: Context) -> SquareRails:
    """Draw the lines of a square; a task."""
    rasters = {key: raster for (_, key), raster in context.results.items()}
    return rails_of_square(source, square, rasters, parameters, context.progress)
