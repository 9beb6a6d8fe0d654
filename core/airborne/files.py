"""Track centerlines of clouds of any size: the surroundings of the guides are read, and fitted square by square.

The squares are those of a grid anchored at the zero of the coordinate system, by which the points are sorted on disk,
so that memory does not grow with the length of a railway. In each, the pieces of all guides are fitted together, with
as much of them around it as their curves depend on. Of any cloud, only what the fit needs is kept.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..clouds.points import Request, read_each, strips_of, touching
from ..clouds.readers import CloudHeader, read_classes
from ..errors import NoRailPointsError, ParameterError
from ..frame import LocalFrame
from ..parameters import AirborneParameters
from ..polyline import Polyline
from ..progress import SILENT, Progress
from ..raster import ROW
from ..run.tasks import Context, Runner, Task
from ..standards import STANDARDS
from ..tiles.grid import Key
from ..tiles.store import SortedFile, append, counts_of, files_of, read_stored
from .fitting import EMPTY, SEEN, Fitted, TrackStations, fit_tracks
from .guide_line import STATION_M, axis_of_guide
from .ridges import HALF_M
from .rounds import WIDE_M
from .survey import (
    FLIGHT,
    AirborneSurvey,
    AirborneTrack,
    GuideLine,
    are_hints,
    joined_others,
    lines_of,
    on_density,
    on_gauges,
    on_shapes,
    refuse_mobile,
    track_of,
)

SIDE_M = 1000.0
"""Side of the squares: with 40 points per square metre and four tracks, one needs 0.3 GB."""

MARGIN_M = 120.0
"""Length of a guide beyond the square on which a curve within it depends: twelve stations."""

CELL_M = 16.0
"""Side of the cells that make up the surroundings of guides."""

POINT = np.dtype([("xyz", "<f8", 3), ("mark", "<u4")])
"""A point on disk: metres from the zero of the coordinate system, and its mark, see `passes.marks_of`."""

PLACE_M = 2.0
"""Side of the squares in which the density is counted."""

FIT_S = 2e-5
"""Run time of the fit per point, in seconds."""

MIN_LENGTH_M = 30.0
"""Shorter guides have too few sections for a curve."""

OTHER_GAUGE_M, LEAST_SHOWN = 0.1, 0.5
"""Gauges this far from that of a guide are tried where no track is seen, and the share of the stations on which one
must show."""


@dataclass(frozen=True)
class Run:
    """A run on an airborne cloud: one task per file and one per square.

    The caller removes the folder, which holds 28 bytes for each point around the guides.
    """

    request: Request
    parameters: AirborneParameters
    folder: Path
    runner: Runner
    progress: Progress = SILENT


@dataclass(frozen=True)
class GuidePart:
    """The part of guide `number` in a square, whose stations are those between two chainages of the guide.

    The axis has margins, and its first chainage is a multiple of `STATION_M`.
    """

    number: int
    axis: Polyline
    first_m: float
    last_m: float


def pieces_by_square(axes: Sequence[Polyline]) -> dict[Key, tuple[GuidePart, ...]]:
    """Divide guides into squares."""
    found: dict[Key, list[GuidePart]] = {}
    for number, axis in enumerate(axes):
        for key, first_m, last_m in _stays(axis):
            low_m = max(np.floor((first_m - MARGIN_M) / STATION_M) * STATION_M, 0.0)
            inside = slice(*np.searchsorted(axis.t, [low_m, np.nextafter(last_m + MARGIN_M, np.inf)]))
            around = Polyline(axis.xy[inside], axis.t[inside])
            found.setdefault(key, []).append(GuidePart(number, around, first_m, last_m))
    return {key: tuple(pieces) for key, pieces in sorted(found.items())}


def _stays(axis: Polyline) -> Iterator[tuple[Key, float, float]]:
    """Yield each stay of a guide in a square, by the middles of its sections, with the chainages of its ends."""
    count = max(int(np.ceil(axis.t[-1] / STATION_M)), 1)
    middles = (np.arange(count) + 0.5) * STATION_M
    keys = np.floor(axis.at(middles) / SIDE_M).astype(np.int64)
    turns = np.flatnonzero((np.diff(keys, axis=0) != 0).any(axis=1)) + 1
    for run in np.split(np.arange(count), turns):
        key = (int(keys[run[0], 0]), int(keys[run[0], 1]))
        yield key, float(run[0] * STATION_M), float((run[-1] + 1) * STATION_M)


def cells_around(axes: Sequence[Polyline], reach_m: float) -> np.ndarray:
    """Return the numbers of the cells within reach of lines, rising."""
    steps = np.arange(-int(np.ceil(reach_m / CELL_M)), int(np.ceil(reach_m / CELL_M)) + 1)
    around = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    cells = np.unique(np.concatenate([np.floor(axis.xy / CELL_M).astype(np.int64) for axis in axes]), axis=0)
    return np.unique(numbers_of((cells[:, None] + around).reshape(-1, 2)))


def in_cells(xy: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return which places, (n, 2), lie in cells, given by their numbers, (n,) bool."""
    number = numbers_of(np.floor(xy / CELL_M).astype(np.int64))
    at = np.minimum(np.searchsorted(cells, number), len(cells) - 1)
    return cells[at] == number


