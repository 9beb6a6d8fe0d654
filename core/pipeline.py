"""The one walk from classified points to 3D rails and track centerlines, in the order of the paper's abstract.

`extract_rails` and `extract_files` divide the work into tasks and hand them to a runner, which executes them one after
another in this process or on many machines (see `tasks`). The lines do not depend on the runner.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from .checks.doubts import doubting_jumps, doubting_scatter, gauge_scatter, strip_courses, warn_of_strips
from .checks.lines import warn_of_rails, warn_of_split_classes, with_tracks
from .checks.standard import head_widths, warn_of_gauge, warn_of_raw, warn_of_spacing
from .classify.settings import Settings
from .clouds.las import CloudHeader
from .clouds.points import RailPoints, Request, read_each
from .errors import CloudError, NoRailPointsError, NoTrackError, RailExtractError
from .frpdf.models import choose
from .grow.settings import GrowSettings
from .heads.strips import rows_of
from .labelling.spooling import spool_found, spool_grown
from .parameters import ALIGNED, Parameters
from .progress import SILENT, Progress, Recording, counted
from .rails import Centerline, RailLine, RailNetwork, SearchFigures, TrackGeometry
from .raster import RailRaster
from .scratch import scratch_folder
from .squares.density import occupied_squares, plausible, warn_of_airborne, warn_of_unexplained
from .squares.grid import Key, MemorySource, PointSource, Square, around, assembled
from .squares.pieces import SquareRails, rows_in_frame
from .squares.remeasuring import measure_rails
from .squares.spool import SpooledFile, SpooledPoints, gather, spool_file
from .squares.steps import clean_square, engine_for, rails_of_square, square_side, whole_rails
from .tasks import Context, InTurn, Runner, Task
from .tracks.centerlines import tracks_of
from .tracks.geometry import measure_track_geometry
from .tracks.parallels import widths_by_gauge

READING, DRAWING, PAIRING, MEASURING = 0.2, 0.72, 0.04, 0.04
"""Run times of the steps relative to each other, for the progress: sorting files, squares, tracks, track geometry."""

FINDING = 4.0
"""Run time, relative to these, of finding the rail points of a raw cloud, which has 10 to 100 times as many points."""

CLEAN_S, DRAW_S = 1.5e-5, 2.5e-5
"""Run times per point, in seconds, of the two tasks of a square: cleaning its raster with the network, and drawing its
lines. At 400 points per metre of track, a kilometre takes 15 s."""

REMEASURE, STATIONS = 0.8, 0.2
"""Run times of the two steps of the track geometry: the heights of the rails, and the stations."""


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
    parameters : Parameters
    progress : Progress

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
    return _walk(sources, parameters, InTurn(), progress)


def extract_files(
    request: Request,
    folder: Path,
    parameters: Parameters,
    runner: Runner,
    progress: Progress = SILENT,
    classify: bool = False,
    weights: Path | None = None,
    seeds: Sequence[np.ndarray] = (),
) -> RailNetwork:
    """Extract rails and centerlines from files of points, however large, with any runner.

    Parameters
    ----------
    request : Request
        Files, classes and extent, from `points.ask`.
    folder : Path
        Existing folder for the points of the squares, 24 bytes each. The caller removes it.
    parameters : Parameters
    runner : Runner
        Whether errors of single files and squares end the run is for the runner to decide.
    progress : Progress
    classify : bool
        Whether the cloud is a raw one, whose rail points are to be found first; the request is for the classes
        `standards.SEARCHED_CLASSES` then.
    weights : Path, optional
        Weights of the network that finds them; None means geometry.
    seeds : sequence of (k, 2) array
        Places on railheads, k = 1, or lines along them, in units of the CRS, if only the rails that grow from these
        are to be extracted; the request is for the same classes.

    Raises
    ------
    CloudError
        A file is damaged; if the runner tolerates that, all of them are.
    NoRailPointsError
        No point of the requested classes is in the files and the extent.
    DiskError
        The disk is full.
    ModelError, Cancelled
        See `extract_rails`.
    RailExtractError
        Every square failed.
    """
    side_m = square_side(parameters)
    progress = recording = Recording(progress)
    first = FINDING if classify or len(seeds) else READING
    reading, rest = progress.divide((first, DRAWING + PAIRING + MEASURING))
    if classify or len(seeds):
        is_warned = False
        with scratch_folder(folder) as scratch:
            if classify:
                settings = Settings(parameters.gauges_m, parameters.head_width_m, weights=weights)
                source, figures, is_warned = _found(request, settings, parameters, scratch, runner, reading)
            else:
                own = GrowSettings(parameters.gauge_m, parameters.head_width_m)
                source, figures = spool_grown(request, seeds, own, side_m, scratch, reading)
            network = _walk([source], parameters, runner, rest, is_warned, raw=True)
        if classify and network.heads is not None and network.heads.blunt:
            # Only its partner tells a blunt rail from other ridges, and the user has been told so.
            network = replace(network, rails=tuple(rail for rail in network.rails if rail.track_ids))
        return replace(network, warnings=recording.warnings, search=figures)
    is_warned = warn_of_gauge(request, parameters, progress)
    request.announce(progress)
    network = _walk(_sorted_points(request, side_m, folder, runner, reading), parameters, runner, rest, is_warned)
    return replace(network, warnings=recording.warnings)


def _found(
    request: Request, settings: Settings, parameters: Parameters, folder: Path, runner: Runner, progress: Progress
) -> tuple[SpooledPoints, SearchFigures, bool]:
    """Find the rail points of a raw cloud; returns them, figures, and whether the user is warned of another gauge."""
    try:
        source, figures = spool_found(request, settings, square_side(parameters), folder, runner, progress)
    except NoRailPointsError:
        warn_of_raw(request, SearchFigures(), parameters, progress)
        raise
    return source, figures, warn_of_raw(request, figures, parameters, progress)


def _sorted_points(
    request: Request, side_m: float, folder: Path, runner: Runner, progress: Progress
) -> tuple[SpooledPoints, ...]:
    """Sort the points of all files into squares, one file per task."""
    arguments = [(side_m, folder)] * len(request.headers)
    return gather(request, side_m, read_each(request, _sort_file, arguments, runner, progress))


def _sort_file(request: Request, header: CloudHeader, side_m: float, folder: Path, context: Context) -> SpooledFile:
    """Sort the points of one file; a task."""
    try:
        return spool_file(request, header, side_m, folder, context.progress)
    except OSError as error:
        raise CloudError(
            f"{header.path.name} can't be read ({error.strerror}): check the disk or the network drive."
        ) from error


def _walk(
    sources: Sequence[PointSource],
    parameters: Parameters,
    runner: Runner,
    progress: Progress,
    is_warned: bool = False,
    raw: bool = False,
) -> RailNetwork:
    """Extract rails, centerlines and track geometry from points that are sorted into squares.

    If the user `is_warned` of another gauge, the rails do not lead to the same question again. The points may be those
    that were found in a `raw` cloud.
    """
    progress = Recording(progress)
    drawing, pairing, measuring = progress.divide((DRAWING, PAIRING, MEASURING))
    progress.status("Drawing the rails")
    sources = plausible(sources, progress)
    rails, strips, cleaned, sources = _draw_rails(sources, parameters, runner, drawing, raw)
    centerlines = _pair_rails(rails, sources, parameters, runner, pairing, is_warned)
    progress.info(f"Paired: {_lengths(centerlines, 'track')}.")
    rails = with_tracks(rails, centerlines, progress)
    warn_of_split_classes(rails, parameters, progress)
    warn_of_strips(rails, parameters, progress)
    rails = doubting_jumps(rails, centerlines, progress)
    heads = head_widths(sources[0], parameters.gauges, progress, rails) if rails else None
    beyond_m = gauge_scatter(rails, centerlines, parameters.gauges_m) if heads and heads.blunt else {}
    rails = doubting_scatter(rails, beyond_m)
    geometry = _measure_tracks(centerlines, rails, beyond_m, sources, parameters, runner, measuring)
    described = dict(runner.run({"engine": Task("Describing the engine", _describe_engine, (parameters,))}))
    progress.info(f"Engine of the network: {described.get('engine', 'unknown')}.")
    progress.set_fraction(1.0)
    return RailNetwork(
        tuple(rails),
        tuple(centerlines),
        sources[0].frame,
        described.get("engine", ""),
        tuple(geometry),
        tuple(cleaned.values()),
        tuple(cleaned),
        tuple(runner.failures),
        progress.warnings,
        heads,
        strip_courses(centerlines, strips),
    )


def _draw_rails(
    sources: Sequence[PointSource], parameters: Parameters, runner: Runner, progress: Progress, raw: bool
) -> tuple[list[RailLine], np.ndarray, dict[int, RailRaster], list[PointSource]]:
    """Draw the rails of all classes.

    Returns
    -------
    rails : list of RailLine
    strips : array
        Offsets of the strips in the frame of the cloud, see `squares.pieces.rows_in_frame`.
    cleaned : dict of int to RailRaster
        Cleaned rasters by class, if they are to be kept.
    sources : list of PointSource
        Those of points that know whether their cloud blunts heads.
    """
    rails: list[RailLine] = []
    strips: list[np.ndarray] = []
    cleaned: dict[int, RailRaster] = {}
    judged: list[PointSource] = []
    any_square = False
    for source, share in zip(sources, progress.split(len(sources))):
        squares = {square.key: square for square in occupied_squares(sources, source)}
        _announce_squares(source, squares, parameters, share)
        parts, rasters = _draw_squares(source, squares, parameters, runner, share)
        parts, source = _drawn_alike(parts, source, squares, parameters, runner, share)
        judged.append(source)
        any_square |= bool(parts) or not squares
        strips += [rows_in_frame(part, source.frame) for part in parts]
        found = whole_rails(_released(parts), source.frame, parameters, len(rails) + 1, share) if parts else []
        share.info(f"Class {source.class_code}: {_lengths(found, 'rail')}.")
        warn_of_rails(found, source.class_code, parameters, share, raw)
        if found:
            warn_of_unexplained(source, found, share)
            warn_of_airborne(source, found, share)
        rails += found
        if rasters:
            cleaned[source.class_code] = assembled(rasters, squares, source.frame)
    if not any_square:
        raise RailExtractError(f"Not one square could be extracted; the last error was: {runner.failures[-1]}")
    return rails, np.concatenate(strips or [rows_of((), ())]), cleaned, judged


def _pair_rails(
    rails: Sequence[RailLine],
    sources: Sequence[PointSource],
    parameters: Parameters,
    runner: Runner,
    progress: Progress,
    is_warned: bool,
) -> list[Centerline]:
    """Draw the centerlines; without any track, what the points show of the gauge is a failure of the run."""
    try:
        return tracks_of(rails, parameters, progress)
    except NoTrackError as error:
        told = f"No track of {1000 * parameters.gauge_m:.0f} mm gauge found."
        is_asked = is_warned or warn_of_spacing(sources[0], parameters, progress)
        runner.failures.append(told if is_asked else str(error))
        return []


def _released(parts: list[SquareRails]) -> Iterator[SquareRails]:
    """Yield the results of squares and let go of them."""
    while parts:
        yield parts.pop()


def _announce_squares(
    source: PointSource, squares: Mapping[Key, Square], parameters: Parameters, progress: Progress
) -> None:
    """Say which points are processed, and with which network."""
    points, where = counted(sum(source.counts.values()), "point"), counted(len(squares), "square")
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

    Given `drawn`, only the lines of these squares are drawn.

    Returns
    -------
    parts : list of SquareRails
    rasters : dict of Key to RailRaster
        Cleaned rasters, if they are to be kept.
    """
    parts: list[SquareRails] = []
    rasters: dict[Key, RailRaster] = {}
    for (step, key), result in runner.run(dict(_square_tasks(source, squares, parameters, drawn or squares)), progress):
        if step is _draw:
            parts.append(result)
        else:
            rasters[key] = result
    return parts, rasters


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


