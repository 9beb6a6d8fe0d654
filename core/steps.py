"""The steps of the walk, each on one square or one class: raster, network, lines, heights, tracks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from scipy.spatial import cKDTree

from .classify.thin import SURROUNDINGS_M, drawn
from .clouds.points import RailPoints
from .errors import NoTrackError, ParameterError
from .frame import LocalFrame
from .frpdf.cleanup import MARGIN, clean, max_passes
from .frpdf.engine import Engine, make_engine
from .frpdf.models import choose
from .frpdf.weights import load_arrays
from .heads.edges import STATION_STEP_M
from .heads.elevation import ElevationParameters, elevate, flat_rail, flat_rails, numbered
from .heads.refinement import refine
from .heads.roads import onto_heads
from .heads.smoothing_check import warn_if_out_of_reach
from .heads.strips import rows_of, strips_along
from .lines.bridges import FIT_M
from .lines.network import LineNetwork
from .lines.network_smoothing import smooth_network
from .lines.thinning import thin
from .lines.turning import MAX_TURN_DEG, parts_without_turns
from .parameters import ALIGNED, Parameters
from .polyline import length_along
from .progress import SILENT, Progress
from .rails import STRIP_OFF_M, Centerline, RailLine
from .raster import TILE, RailRaster, cell_size, rasterize
from .squares.grid import HALO_M, OVERLAP_M, Key, PointSource, Square, mosaic, own_tiles
from .squares.pieces import SquareRails, trim
from .squares.seams import join
from .standards import distinct_gauges
from .tracks.centerlines import CenterlineParameters, build_centerlines
from .tracks.jumps import Steps
from .tracks.lone import assign_tracks
from .tracks.parallels import widths_by_gauge
from .vectorize import vectorize

MIN_STRIPS_APART_M = 5.0
"""Length of rail on which strips are apart from which the user is warned; they are compared over twice this length."""

MAX_LISTED = 3
"""Steps that a warning lists."""

LARGEST_PERCENT = 95.0
"""Percentile of the distances that is stated as the largest: switches and crossings make some of them wrong."""

VECTORIZE, SMOOTH, REFINE, ELEVATE = 0.45, 0.05, 0.25, 0.25
"""Relative run times of the steps from a raster to lines, for the progress."""

SAME_RAIL_M = 0.5
"""Ends of rails that are closer together belong to one rail: no two rails of any gauge end so close to each other."""


def square_side(parameters: Parameters) -> float:
    """Return the side of the squares in metres.

    Raises
    ------
    ParameterError
        The squares would overlap with more than their neighbours.
    """
    tile_m = _tile_side(parameters)
    smallest = math.ceil(OVERLAP_M / tile_m)
    if parameters.square_tiles < smallest:
        raise ParameterError(f"Squares of {parameters.square_tiles} tiles are too small: give {smallest} at least.")
    return parameters.square_tiles * tile_m


def overlap_tiles(parameters: Parameters) -> int:
    """Return the number of tiles around a square from which its lines are drawn as well.

    The squares on both sides of a border must see the same surroundings of it: twice a gap together with the lines that
    its bridge is fitted to on either side, and three sigma of the smoothing in height. However long the gaps, only the
    neighbours are included.
    """
    reach_m = HALO_M + max(2 * (parameters.max_gap_m + 2 * FIT_M), 3 * (parameters.smoothing_z_m or 0.0))
    return min(math.ceil(max(reach_m, OVERLAP_M) / _tile_side(parameters)), parameters.square_tiles)


def _tile_side(parameters: Parameters) -> float:
    """Return the side of a raster tile in metres."""
    return TILE * cell_size(parameters.gauge_m, parameters.head_width_m)


def engine_for(parameters: Parameters) -> Engine:
    """Set up the engine with the weights that fit the gauge and the railhead."""
    arrays = load_arrays(choose(parameters.gauge_m, parameters.head_width_m, parameters.model).path)
    return make_engine(arrays, parameters.engine, parameters.device)


def clean_square(
    source: PointSource, square: Square, parameters: Parameters, engine: Engine, progress: Progress = SILENT
) -> RailRaster:
    """Rasterize the points of a square, clean the raster with the network, and keep the tiles inside the square.

    The network also sees cells that are drawn along thin rails (docs/method.md section 2.4).

    Parameters
    ----------
    source : PointSource
    square : Square
    parameters : Parameters
    engine : Engine
    progress : Progress
    """
    cell_m = cell_size(parameters.gauge_m, parameters.head_width_m)
    margin_m = max_passes(parameters.passes) * MARGIN * cell_m
    seen = _seen(source.near(square, margin_m + SURROUNDINGS_M).xyz, parameters, cell_m)
    raster = rasterize(seen[square.holds(seen, margin_m)], cell_m)
    return own_tiles(clean(raster, engine, parameters.passes, progress), square)


def _seen(points: np.ndarray, parameters: Parameters, cell_m: float) -> np.ndarray:
    """Return what the network sees, (n, 2) local metres: points, (m, 3), and places along thin rails."""
    spacings_m = [gauge_m + head_m for gauge_m, head_m in parameters.gauges]
    return np.concatenate([points[:, :2], drawn(points, spacings_m, cell_m)])


def rails_of_square(
    source: PointSource,
    square: Square,
    rasters: Mapping[Key, RailRaster],
    parameters: Parameters,
    progress: Progress = SILENT,
) -> SquareRails:
    """Draw the rails of a square.

    Parameters
    ----------
    source : PointSource
    square : Square
    rasters : mapping of Key to RailRaster
        Cleaned rasters of the square and of its neighbours; a neighbour may be missing.
    parameters : Parameters
    progress : Progress
    """
    tiles = overlap_tiles(parameters)
    raster = mosaic(rasters, square, tiles)
    overlap_m = tiles * _tile_side(parameters)
    points = source.near(square, overlap_m)
    if not square.is_whole_plane:
        # A line may be longer than the part of it that the square shows; `whole_rails` drops the lines that are short.
        parameters = replace(parameters, min_length_m=min(parameters.min_length_m, overlap_m - HALO_M))
    rails, strips = _all_vertices(raster, source.class_code, points, parameters, progress)
    return trim(rails, square, strips)


def whole_rails(
    results: Iterable[SquareRails],
    frame: LocalFrame,
    parameters: Parameters,
    first_id: int = 1,
    progress: Progress = SILENT,
) -> list[RailLine]:
    """Join the rails of all squares, drop the short ones, cut turns that no rail has, simplify and number them.

    Parameters
    ----------
    results : iterable of SquareRails
        An iterator that lets go of what it yields saves a third of the memory of a long railway.
    frame : LocalFrame
        Local frame of the result.
    parameters : Parameters
    first_id : int
    progress : Progress
        Receives a warning if lines had to be cut.
    """
    rails = [rail for rail in join(results, frame) if rail.length_m >= parameters.min_length_m]
    return _finished(numbered(rails), parameters, first_id, progress)


def lines_of(
    raster: RailRaster,
    class_code: int,
    points: RailPoints | None,
    parameters: Parameters,
    progress: Progress = SILENT,
    first_id: int = 1,
) -> list[RailLine]:
    """Turn the cleaned raster of one class into rails: vectorize, smooth, move onto the heads, add heights, simplify.

    Parameters
    ----------
    raster : RailRaster
    class_code : int
    points : RailPoints or None
        Without points the rails stay where the raster shows them, and have no heights.
    parameters : Parameters
    progress : Progress
    first_id : int
        `rail_id` of the first rail.
    """
    drawn, _ = _all_vertices(raster, class_code, points, parameters, progress)
    rails = _finished(drawn, parameters, first_id, progress)
    warn_of_rails(rails, class_code, parameters, progress)
    return rails


def warn_of_rails(rails: Sequence[RailLine], class_code: int, parameters: Parameters, progress: Progress) -> None:
    """Warn the user if a class has no rails, or if `smoothing_xy_m` moves lines off their rails.

    Parameters
    ----------
    rails : sequence of RailLine
        Rails of the class.
    class_code : int
    parameters : Parameters
    progress : Progress
    """
    if not rails:
        progress.warning(f"Class {class_code} shows no rail: check the rail classes, the standard and MIN_LENGTH.")
    warn_if_out_of_reach(rails, parameters.head_width_m, parameters.smoothing_xy_m, progress)


def warn_of_steps(steps: Sequence[tuple[Centerline, Steps]], progress: Progress) -> None:
    """Warn the user of tracks that step to the side.

    Parameters
    ----------
    steps : sequence of Centerline and Steps
        From `jumps.steps_of`.
    progress : Progress
    """
    found = [(line.track_id, *step) for line, own in steps for step in own]
    if found:
        largest = sorted(found, key=lambda one: -abs(one[2]))[:MAX_LISTED]
        words = [f"{1000 * abs(step_m):.0f} mm at {at_m:.0f} m of track {track}" for track, at_m, step_m in largest]
        more = f" and {len(found) - MAX_LISTED} more" if len(found) > MAX_LISTED else ""
        progress.warning(
            f"Sideways jumps in tracks: {', '.join(words)}{more}. Real track has none; probably two passes of the "
            "scanner that are not aligned meet there."
        )


def warn_of_strips(rails: Sequence[RailLine], parameters: Parameters, progress: Progress) -> None:
    """Warn the user if strips, the passes of a scanner, differ.

    Parameters
    ----------
    rails : sequence of RailLine
    parameters : Parameters
    progress : Progress
    """
    shown = np.concatenate(
        [rail.support.every_strip[:, :2] for rail in rails if rail.support is not None] or [np.empty((0, 2))]
    )
    count, spread_m = shown[np.nan_to_num(shown[:, 1]) >= STRIP_OFF_M].T
    if STATION_STEP_M * np.sum(count > 1) >= MIN_STRIPS_APART_M:
        remedy = (
            "they are aligned to their mean, and sigma_mm states what remains in doubt"
            if parameters.strips == ALIGNED
            else "correct the positions of the scanner, or set STRIPS to ALIGNED"
        )
        progress.warning(
            f"Where strips overlap ({STATION_STEP_M * np.sum(count > 1):.0f} m of rail), they differ by up to "
            f"{_largest(spread_m[count > 1])}: {remedy}."
        )
    if STATION_STEP_M * np.sum(count == 1) >= MIN_STRIPS_APART_M:
        progress.warning(
            f"On {STATION_STEP_M * np.sum(count == 1):.0f} m of rail the heads look blurred or too wide, as if passes "
            f"of the scanner were up to {_largest(spread_m[count == 1])} apart. The points have no source id or GPS "
            "time, so the passes cannot be separated: sigma_mm and sigmaz_mm contain half of it. Export the cloud with "
            "them, or pass by pass."
        )


def _largest(spread_m: np.ndarray) -> str:
    """Write the largest of the distances between strips."""
    return f"{1000 * np.percentile(spread_m, LARGEST_PERCENT):.0f} mm"


def _all_vertices(
    raster: RailRaster, class_code: int, points: RailPoints | None, parameters: Parameters, progress: Progress
) -> tuple[tuple[RailLine, ...], np.ndarray]:
    """Turn the cleaned raster of one class into rails that have all their vertices, and list the offsets of strips.

    See `strips.rows_of`.
    """
    drawing, measuring = progress.divide((VECTORIZE + SMOOTH, REFINE + ELEVATE))
    network = draw_lines(raster, parameters, drawing)
    return measure_lines(network, points, class_code, parameters, raster.cell_m, measuring)


def draw_lines(raster: RailRaster, parameters: Parameters, progress: Progress = SILENT) -> LineNetwork:
    """Draw the smoothed lines that a cleaned raster shows."""
    vectorizing, smoothing = progress.divide((VECTORIZE, SMOOTH))
    network = vectorize(
        raster,
        parameters.head_width_m,
        parameters.max_gap_m,
        parameters.gap_angle_deg,
        parameters.min_length_m,
        vectorizing,
    )
    return smooth_network(network, parameters.smoothing_xy_m, smoothing)


def measure_lines(
    network: LineNetwork,
    points: RailPoints | None,
    class_code: int,
    parameters: Parameters,
    cell_m: float,
    progress: Progress = SILENT,
) -> tuple[tuple[RailLine, ...], np.ndarray]:
    """Move drawn lines onto their heads and measure them; see `_all_vertices`.

    Parameters
    ----------
    network : LineNetwork
        From `draw_lines`.
    points : RailPoints or None
    class_code : int
    parameters : Parameters
    cell_m : float
        Cell size of the raster from which the lines were drawn.
    progress : Progress
    """
    refining, elevating = progress.divide((REFINE, ELEVATE))
    elevation = ElevationParameters(
        head_width_m=parameters.head_width_m,
        tolerance_xy_m=parameters.tolerance_xy_m,
        tolerance_z_m=parameters.tolerance_z_m,
        crown_radius_m=parameters.crown_radius_m,
        smoothing_z_m=parameters.smoothing_z_m,
        cell_m=cell_m,
        min_length_m=parameters.min_length_m,
        align=parameters.strips == ALIGNED,
    )
    if points is None:
        return flat_rails(network, class_code, elevation), rows_of((), ())
    drawn = [flat_rail(line, class_code) for line in network.lines]
    heads = widths_by_gauge(drawn, parameters.gauges, parameters.centerline_tolerance_m)
    spacings_m = [sum(gauge) for gauge in parameters.gauges]
    network = replace(network, lines=onto_heads(network.lines, points, heads, spacings_m))
    network = refine(network, points, heads, parameters.smoothing_xy_m, refining, elevation.align, cell_m)
    strips = strips_along(network.lines, points, heads)
    return elevate(network, points, elevation, elevating, strips, heads), rows_of(network.lines, strips)


def _finished(rails: Sequence[RailLine], parameters: Parameters, first_id: int, progress: Progress) -> list[RailLine]:
    """Cut turns that no rail has, simplify rails and number them from `first_id`."""
    thinned = thin(_without_turns(rails, parameters, progress), parameters.simplify_xy_m, parameters.simplify_z_m)
    return [replace(rail, rail_id=number) for number, rail in enumerate(thinned, start=first_id)]


Line = TypeVar("Line", RailLine, Centerline)


def _without_turns(lines: Sequence[Line], parameters: Parameters, progress: Progress) -> list[Line]:
    """Split lines where they turn as no rail can, and warn the user."""
    kept: list[Line] = []
    turned: list[Line] = []
    for line in lines:
        parts = parts_without_turns(line.xyz[:, :2], parameters.min_length_m, parameters.smoothing_xy_m)
        whole = len(parts) == 1 and np.ptp(parts[0]) >= length_along(line.xyz[:, :2])[-1]
        kept += [line] if whole else [line.part(*part) for part in parts]
        turned += [] if whole else [line]
    if turned:
        what = "rail" if isinstance(turned[0], RailLine) else "centerline"
        count, was = (f"1 {what} bends", "it was") if len(turned) == 1 else (f"{len(turned)} {what}s bend", "they were")
        before_m, after_m = (sum(line.length_m for line in some) for some in (lines, kept))
        progress.warning(
            f"{count} by more than {MAX_TURN_DEG:g}° within a metre, which rails cannot; {was} split there and "
            f"{before_m - after_m:.1f} m dropped."
        )
    return kept


def tracks_of(rails: Sequence[RailLine], parameters: Parameters, progress: Progress = SILENT) -> list[Centerline]:
    """Pair the rails of each class at every gauge, and draw, simplify and number the centerlines.

    Takes the rails as the user gets them, so that rails from a file give the same tracks.

    Parameters
    ----------
    rails : sequence of RailLine
    parameters : Parameters
    progress : Progress

    Raises
    ------
    NoTrackError
        Rails run parallel, but in no class at one of the gauges. If that is true of some classes only, the user is
        warned instead.
    """
    codes = sorted({rail.class_code for rail in rails})
    centerlines: list[Centerline] = []
    errors: dict[int, NoTrackError] = {}
    for code, share in zip(codes, progress.split(len(codes))):
        try:
            centerlines += _tracks_of_class([rail for rail in rails if rail.class_code == code], parameters, share)
        except NoTrackError as error:
            errors[code] = error
    if errors and not centerlines:
        raise next(iter(errors.values()))
    for code, without_track in errors.items():
        progress.warning(f"Class {code}: {without_track}")
    return [replace(line, track_id=number) for number, line in enumerate(centerlines, start=1)]


def with_tracks(
    rails: Sequence[RailLine], centerlines: Sequence[Centerline], progress: Progress = SILENT
) -> list[RailLine]:
    """State the tracks of each rail, and leave out lone lines that are too high or too low to be rails.

    Parameters
    ----------
    rails : sequence of RailLine
    centerlines : sequence of Centerline
        All tracks of these rails.
    progress : Progress
        Receives a warning if lines are left out.

    Returns
    -------
    list of RailLine
        With their numbers as before.
    """
    kept, left_out = assign_tracks(rails, centerlines)
    if left_out:
        length_m = sum(line.length_m for line, _ in left_out)
        lines = "1 line" if len(left_out) == 1 else f"{len(left_out)} lines"
        heights = ", ".join(f"{height:+.1f} m" for height in sorted({round(above_m, 1) for _, above_m in left_out}))
        progress.warning(
            f"{lines} ({length_m:.0f} m) left out: too high or too low for a rail, compared with the tracks alongside "
            f"({heights}). Check the classification there."
        )
    return kept


def warn_of_split_classes(rails: Sequence[RailLine], parameters: Parameters, progress: Progress) -> None:
    """Warn the user if rails of different classes seem to be the rails of one track, or parts of one rail.

    Parameters
    ----------
    rails : sequence of RailLine
        With their tracks.
    parameters : Parameters
    progress : Progress
    """
    codes = {rail.rail_id: rail.class_code for rail in rails}
    if len(set(codes.values())) < 2:
        return
    lone = [replace(rail, class_code=0) for rail in rails if not rail.track_ids]
    try:
        tracks = _tracks_of_class(lone, parameters, SILENT)
    except NoTrackError:
        tracks = ()
    at_gauge = {tuple({codes[one] for one in (*track.left_ids, *track.right_ids)}) for track in tracks}
    split = sorted({code for group in at_gauge | _in_line(rails) if len(group) > 1 for code in group})
    if split:
        progress.warning(
            f"Rails of the classes {', '.join(map(str, split))} form tracks or continue each other, but classes are "
            "paired separately. If they are of the same tracks, set MERGE_CLASSES."
        )


def _in_line(rails: Sequence[RailLine]) -> set[tuple[int, ...]]:
    """Return the pairs of classes of which one has a rail that begins where a rail of the other ends."""
    ends = np.concatenate([rail.xyz[[0, -1], :2] for rail in rails])
    codes = [rail.class_code for rail in rails for _ in range(2)]
    return {(codes[a], codes[b]) for a, b in cKDTree(ends).query_pairs(SAME_RAIL_M) if codes[a] != codes[b]}


def _tracks_of_class(rails: Sequence[RailLine], parameters: Parameters, progress: Progress) -> tuple[Centerline, ...]:
    """Pair the rails of one class; see `tracks_of`."""
    settings = CenterlineParameters(
        tolerance_m=parameters.centerline_tolerance_m,
        max_gap_m=parameters.max_gap_m,
        smoothing_m=parameters.smoothing_xy_m,
        min_length_m=parameters.min_length_m,
    )
    distinct = distinct_gauges(parameters.gauges_m, parameters.centerline_tolerance_m)
    gauges = [(gauge_m, dict(parameters.gauges)[gauge_m]) for gauge_m in distinct]
    centerlines: list[Centerline] = []
    errors: list[NoTrackError] = []
    for one, step in zip(gauges, progress.split(len(gauges))):
        settings = replace(settings, other_spacings_m=tuple(sum(other) for other in gauges if other != one))
        try:
            centerlines += build_centerlines(rails, *one, settings, step)
        except NoTrackError as error:
            errors.append(error)
    if errors and not centerlines:
        raise errors[0]
    if not centerlines:
        progress.warning("No two rails run parallel: there are rails but no track centerlines.")
    whole = _without_turns(centerlines, parameters, progress)
    return thin(whole, parameters.simplify_xy_m, parameters.simplify_z_m)
