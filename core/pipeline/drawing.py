"""The first step of the walk: the rails of every class, drawn square by square by the tasks of a runner."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..classify.ways import blunt_among
from ..errors import RailExtractError
from ..frpdf.models import choose
from ..heads.sections import MIN_SECTION_POINTS
from ..heads.strips import rows_of
from ..parameters import Parameters
from ..progress import Progress, counted
from ..rails import Centerline, RailLine, RailNetwork, SearchFigures
from ..raster import RailRaster
from ..run.tasks import Context, Runner, Task
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

    Also returns the rows of `seams.rows_in_frame` that show strips, (k, 7), and points that know how blunt they are.
    """
    progress.status("Drawing the rails")
    rails: list[RailLine] = []
    strips: list[np.ndarray] = []
    cleaned: dict[int, RailRaster] = {}
    judged: list[PointSource] = []
    any_square = False
    waiting = list(zip(points.classes, progress.split(len(points.classes))))
    while waiting:
        source, share = waiting.pop(0)
        code = source.class_code
        if isinstance(source, Filling):
            source = replace(source, lines=tuple(rail.xyz for rail in rails if rail.class_code == code))
        squares = {square.key: square for square in occupied_squares(points.classes, source)}
        drawing = Drawing(source, squares, parameters, runner)
        drawing.announce(share)
        parts, rasters = drawing.run(share)
        blunt = _blunt_strips(parts)
        if blunt:
            share.info(f"Class {code}: sharp and blunt points are drawn apart.")
            waiting[:0] = [(one.judged(False), share.span(1.0, 1.0)) for one in parted(source, blunt)]
            continue
        parts, source = drawing.alike(parts, share)
        judged.append(source)
        any_square |= bool(parts) or not squares
        strips += [rows_in_frame(part, source.frame) for part in parts]
        told = 0 if source.is_marked else len({strip for part in parts for strip in part.strips[:, 2].tolist()})
        if told:
            share.info(f"Class {code}: the points state no scanner passes; the heads show them on {told} levels.")
        found: list[RailLine] = []
        if parts:
            is_searched = points.search is not None and not any(part.blunt for part in parts)
            least_points = MIN_SECTION_POINTS if is_searched else 0
            found = whole_rails(_released(parts), source.frame, parameters, len(rails) + 1, share, least_points)
        alone = " that only blunt points show" if source.fills else ""
        share.info(f"Class {code}: {lengths_of(found, 'rail')}{alone}.")
        rails += [replace(rail, fills=source.fills) for rail in found]
        if rasters:
            own = assembled(rasters, squares, source.frame)
            cleaned[code] = merged(cleaned[code], own) if code in cleaned else own
    if not any_square:
        raise RailExtractError(f"Not one square could be extracted; the last error was: {runner.failures[-1]}")
    frame = points.classes[0].frame
    network = RailNetwork(tuple(rails), (), frame, cleaned=tuple(cleaned.values()), cleaned_classes=tuple(cleaned))
    return network, np.concatenate(strips or [rows_of((), ())]), replace(points, classes=judged)


def _released(parts: list[SquareRails]) -> Iterator[SquareRails]:
    """Yield the results of squares and let go of them."""
    while parts:
        yield parts.pop()


def lengths_of(lines: Sequence[RailLine] | Sequence[Centerline], what: str) -> str:
    """Write number and length of lines."""
    return f"{counted(len(lines), what)}, {sum(line.length_m for line in lines):,.0f} m"


def _blunt_strips(parts: Sequence[SquareRails]) -> frozenset[int]:
    """Return the strips that are blunt while others of the class are sharp, by the lengths that each shows."""
    seen: dict[int, SearchFigures] = {}
    for strip, sharp_m, round_m in np.concatenate([NO_KINDS, *(part.kinds for part in parts)]).tolist():
        seen[int(strip)] = seen.get(int(strip), SearchFigures()) + SearchFigures(sharp_m=sharp_m, round_m=round_m)
    return blunt_among(seen)