def numbers_of(cells: np.ndarray) -> np.ndarray:
    """Return a number for each cell, given by its column and row, (n, 2)."""
    return cells[:, 0] * ROW + cells[:, 1]


def spool(run: Run, squares: Mapping[Key, tuple[GuidePart, ...]]) -> list[SortedFile]:
    """Sort the points around the guides into squares on disk."""
    request, wide_m = run.request, run.parameters.reach_m + WIDE_M + HALF_M
    areas = {
        key: np.concatenate([request.areas_along(piece.axis.xy, wide_m) for piece in pieces])
        for key, pieces in squares.items()
    }
    around = {key: cells_around([piece.axis for piece in pieces], wide_m) for key, pieces in squares.items()}
    headers, arguments = [], []
    for header in request.headers:
        touched = {key: some for key, own in areas.items() if len(some := touching(own, header.extent))}
        if touched:
            headers.append(header)
            arguments.append((np.concatenate([*touched.values()]), {key: around[key] for key in touched}, run.folder))
    return read_each(replace(request, headers=tuple(headers)), spool_file, arguments, run.runner, run.progress)


def spool_file(
    request: Request,
    header: CloudHeader,
    areas: np.ndarray,
    around: Mapping[Key, np.ndarray],
    folder: Path,
    context: Context,
) -> SortedFile:
    """Sort the points of a file into squares; a task.

    Given are rectangles in which points are needed, (k, 4) in units of the CRS, and the cells whose points each square
    needs.
    """
    mine = SortedFile.new_folder(folder)
    counts: Counter[Key] = Counter()
    anywhere = np.unique(np.concatenate([*around.values()]))
    chunks = read_classes(header.path, request.class_codes, context.progress, areas, request.leave_out)
    for xyz, _, marks, _ in chunks:
        local = request.zero.to_local(xyz)
        kept = in_cells(local[:, :2], anywhere) & request.holds(xyz)
        points = np.empty(int(kept.sum()), POINT)
        points["xyz"], points["mark"] = local[kept], marks[kept]
        for key, cells in around.items():
            own = points[in_cells(points["xyz"][:, :2], cells)]
            if len(own):
                counts[key] += len(own)
                append(mine, key, own)
    return SortedFile(str(mine), counts)


def density_of(xy: np.ndarray) -> np.ndarray:
    """Return the number of places, (n, 2), in each square of `PLACE_M` that has one, per square metre."""
    _, number = np.unique(numbers_of(np.floor(xy / PLACE_M).astype(np.int64)), return_counts=True)
    return number / PLACE_M**2


def survey_files(run: Run, guides: Sequence[GuideLine]) -> AirborneSurvey:
    """Find the track of each guide in a cloud.

    Raises CloudError if a file is damaged or the cloud is one of mobile lidar, NoRailPointsError if no point of these
    classes lies along the guides, and ParameterError if no guide lies in the cloud, or one is too short.
    """
    request, parameters, progress = run.request, run.parameters, run.progress
    _check_degrees(request, guides)
    guides, axes, short = _axes(guides, request)
    _check_inside(request, axes, parameters.reach_m)
    squares = pieces_by_square(axes)
    reading, fitting = progress.divide((1.0, 2.0))
    progress.status("Reading the points along the guides")
    progress.reading()
    points = spool(replace(run, progress=reading), squares)
    counts = counts_of(points)
    if not counts:
        raise NoRailPointsError(
            f"The cloud has no points of class {', '.join(map(str, request.class_codes))} along the guides: set the "
            "classes, and check the coordinate system of the guides."
        )
    files = {key: files_of(key, points) for key in counts}
    densities = [density_of(read_stored(own, POINT)["xyz"][:, :2]) for own in files.values()]
    density = float(np.median(np.concatenate(densities)))
    refuse_mobile(density)
    progress.info(f"The cloud has {density:.1f} points per square metre along the guides.")
    progress.status("Fitting the tracks")
    spacings_m = [parameters.spacing_of(guide.gauge_m) for guide in guides]
    fitted = _fit(replace(run, progress=fitting), squares, files, counts, spacings_m)
    frame = _frame(request.zero, axes)
    tracks = [
        _joined(guide, axis, parts, spacing_m, parameters.rail_height_m, request.zero, frame)
        for guide, axis, parts, spacing_m in zip(guides, axes, fitted, spacings_m)
    ]
    numbered, lines = lines_of(tracks, 1000 * parameters.gauge_m, are_hints(density, parameters))
    found = [[one for _, one in parts] for parts in fitted]
    warnings = [*short, *on_density(density, parameters), *on_gauges(guides, found, parameters)]
    warnings += on_shapes([one for parts in found for one in parts], parameters, spacings_m)
    for warning in warnings:
        progress.warning(warning)
    progress.info(FLIGHT)
    return AirborneSurvey(numbered, lines, frame, density, tuple(warnings))


