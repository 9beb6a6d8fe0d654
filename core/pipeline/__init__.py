"""The one walk from rail points to 3D rails and track centerlines, in the order of the paper's abstract.

It divides the work into tasks for a runner, which executes them one after another in this process or on many machines
(see `run.tasks`). The lines do not depend on the runner.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from .. import checks
from ..checks.doubts import doubting_scatter
from ..checks.standard import warn_of_spacing
from ..checks.warnings import plausible
from ..clouds.points import RailPoints
from ..errors import NoRailPointsError, NoTrackError
from ..heads.strips import strip_courses
from ..parameters import ALIGNED, Parameters
from ..progress import SILENT, Progress, Recording, counted
from ..rails import Centerline, RailNetwork, TrackGeometry
from ..run.tasks import Context, Runner, Task
from ..squares.remeasuring import measure_rails
from ..squares.steps import engine_for, square_side
from ..tiles.grid import MemorySource, PointSource, SortedPoints
from ..tracks.centerlines import tracks_of
from ..tracks.geometry import measure_track_geometry
from ..tracks.parallels import widths_by_gauge
from .drawing import drawn, lengths_of
from .sources import Source

DRAWING = 0.9
"""Share of the run time that the squares take, for the progress; tracks and their geometry share the rest."""


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
    network, strips, points = drawn(points, parameters, runner, drawing)
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
    progress.info(f"Paired: {lengths_of(centerlines, 'track')}.")
    return replace(network, centerlines=tuple(centerlines))


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
