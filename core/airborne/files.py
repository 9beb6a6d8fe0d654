"""Track centerlines of clouds of any size: the surroundings of the guides are read, and fitted square by square."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..clouds.points import Request, strips_of
from ..clouds.readers import read_classes
from ..disk import writing
from ..errors import CloudError, NoRailPointsError, ParameterError
from ..frame import LocalFrame
from ..parameters import AirborneParameters
from ..progress import SILENT, Progress
from ..tasks import READ_S, Context, Runner, Task
from .axis import Axis, axis_of_guide
from .beside import WIDE_M
from .fitting import EMPTY, Fitted, Stations, fit_tracks
from .refinement import STATION_M
from .ridges import HALF_M, Shape
from .squares import Key, Piece, areas_along, cells_around, in_cells, pieces_by_square
from .survey import AirborneTrack, Guide, Survey, joined_others, lines_of, track_of

POINT = np.dtype([("xyz", "<f8", 3), ("mark", "<u4")])
"""A point on disk: metres from the zero of the coordinate system, and its mark, see `passes.marks_of`."""

FIT_S = 2e-5
"""Run time of the fit per point, in seconds."""

MIN_LENGTH_M = 30.0
"""Shorter guides have too few sections for a curve."""

MOBILE_DENSITY = 500.0
"""Points per square metre above which single railheads show, and Extract Rails is better: airborne clouds have up to
100, surveys from drones up to 400."""

SPARSE_DENSITY, WIDE_FOOTPRINT_M = 5.0, 0.4
"""Below this density, a footprint this wide hides the rails in too many sections."""

FLIGHT = (
    "The standard errors are those of the fit. They leave out the error of the flight itself against its datum, often "
    "3 to 10 cm: compare with control points."
)

WIDE_RIDGES = 1.6
"""Ridges this much wider than the footprint makes them are warned of."""


def survey_files(
    request: Request,
    guides: Sequence[Guide],
    parameters: AirborneParameters,
    folder: Path,
    runner: Runner,
    progress: Progress = SILENT,
) -> Survey:
    """Find the track of each guide in a cloud.

    Parameters
    ----------
    request : Request
        Files, classes and extent.
    guides : sequence of Guide
    parameters : AirborneParameters
    folder : Path
        Existing folder for the points around the guides, 28 bytes each; the caller removes it.
    runner : Runner
        Executes one task per file and one per square.
    progress : Progress

    Raises
    ------
    CloudError
        A file is damaged, or the cloud is one of mobile lidar.
    DiskError
        The disk is full.
    NoRailPointsError
        No point of these classes lies along the guides.
    ParameterError
        No guide lies in the cloud, or one is too short.
    """
    _check_degrees(request, guides)
    axes = [_axis(guide, request) for guide in guides]
    _check_inside(request, axes, parameters.reach_m)
    squares = pieces_by_square(axes)
    reading, fitting = progress.divide((1.0, 2.0))
    progress.status("Reading the points along the guides")
    counts = _spool(request, squares, parameters.reach_m, folder, runner, reading)
    if not counts:
        raise NoRailPointsError(
            f"The cloud has no points of class {', '.join(map(str, request.class_codes))} along the guides: set the "
            "classes, and check the coordinate system of the guides."
        )
    density = _density(folder, axes, counts)
    warnings = _judge_density(density, parameters, progress)
    progress.status("Fitting the tracks")
    spacings_m = [parameters.spacing_of(guide.gauge_m) for guide in guides]
    tasks: dict[Key, Task] = {
        key: Task(
            f"The square {key}", fit_square, (folder, key, pieces, spacings_m, parameters), weight=FIT_S * counts[key]
        )
        for key, pieces in squares.items()
        if key in counts
    }
    found: dict[Key, list[Fitted]] = dict(runner.run(tasks, fitting))
    fitted: list[list[tuple[Piece, Fitted]]] = [[] for _ in guides]
    for key, results in found.items():
        for piece, one in zip(squares[key], results):
            fitted[piece.number].append((piece, one))
    frame = _frame(request.zero, axes)
    tracks = [
        _joined(guide, axis, parts, spacing_m, parameters.rail_height_m, request.zero, frame)
        for guide, axis, parts, spacing_m in zip(guides, axes, fitted, spacings_m)
    ]
    numbered, lines = lines_of(tracks, 1000 * parameters.gauge_m)
    warnings += _judge_shapes([one for parts in fitted for _, one in parts], parameters, spacings_m)
    for warning in warnings:
        progress.warning(warning)
    progress.info(FLIGHT)
    return Survey(numbered, lines, frame, density, tuple(warnings))


def _check_degrees(request: Request, guides: Sequence[Guide]) -> None:
    """Refuse guides that are in degrees without saying so: a cloud has no such small coordinates."""
    largest = np.nanmax(np.abs([header.extent for header in request.headers]))
    if largest > 360 and all((np.abs(guide.xy[:, :2]) <= [180, 90]).all() for guide in guides):
        raise ParameterError(
            "The guides are in degrees, but state another coordinate system or none: assign WGS 84 (EPSG:4326)."
        )


def _axis(guide: Guide, request: Request) -> Axis:
    """Return the axis of a guide in metres."""
    xy = request.zero.to_local(np.column_stack([guide.xy[:, :2], np.zeros(len(guide.xy))]))[:, :2]
    xy = xy[np.append(True, np.hypot(*np.diff(xy, axis=0).T) > 0)]
    length_m = float(np.hypot(*np.diff(xy, axis=0).T).sum())
    if length_m < MIN_LENGTH_M:
        raise ParameterError(
            f"Guide {guide.guide_id} is {length_m:.1f} m long: give guides of {MIN_LENGTH_M:g} m or more."
        )
    return axis_of_guide(xy)


def _check_inside(request: Request, axes: Sequence[Axis], reach_m: float) -> None:
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


def _spool(
    request: Request,
    squares: Mapping[Key, tuple[Piece, ...]],
    reach_m: float,
    folder: Path,
    runner: Runner,
    progress: Progress,
) -> dict[Key, int]:
    """Sort the points around the guides into squares on disk, and return the number in each."""
    wide_m = reach_m + WIDE_M + HALF_M
    areas = areas_along(squares, wide_m) / request.zero.horizontal_unit_m
    around = {key: cells_around([piece.axis for piece in pieces], wide_m) for key, pieces in squares.items()}
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    tasks = {}
    for number, header in enumerate(request.headers):
        low, high = np.array(header.extent[:2]), np.array(header.extent[2:])
        touched = ~((areas[:, :2] > high) | (areas[:, 2:] < low)).any(axis=1)  # an extent of NaN may be anywhere
        if touched.any():
            arguments = (request, number, areas[touched], around, folder)
            tasks[number] = Task(header.path.name, spool_file, arguments, weight=READ_S * (header.point_count + 1))
    counts: dict[Key, int] = {}
    for _, one in runner.run(tasks, progress):
        for key, count in one.items():
            counts[key] = counts.get(key, 0) + count
    return counts


def spool_file(
    request: Request, number: int, areas: np.ndarray, around: Mapping[Key, np.ndarray], folder: Path, context: Context
) -> dict[Key, int]:
    """Sort the points of a file into squares, and return the number in each.

    Parameters
    ----------
    request : Request
    number : int
        Of the file.
    areas : (k, 4) array
        Rectangles in which points are needed, units of the CRS.
    around : mapping of Key to (m,) array
        Cells whose points each square needs.
    folder : Path
    context : Context
    """
    header = request.headers[number]
    counts: dict[Key, int] = {}
    chunks = read_classes(header.path, request.class_codes, context.progress, areas, request.leave_out)
    for xyz, _, marks, _ in chunks:
        kept = request.holds(xyz)
        local, marks = request.zero.to_local(xyz[kept]), marks[kept]
        for key, cells in around.items():
            inside = in_cells(local[:, :2], cells)
            if not inside.any():
                continue
            points = np.empty(int(inside.sum()), POINT)
            points["xyz"], points["mark"] = local[inside], marks[inside]
            counts[key] = counts.get(key, 0) + len(points)
            with writing(folder), _file(folder, key, number).open("ab") as file:
                file.write(points.tobytes())
    return counts


def _file(folder: Path, key: Key, number: int) -> Path:
    return folder / f"{key[0]}_{key[1]}_{number}"


def _points_of(folder: Path, key: Key) -> np.ndarray:
    """Return the points of a square, (n,) `POINT`."""
    files = sorted(folder.glob(f"{key[0]}_{key[1]}_*"))
    return np.concatenate([np.fromfile(file, POINT) for file in files])


def fit_square(
    folder: Path,
    key: Key,
    pieces: Sequence[Piece],
    spacings_m: Sequence[float],
    parameters: AirborneParameters,
    context: Context,
) -> list[Fitted]:
    """Fit the pieces of guides in a square; their stations outside of it are dropped."""
    points = _points_of(folder, key)
    origin = np.floor(points["xyz"].mean(axis=0))
    axes = [Axis(piece.axis.xy - origin[:2], piece.axis.t) for piece in pieces]
    own = [spacings_m[piece.number] for piece in pieces]
    local = points["xyz"] - origin
    strips = strips_of(points["xyz"], points["mark"])
    found = fit_tracks(local, strips, axes, own, parameters.reach_m, parameters.footprint_m, context.progress)
    return [_moved(one, origin, piece) for one, piece in zip(found, pieces)]


def _moved(fitted: Fitted, origin: np.ndarray, piece: Piece) -> Fitted:
    """Return the stations within the square, in metres from the zero of the coordinate system."""
    stations = fitted.stations
    own = (stations.t > piece.first_m) & (stations.t < piece.last_m)
    columns = {name: values[own] for name, values in vars(stations).items()}
    columns["xy"], columns["bed"] = columns["xy"] + origin[:2], columns["bed"] + origin[2]
    others = fitted.others[(fitted.others[:, 0] > piece.first_m) & (fitted.others[:, 0] < piece.last_m)]
    return replace(fitted, stations=Stations(**columns), others=others)


def _joined(
    guide: Guide,
    axis: Axis,
    parts: Sequence[tuple[Piece, Fitted]],
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
    columns.update(t=t, xy=axis.at(t)[0].copy(), margin=np.zeros(count))
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
    return track_of(guide, Stations(**columns), spacing_m, rail_height_m, frame, others)


def _frame(zero: LocalFrame, axes: Sequence[Axis]) -> LocalFrame:
    """Return the frame of the results, with its origin among the guides."""
    middle = np.append(np.round(np.concatenate([axis.xy for axis in axes]).mean(axis=0)), 0.0)
    return zero.with_origin(middle)


def _density(folder: Path, axes: Sequence[Axis], counts: Mapping[Key, int]) -> float:
    """Return the points per square metre along the guides: the median over places that have points."""
    found = []
    for key in counts:
        xy = _points_of(folder, key)["xyz"][:, :2]
        cells = np.floor(xy / PLACE_M).astype(np.int64)
        _, number = np.unique(cells, axis=0, return_counts=True)
        found.append(number[number > 0])
    return float(np.median(np.concatenate(found))) / PLACE_M**2


PLACE_M = 2.0
"""Side of the squares in which the density is counted."""


def _judge_density(density: float, parameters: AirborneParameters, progress: Progress) -> list[str]:
    """Refuse a cloud of mobile lidar, and warn of one that is too sparse for its footprint."""
    if density > MOBILE_DENSITY:
        raise CloudError(
            f"The cloud has {density:.0f} points per square metre along the guides, as mobile lidar has: use Extract "
            "Rails, which finds the single railheads and is more accurate there."
        )
    progress.info(f"The cloud has {density:.1f} points per square metre along the guides.")
    if density < SPARSE_DENSITY and parameters.footprint_m > WIDE_FOOTPRINT_M:
        return [
            f"The cloud has {density:.1f} points per square metre, too few for a footprint of "
            f"{parameters.footprint_m:g} m: take the lines as hints."
        ]
    return []


def _judge_shapes(found: Sequence[Fitted], parameters: AirborneParameters, spacings_m: Sequence[float]) -> list[str]:
    """Warn of ridges that do not fit the footprint."""
    shapes = [one.shape for one in found if one.shape is not None and (one.stations.reason == 0).any()]
    if not shapes:
        return []
    width_m = float(np.median([shape.width_m for shape in shapes]))
    expected_m = Shape.expected(spacings_m[0], parameters.footprint_m).width_m
    if width_m < WIDE_RIDGES * expected_m:
        return []
    return [
        f"The rails show as ridges with a standard deviation of {1000 * width_m:.0f} mm, wider than a footprint of "
        f"{parameters.footprint_m:g} m makes them: set the footprint of the scanner."
    ]
