"""Track centerlines of clouds of any size: the surroundings of the guides are read, and fitted square by square."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..clouds.points import Request, strips_of
from ..errors import NoRailPointsError, ParameterError
from ..frame import LocalFrame
from ..parameters import AirborneParameters
from ..polyline import Polyline
from ..progress import Progress
from ..run.tasks import Context, Task
from ..standards import STANDARDS
from ..tiles.grid import Key
from ..tiles.store import counts_of, files_of, read_stored
from .cross_sections import STATION_M
from .fitting import EMPTY, SEEN, Fitted, Stations, fit_tracks
from .guide_line import axis_of_guide
from .reading import POINT, Piece, Run, density_of, pieces_by_square, spool
from .remarks import FLIGHT, are_hints, on_density, on_gauges, on_shapes, refuse_mobile
from .survey import AirborneTrack, Guide, Survey, joined_others, lines_of, track_of

FIT_S = 2e-5
"""Run time of the fit per point, in seconds."""

MIN_LENGTH_M = 30.0
"""Shorter guides have too few sections for a curve."""

OTHER_GAUGE_M, LEAST_SHOWN = 0.1, 0.5
"""Gauges this far from that of a guide are tried where no track is seen, and the share of the stations on which one
must show."""


def survey_files(run: Run, guides: Sequence[Guide]) -> Survey:
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
    return Survey(numbered, lines, frame, density, tuple(warnings))


def _fit(
    run: Run,
    squares: Mapping[Key, tuple[Piece, ...]],
    files: Mapping[Key, list[str]],
    counts: Mapping[Key, int],
    spacings_m: Sequence[float],
) -> list[list[tuple[Piece, Fitted]]]:
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
    fitted: list[list[tuple[Piece, Fitted]]] = [[] for _ in spacings_m]
    for key in tasks:
        for piece, one in zip(squares[key], found[key]):
            fitted[piece.number].append((piece, one))
    return fitted


def _check_degrees(request: Request, guides: Sequence[Guide]) -> None:
    """Refuse guides that are in degrees without saying so: a cloud has no such small coordinates."""
    largest = np.nanmax(np.abs([header.extent for header in request.headers]))
    if largest > 360 and all((np.abs(guide.xy[:, :2]) <= [180, 90]).all() for guide in guides):
        raise ParameterError(
            "The guides are in degrees, but state another coordinate system or none: assign WGS 84 (EPSG:4326)."
        )


def _axes(guides: Sequence[Guide], request: Request) -> tuple[list[Guide], list[Polyline], list[str]]:
    """Return the guides that are long enough, their axes in metres, and a sentence on those that are not."""
    kept: list[tuple[Guide, Polyline]] = []
    short: list[tuple[Guide, float]] = []
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
    pieces: Sequence[Piece],
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
    axis: Polyline,
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
    return track_of(guide, Stations(**columns), spacing_m, rail_height_m, frame, others)


def _frame(zero: LocalFrame, axes: Sequence[Polyline]) -> LocalFrame:
    """Return the frame of the results, with its origin among the guides."""
    middle = np.append(np.round(np.concatenate([axis.xy for axis in axes]).mean(axis=0)), 0.0)
    return zero.with_origin(middle)