def _fit(
    run: Run,
    squares: Mapping[Key, tuple[GuidePart, ...]],
    files: Mapping[Key, list[str]],
    counts: Mapping[Key, int],
    spacings_m: Sequence[float],
) -> list[list[tuple[GuidePart, Fitted]]]:
    """Fit all squares that have points, and return what was found along each guide, piece by piece."""
    tasks: dict[Key, Task] = {
        key: Task(
            f"The square {key}",
            fit_square,
            (files[key], pieces, spacings_m, run.parameters),
            weight=FIT_S * counts[key],
        )
        for key, pieces in squares.items()
        if key in counts
    }
    found: dict[Key, list[Fitted]] = dict(run.runner.run(tasks, run.progress))
    fitted: list[list[tuple[GuidePart, Fitted]]] = [[] for _ in spacings_m]
    for key in tasks:
        for piece, one in zip(squares[key], found[key]):
            fitted[piece.number].append((piece, one))
    return fitted


def _check_degrees(request: Request, guides: Sequence[GuideLine]) -> None:
    """Refuse guides that are in degrees without saying so: a cloud has no such small coordinates."""
    largest = np.nanmax(np.abs([header.extent for header in request.headers]))
    if largest > 360 and all((np.abs(guide.xy[:, :2]) <= [180, 90]).all() for guide in guides):
        raise ParameterError(
            "The guides are in degrees, but state another coordinate system or none: assign WGS 84 (EPSG:4326)."
        )


def _axes(guides: Sequence[GuideLine], request: Request) -> tuple[list[GuideLine], list[Polyline], list[str]]:
    """Return the guides that are long enough, their axes in metres, and a sentence on those that are not."""
    kept: list[tuple[GuideLine, Polyline]] = []
    short: list[tuple[GuideLine, float]] = []
    for guide in guides:
        xy = request.zero.to_local(np.column_stack([guide.xy[:, :2], np.zeros(len(guide.xy))]))[:, :2]
        xy = xy[np.append(True, np.hypot(*np.diff(xy, axis=0).T) > 0)]
        length_m = float(np.hypot(*np.diff(xy, axis=0).T).sum())
        if length_m < MIN_LENGTH_M:
            short.append((guide, length_m))
        else:
            kept.append((guide, axis_of_guide(xy)))
    if not kept:
        guide, length_m = short[0]
        raise ParameterError(
            f"Guide {guide.guide_id} is {length_m:.1f} m long: give guides of {MIN_LENGTH_M:g} m or more."
        )
    left_out = [
        f"Guide {guide.guide_id} is left out: it is {length_m:.1f} m long, too short alone. Join it to the line "
        "that it continues."
        for guide, length_m in short
    ]
    return [guide for guide, _ in kept], [axis for _, axis in kept], left_out


def _check_inside(request: Request, axes: Sequence[Polyline], reach_m: float) -> None:
    """Refuse guides of which none lies in the cloud; headers may state an extent that is not a number."""
    extents = np.array([header.extent for header in request.headers], dtype=float)
    if not np.isfinite(extents).all():
        return
    unit_m = request.zero.horizontal_unit_m
    inside = [
        (
            (axis.xy[:, None] > extents[:, :2] * unit_m - reach_m)
            & (axis.xy[:, None] < extents[:, 2:] * unit_m + reach_m)
        )
        .all(axis=-1)
        .any()
        for axis in axes
    ]
    if any(inside):
        return
    raise ParameterError(
        "No guide lies in the cloud: check the coordinate system of the guides, and that the cloud covers the line."
    )


