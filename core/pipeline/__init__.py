"""The one walk from rail points to 3D rails and track centerlines, in the order of the paper's abstract.

It divides the work into tasks for a runner, which executes them one after another in this process or on many machines
(see `run.loop`). The lines do not depend on the runner.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from .. import checks
from ..checks.doubts import doubting_scatter, strip_courses
from ..checks.points import occupied_squares, plausible
from ..checks.standard import warn_of_spacing
from ..classify.ways import blunt_among
from ..clouds.points import RailPoints
from ..errors import NoRailPointsError, NoTrackError, RailExtractError
from ..frpdf.models import choose
from ..heads.strips import rows_of
from ..parameters import ALIGNED, Parameters
from ..progress import SILENT, Progress, Recording, counted
from ..rails import Centerline, RailLine, RailNetwork, SearchFigures, TrackGeometry
from ..raster import RailRaster
from ..run.loop import Runner
from ..run.tasks import Context, Task
from ..squares.remeasuring import measure_rails
from ..squares.seams import NO_KINDS, SquareRails, rows_in_frame
from ..squares.steps import clean_square, engine_for, rails_of_square, square_side, whole_rails
from ..tiles.grid import (
    Filling,
    Key,
    MemorySource,
    PointSource,
    SortedPoints,
    Square,
    around,
    assembled,
    merged,
    parted,
)
from ..tracks.centerlines import tracks_of
from ..tracks.geometry import measure_track_geometry
from ..tracks.parallels import widths_by_gauge
from .sources import Source

DRAWING = 0.9
"""Share of the run time that the squares take, for the progress; tracks and their geometry share the rest."""

CLEAN_S, DRAW_S = 1.5e-5, 2.5e-5
"""Run times per point, in seconds, of the two tasks of a square: cleaning its raster with the network, and drawing its
lines. At 400 points per metre of track, a kilometre takes 15 s."""


def extract_rails(
    points: Sequence[RailPoints | PointSource], parameters: Parameters, progress: Progress = SILENT
) -> RailNetwork:
    """Extract rails and centerlines from classified points.

    Each class is processed separately, and its lines have its code; ids are unique across classes. A cloud that is
    longer than a square is processed in squares.

    Parameters
    ----------
    points : sequence of RailPoints or PointSource
        From `points.read_rail_points` or `spool.spool`: one per class, all in one frame.

    Raises
    ------
    NoRailPointsError
        No points were given.
    ModelError
        No weights fit the rail standard, or the engine is not installed.
    Cancelled
        The user cancelled.

    Examples
    --------
    >>> import numpy as np
    >>> from rail_extract.core.frame import LocalFrame
    >>> random = np.random.RandomState(0)
    >>> x, side = random.uniform(0, 15, 5000), random.randint(2, size=5000)
    >>> y = 1.507 * side + random.uniform(-0.036, 0.036, 5000)
    >>> cloud = RailPoints(np.column_stack([x, y, np.zeros(5000)]), LocalFrame(np.zeros(3)), class_code=10)
    >>> network = extract_rails([cloud], Parameters(gauge_m=1.435, head_width_m=0.072, engine="OPENCV"))
    >>> [round(rail.length_m) for rail in network.rails]
    [15, 15]
    >>> abs(network.centerlines[0].gauge_mm - 1435) < 2
    True
    """
    if not points:
        raise NoRailPointsError("There is no point to extract rails from.")
    side_m = square_side(parameters)
    sources = [MemorySource(one, side_m) if isinstance(one, RailPoints) else one for one in points]
    return _walk(SortedPoints(sources), parameters, Runner(), progress)


def extract_files(
    source: Source, folder: Path, parameters: Parameters, runner: Runner, progress: Progress = SILENT
) -> RailNetwork:
    """Extract rails and centerlines from files of points, however large, with any runner.

    The source is made from a request of `points.ask`. The caller removes the folder, which gets the points of the
    squares, 24 bytes each. Whether errors of single files and squares end the run is for the runner to decide.

    Raises CloudError if a file is damaged (if the runner tolerates that, all of them are), NoRailPointsError if no
    point of the requested classes is in the files and the extent, and RailExtractError if every square failed.
    """
    recording = Recording(progress)
    sorting, walking = recording.divide((source.run_time, 1.0))
    with source.sort(folder, parameters, runner, sorting) as points:
        return replace(_walk(points, parameters, runner, walking), warnings=recording.warnings)


def _walk(points: SortedPoints, parameters: Parameters, runner: Runner, progress: Progress) -> RailNetwork:
    """Extract rails, centerlines and track geometry from points that are sorted into squares."""
    progress = Recording(progress)
    drawing = progress.span(0, DRAWING)
    pairing, measuring = progress.span(DRAWING, 1).split(2)
    points = replace(points, classes=plausible(points.classes, progress))
    network, strips, points = _drawn(points, parameters, runner, drawing)
    network = _paired(network, points, parameters, runner, pairing)
    network, beyond_m = checks.of(network, points, parameters, progress)
    network = _measured(network, beyond_m, points, parameters, runner, measuring)
    progress.set_fraction(1.0)
    return replace(
        network,
        engine=_engine(parameters, runner, progress),
        failures=tuple(runner.failures),
        warnings=progress.warnings,
        strips=strip_courses(network.centerlines, strips),
        search=points.search,
    )


def _drawn(
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
        share.info(f"Class {source.class_code}: {_lengths(found, 'rail')}{alone}.")
        rails += [replace(rail, fills=source.fills) for rail in found]
        if rasters:
            own, before = assembled(rasters, squares, source.frame), cleaned.get(source.class_code)
            cleaned[source.class_code] = own if before is None else merged(before, own)
    if not any_square:
        raise RailExtractError(f"Not one square could be extracted; the last error was: {runner.failures[-1]}")
    frame = points.classes[0].frame
    network = RailNetwork(tuple(rails), (), frame, cleaned=tuple(cleaned.values()), cleaned_classes=tuple(cleaned))
    return network, np.concatenate(strips or [rows_of((), ())]), replace(points, classes=judged)


def _paired(
    network: RailNetwork, points: SortedPoints, parameters: Parameters, runner: Runner, progress: Progress
) -> RailNetwork:
    """Draw the centerlines; without any track, what the points show of the gauge is a failure of the run."""
    centerlines: Sequence[Centerline] = ()
    try:
        centerlines = tracks_of(network.rails, parameters, progress)
    except NoTrackError as error:
        told = f"No track of {1000 * parameters.gauge_m:.0f} mm gauge found."
        is_asked = points.is_warned or warn_of_spacing(points.classes[0], parameters, progress)
        runner.failures.append(told if is_asked else str(error))
    progress.info(f"Paired: {_lengths(centerlines, 'track')}.")
    return replace(network, centerlines=tuple(centerlines))


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


def _lengths(lines: Sequence[RailLine] | Sequence[Centerline], what: str) -> str:
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


def _engine(parameters: Parameters, runner: Runner, progress: Progress) -> str:
    """Name the engine and the device that ran the network."""
    described = dict(runner.run({"engine": Task("Describing the engine", _describe_engine, (parameters,))}))
    progress.info(f"Engine of the network: {described.get('engine', 'unknown')}.")
    return described.get("engine", "")


def _describe_engine(parameters: Parameters, context: Context) -> str:
    """Name the engine and the device; a task."""
    return context.once(engine_for, parameters).description


def _measured(
    network: RailNetwork,
    beyond_m: Mapping[int, float],
    points: SortedPoints,
    parameters: Parameters,
    runner: Runner,
    progress: Progress,
) -> RailNetwork:
    """Measure the geometry of all tracks, class by class, if it is asked for; see `gauge_scatter` for `beyond_m`."""
    if parameters.quality_step_m is None:
        return network
    remeasuring, stations = progress.split(2)
    align = parameters.strips == ALIGNED
    heads_m = widths_by_gauge(network.rails, parameters.gauges, parameters.centerline_tolerance_m)
    measured = measure_rails(network.rails, points.classes, heads_m, runner, remeasuring, align)
    measured = doubting_scatter(measured, beyond_m)
    geometry: list[TrackGeometry] = []
    codes = list(dict.fromkeys(source.class_code for source in points.classes))
    for code, share in zip(codes, stations.split(len(codes))):
        geometry += measure_track_geometry(
            [line for line in network.centerlines if line.class_code == code],
            [rail for rail in measured if rail.class_code == code],
            parameters.head_width_m,
            parameters.quality_step_m,
            share,
            parameters.gauges,
        )
    if geometry:
        count = sum(len(track.chainage_m) for track in geometry)
        progress.info(f"Measured: {counted(count, 'station')}, one every {parameters.quality_step_m:g} m.")
    return replace(network, geometry=tuple(sorted(geometry, key=lambda one: one.track_id)))