@dataclass(frozen=True)
class Drawing:
    """The points of a class, or its blunt ones beside sharp ones, the squares where their rails are, and what draws."""

    source: PointSource
    squares: Mapping[Key, Square]
    parameters: Parameters
    runner: Runner

    def announce(self, progress: Progress) -> None:
        """Say which points are processed, and with which network."""
        source, parameters = self.source, self.parameters
        what = "blunt point" if source.fills else "point"
        points, where = counted(sum(source.counts.values()), what), counted(len(self.squares), "square")
        model = choose(parameters.gauge_m, parameters.head_width_m, parameters.model).name
        passes = counted(parameters.passes, "pass", "passes") if parameters.passes else "passes until it is stable"
        progress.info(f"Class {source.class_code}: {points} in {where}; network {model}, {passes}.")

    def run(self, progress: Progress, drawn: Collection[Key] = ()) -> tuple[list[SquareRails], dict[Key, RailRaster]]:
        """Clean the raster of every square, and draw the lines of each square once its neighbours are clean.

        Given `drawn`, only the lines of these are drawn. Returns the lines, and cleaned rasters if they are kept.
        """
        parts: list[SquareRails] = []
        rasters: dict[Key, RailRaster] = {}
        for (step, key), result in self.runner.run(dict(self._tasks(drawn or self.squares)), progress):
            if step is _draw:
                parts.append(result)
            else:
                rasters[key] = result
        return parts, rasters

    def alike(self, parts: list[SquareRails], progress: Progress) -> tuple[list[SquareRails], PointSource]:
        """Draw the squares again that took a sharp cloud for blunt, by the length that most show, or vice versa.

        Also returns the source of points that know it.
        """
        shown_m = np.zeros(2)
        for part in parts:
            shown_m[int(bool(part.blunt))] += sum(rail.length_m for rail in part.rails)
        blunt = bool(shown_m[1] > shown_m[0])
        source = self.source.judged(blunt)
        odd = {part.square.key for part in parts if part.blunt not in (None, blunt)}
        if odd:
            near = {key: square for key, square in self.squares.items() if odd.intersection(around(key))}
            settings = replace(self.parameters, keep_cleaned=False)
            again, _ = Drawing(source, near, settings, self.runner).run(progress.span(1.0, 1.0), odd)
            parts = [part for part in parts if part.square.key not in odd] + again
        return parts, source

    def _tasks(self, drawn: Collection[Key]) -> Iterator[tuple[tuple[Callable, Key], Task]]:
        """Yield the tasks of squares: first those that clean all, then those that draw the lines of some."""
        # These two do not change the lines: without them, a runner that keeps results finds those of earlier runs.
        settings = replace(self.parameters, quality_step_m=None, keep_cleaned=False)
        arguments = {key: (self.source.part(square), square, settings) for key, square in self.squares.items()}
        where = {key: f"square {key} of class {self.source.class_code}" for key in self.squares}
        points = {key: self.source.counts.get(key, 1) for key in self.squares}
        for key in self.squares:
            label, weight, kept = f"Cleaning {where[key]}", CLEAN_S * points[key], self.parameters.keep_cleaned
            yield (_clean, key), Task(label, _clean, arguments[key], weight=weight, returned=kept)
        for key in drawn:
            label, weight, own = f"Drawing the lines of {where[key]}", DRAW_S * points[key], ((_clean, key),)
            near = tuple((_clean, one) for one in around(key) if one in self.squares and one != key)
            yield (_draw, key), Task(label, _draw, arguments[key], needs=own, uses=near, weight=weight)


def _clean(source: PointSource, square: Square, parameters: Parameters, context: Context) -> RailRaster:
    """Clean the raster of a square; a task."""
    return clean_square(source, square, parameters, context.network(engine_for, parameters), context.progress)


def _draw(source: PointSource, square: Square, parameters: Parameters, context: Context) -> SquareRails:
    """Draw the lines of a square; a task."""
    rasters = {key: raster for (_, key), raster in context.results.items()}
    return rails_of_square(source, square, rasters, parameters, context.progress)