def fit_square(
    files: Sequence[str],
    pieces: Sequence[GuidePart],
    spacings_m: Sequence[float],
    parameters: AirborneParameters,
    context: Context,
) -> list[Fitted]:
    """Fit the pieces of guides in a square; their stations outside of it are dropped. A task."""
    points = read_stored(files, POINT)
    origin = np.floor(points["xyz"].mean(axis=0))
    axes = [Polyline(piece.axis.xy - origin[:2], piece.axis.t) for piece in pieces]
    own = [spacings_m[piece.number] for piece in pieces]
    local = points["xyz"] - origin
    strips = strips_of(points["xyz"], points["mark"])
    rest = (parameters.reach_m, parameters.footprint_m, context.progress)
    found = fit_tracks(local, strips, axes, own, *rest)
    for number, (axis, spacing_m) in enumerate(zip(axes, own)):
        if not (found[number].stations.reason == SEEN).any():
            shown_m = _shown_otherwise(local, strips, axis, spacing_m, parameters, context.progress)
            found[number] = replace(found[number], shown_m=shown_m)
    return [_moved(one, origin, piece) for one, piece in zip(found, pieces)]


def _shown_otherwise(
    local: np.ndarray,
    strips: np.ndarray,
    axis: Polyline,
    spacing_m: float,
    parameters: AirborneParameters,
    progress: Progress,
) -> float:
    """Return the distance of rails at another gauge that show along a guide whose own do not, else NaN."""
    best, shown_m = LEAST_SHOWN, np.nan
    for gauge_m in sorted({one.gauge_m for one in STANDARDS.values()}):
        tried_m = parameters.spacing_of(gauge_m)
        if abs(tried_m - spacing_m) < OTHER_GAUGE_M:
            continue
        progress.check()
        (one,) = fit_tracks(local, strips, [axis], [tried_m], parameters.reach_m, parameters.footprint_m)
        share = float((one.stations.reason == SEEN).mean())
        if share > best:
            best, shown_m = share, one.shown_m if np.isfinite(one.shown_m) else tried_m
    return shown_m


def _moved(fitted: Fitted, origin: np.ndarray, piece: GuidePart) -> Fitted:
    """Return the stations within the square, in metres from the zero of the coordinate system."""
    stations = fitted.stations
    own = (stations.t > piece.first_m) & (stations.t < piece.last_m)
    columns = {name: values[own] for name, values in vars(stations).items()}
    columns["xy"], columns["bed"] = columns["xy"] + origin[:2], columns["bed"] + origin[2]
    others = fitted.others[(fitted.others[:, 0] > piece.first_m) & (fitted.others[:, 0] < piece.last_m)]
    return replace(fitted, stations=TrackStations(**columns), others=others)


def _joined(
    guide: GuideLine,
    axis: Polyline,
    parts: Sequence[tuple[GuidePart, Fitted]],
    spacing_m: float,
    rail_height_m: float,
    zero: LocalFrame,
    frame: LocalFrame,
) -> AirborneTrack:
    """Join the stations of a guide; those of squares without points are not seen."""
    count = max(int(np.ceil(axis.t[-1] / STATION_M)), 1)
    t = (np.arange(count) + 0.5) * STATION_M
    unknown = np.full(count, np.nan)
    columns = {name: unknown.copy() for name in ("bed", "tilt", "sigma", "sigma_bed")}
    columns.update(t=t, xy=axis.at(t), margin=np.zeros(count))
    columns.update(reason=np.full(count, EMPTY), switch=np.zeros(count, dtype=bool))
    for _, one in parts:
        at = np.clip((one.stations.t / STATION_M).astype(np.int64), 0, count - 1)
        for name, values in vars(one.stations).items():
            if name != "t":
                columns[name][at] = values
    known = np.isfinite(columns["bed"])
    if known.any():
        columns["bed"] = np.interp(t, t[known], columns["bed"][known])
    shift = zero.shift_to(frame)
    columns["xy"], columns["bed"] = columns["xy"] + shift[:2], columns["bed"] + shift[2]
    others = joined_others(np.concatenate([one.others for _, one in parts] or [np.empty((0, 2))]))
    return track_of(guide, TrackStations(**columns), spacing_m, rail_height_m, frame, others)


def _frame(zero: LocalFrame, axes: Sequence[Polyline]) -> LocalFrame:
    """Return the frame of the results, with its origin among the guides."""
    middle = np.append(np.round(np.concatenate([axis.xy for axis in axes]).mean(axis=0)), 0.0)
    return zero.with_origin(middle)