def _describe_engine(parameters: Parameters, context: Context) -> str:
    """Name the engine and the device; a task."""
    return context.once(engine_for, parameters).description


def _measure_tracks(
    centerlines: Sequence[Centerline],
    rails: Sequence[RailLine],
    beyond_m: Mapping[int, float],
    sources: Sequence[PointSource],
    parameters: Parameters,
    runner: Runner,
    progress: Progress,
) -> list[TrackGeometry]:
    """Measure the geometry of all tracks, class by class, if it is asked for; see `gauge_scatter` for `beyond_m`."""
    if parameters.quality_step_m is None:
        return []
    remeasuring, stations = progress.divide((REMEASURE, STATIONS))
    align = parameters.strips == ALIGNED
    heads_m = widths_by_gauge(rails, parameters.gauges, parameters.centerline_tolerance_m)
    measured = measure_rails(rails, sources, heads_m, runner, remeasuring, align)
    measured = doubting_scatter(measured, beyond_m)
    geometry: list[TrackGeometry] = []
    for source, share in zip(sources, stations.split(len(sources))):
        geometry += measure_track_geometry(
            [line for line in centerlines if line.class_code == source.class_code],
            [rail for rail in measured if rail.class_code == source.class_code],
            parameters.head_width_m,
            parameters.quality_step_m,
            share,
            parameters.gauges,
        )
    if geometry:
        count = sum(len(track.chainage_m) for track in geometry)
        progress.info(f"Measured: {counted(count, 'station')}, one every {parameters.quality_step_m:g} m.")
    return sorted(geometry, key=lambda one: one.track_id)
