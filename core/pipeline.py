"""The whole walk: classified points to 3D rails and track centerlines, in the order of the paper's abstract."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from .clouds.points import RailPoints
from .errors import NoRailPointsError, NoTrackError, ParameterError
from .frame import LocalFrame
from .frpdf.cleanup import MARGIN, clean, max_passes
from .frpdf.engine import Engine, make_engine
from .frpdf.models import choose
from .frpdf.weights import load_arrays
from .heads.elevation import ElevationParameters, elevate, flat_rails, numbered
from .heads.refinement import refine
from .heads.smoothing_check import warn_if_out_of_reach
from .lines.bridges import FIT_M
from .lines.network_smoothing import smooth_network
from .lines.thinning import thin
from .parameters import Parameters
from .progress import SILENT, Progress
from .rails import Centerline, RailLine, RailNetwork, TrackGeometry
from .raster import TILE, RailRaster, cell_size, rasterize
from .squares.grid import (
    HALO_M,
    OVERLAP_M,
    Key,
    MemorySource,
    PointSource,
    Square,
    assembled,
    in_turn,
    lay_out,
    mosaic,
    own_tiles,
)
from .squares.pieces import SquareRails, trim
from .squares.remeasuring import measure_in_squares
from .squares.seams import join
from .standards import distinct_gauges
from .tracks.centerlines import CenterlineParameters, build_centerlines
from .tracks.geometry import measure_track_geometry
from .vectorize import vectorize

NETWORK_SHARE = 0.7
"""Part of a stretch's time that the network takes, for the progress."""


def extract_rails(
    points: Sequence[RailPoints | PointSource], parameters: Parameters, progress: Progress = SILENT
) -> RailNetwork:
    """Extract rails and centerlines from classified points.

    Each class is processed on its own, and its lines carry its code; ids count through all classes. What is longer than
    a stretch is worked on by stretches, so that points are needed in memory for one of them at a time.

    Parameters
    ----------
    points : sequence of RailPoints or PointSource
        From `points.read_rail_points` or `spool.spool`: one for each class, in one frame.
    parameters : Parameters
    progress : Progress

    Returns
    -------
    RailNetwork

    Raises
    ------
    NoRailPointsError
        There is no cloud.
    ModelError
        No weights fit the standard, or the engine is not there.
    NoTrackError
        Rails run parallel, but those of no class at a gauge that was given.
    Cancelled
        The user cancelled.
    """
    if not points:
        raise NoRailPointsError("There is no point to extract rails from.")
    engine = engine_for(parameters)
    side_m = square_side(parameters)
    sources = [MemorySource(cloud, side_m) if isinstance(cloud, RailPoints) else cloud for cloud in points]
    rails: list[RailLine] = []
    cleaned: list[RailRaster] = []
    for source, step in zip(sources, progress.span(0.0, 0.9).split(len(sources))):
        results, rasters = _walk(source, lay_out(sources, source), parameters, engine, step)
        found = whole_rails(results, source.frame, parameters, first_id=len(rails) + 1)
        warn_of_rails(found, source.class_code, parameters, progress)
        rails += found
        cleaned += rasters
    centerlines = tracks_of(rails, parameters, progress.span(0.9, 0.95))
    geometry: list[TrackGeometry] = []
    for source, step in zip(sources, progress.span(0.95, 1.0).split(len(sources))):
        stretches = lay_out(sources, source)
        mine = ([line for line in lines if line.class_code == source.class_code] for lines in (centerlines, rails))
        geometry += geometry_of(*mine, source, stretches, parameters, step)
    return RailNetwork(
        tuple(rails), tuple(centerlines), sources[0].frame, engine.description, tuple(geometry), tuple(cleaned)
    )


def square_side(parameters: Parameters) -> float:
    """Side of the stretches in metres.

    Raises
    ------
    ParameterError
        They would overlap with more than their neighbours.
    """
    tile_m = _tile_side(parameters)
    least = math.ceil(OVERLAP_M / tile_m)
    if parameters.square_tiles < least:
        raise ParameterError(f"Stretches of {parameters.square_tiles} tiles are too small: give {least} at least.")
    return parameters.square_tiles * tile_m


def overlap_tiles(parameters: Parameters) -> int:
    """Tiles around a stretch that its lines are drawn from as well.

    Both sides of a border must see the same of it: twice a gap with what its bridge is fitted to on either side, and
    three sigma of the smoothing in height. No more than the neighbours, however long the gaps.
    """
    reach_m = HALO_M + max(2 * (parameters.max_gap_m + 2 * FIT_M), 3 * parameters.smoothing_z_m)
    return min(math.ceil(max(reach_m, OVERLAP_M) / _tile_side(parameters)), parameters.square_tiles)


def _tile_side(parameters: Parameters) -> float:
    """Side of a raster tile in metres."""
    return TILE * cell_size(parameters.gauge_m, parameters.head_width_m)


def engine_for(parameters: Parameters) -> Engine:
    """Set up what runs the network that fits the gauge and the railhead."""
    arrays = load_arrays(choose(parameters.gauge_m, parameters.head_width_m).path)
    return make_engine(arrays, parameters.engine, parameters.device)


def _walk(
    source: PointSource, stretches: Sequence[Square], parameters: Parameters, engine: Engine, progress: Progress
) -> tuple[list[SquareRails], list[RailRaster]]:
    """Clean all stretches of one class, and draw the lines of each as soon as its neighbours are clean as well."""
    by_key = {stretch.key: stretch for stretch in stretches}
    total = sum(source.counts.values())
    rasters: dict[Key, RailRaster] = {}
    results: list[SquareRails] = []
    done = 0.0
    for key, ready, spent in in_turn(by_key):
        weight = source.counts[key] / total if len(by_key) > 1 else 1.0
        rasters[key] = clean_square(
            source, by_key[key], parameters, engine, progress.span(done, done + NETWORK_SHARE * weight)
        )
        done += NETWORK_SHARE * weight
        for one in ready:
            weight = source.counts[one] / total if len(by_key) > 1 else 1.0
            step = progress.span(done, done + (1 - NETWORK_SHARE) * weight)
            results.append(rails_of_square(source, by_key[one], rasters, parameters, step))
            done += (1 - NETWORK_SHARE) * weight
        for one in () if parameters.keep_cleaned else spent:
            del rasters[one]
    return results, [assembled(rasters, by_key, source.frame)] if parameters.keep_cleaned else []


def clean_square(
    source: PointSource, stretch: Square, parameters: Parameters, engine: Engine, progress: Progress = SILENT
) -> RailRaster:
    """Rasterize the points of a stretch, have the network clean the raster, and keep what lies inside."""
    cell_m = cell_size(parameters.gauge_m, parameters.head_width_m)
    points = source.near(stretch, max_passes(parameters.passes) * MARGIN * cell_m)
    return own_tiles(clean(rasterize(points.xyz, cell_m), engine, parameters.passes, progress), stretch)


def rails_of_square(
    source: PointSource,
    stretch: Square,
    rasters: Mapping[Key, RailRaster],
    parameters: Parameters,
    progress: Progress = SILENT,
) -> SquareRails:
    """Draw the rails of a stretch, given its own cleaned raster and those of its neighbours."""
    tiles = overlap_tiles(parameters)
    raster = mosaic(rasters, stretch, tiles)
    overlap_m = tiles * _tile_side(parameters)
    points = source.near(stretch, overlap_m)
    if math.isfinite(stretch.side_m):
        # A line that the stretch sees in part is longer than what it sees; `whole_rails` drops those that are short.
        parameters = replace(parameters, min_length_m=min(parameters.min_length_m, overlap_m - HALO_M))
    return trim(_all_vertices(raster, source.class_code, points, parameters, progress), stretch)


def whole_rails(
    results: Sequence[SquareRails], frame: LocalFrame, parameters: Parameters, first_id: int = 1
) -> list[RailLine]:
    """Join the rails of all stretches, drop the short ones, thin and number them."""
    rails = [rail for rail in join(results, frame) if rail.length_m >= parameters.min_length_m]
    return _finished(numbered(rails), parameters, first_id)


def lines_of(
    raster: RailRaster,
    class_code: int,
    points: RailPoints | None,
    parameters: Parameters,
    progress: Progress = SILENT,
    first_id: int = 1,
) -> list[RailLine]:
    """Turn the cleaned raster of one class into rails: vectorize, smooth, move onto the heads, give height, thin.

    Without points the rails stay where the raster shows them, and have no heights.
    """
    rails = _finished(_all_vertices(raster, class_code, points, parameters, progress), parameters, first_id)
    warn_of_rails(rails, class_code, parameters, progress)
    return rails


def warn_of_rails(rails: Sequence[RailLine], class_code: int, parameters: Parameters, progress: Progress) -> None:
    """Tell the user where a class came to nothing, or lines hardly follow their rails."""
    if not rails:
        progress.warning(f"Class {class_code} shows no rail: check the rail classes, the standard and MIN_LENGTH.")
    warn_if_out_of_reach(rails, parameters.head_width_m, parameters.smoothing_xy_m, progress)


def _all_vertices(
    raster: RailRaster, class_code: int, points: RailPoints | None, parameters: Parameters, progress: Progress
) -> tuple[RailLine, ...]:
    """Turn the cleaned raster of one class into rails that have all their vertices."""
    network = vectorize(
        raster,
        parameters.head_width_m,
        parameters.max_gap_m,
        parameters.gap_angle_deg,
        parameters.min_length_m,
        progress.span(0.0, 0.45),
        None if points is None else rasterize(points.xyz, raster.cell_m),
    )
    network = smooth_network(network, parameters.smoothing_xy_m, progress.span(0.45, 0.5))
    elevation = ElevationParameters(
        head_width_m=parameters.head_width_m,
        tolerance_xy_m=parameters.tolerance_xy_m,
        tolerance_z_m=parameters.tolerance_z_m,
        crown_radius_m=parameters.crown_radius_m,
        smoothing_xy_m=parameters.smoothing_xy_m,
        smoothing_z_m=parameters.smoothing_z_m,
        cell_m=raster.cell_m,
        min_length_m=parameters.min_length_m,
    )
    if points is None:
        return flat_rails(network, class_code, elevation)
    network = refine(network, points, parameters.head_width_m, parameters.smoothing_xy_m, progress.span(0.5, 0.75))
    return elevate(network, points, elevation, progress.span(0.75, 1.0))


def _finished(rails: Sequence[RailLine], parameters: Parameters, first_id: int) -> list[RailLine]:
    """Thin rails and number them on."""
    thinned = thin(rails, parameters.simplify_xy_m, parameters.simplify_z_m)
    return [replace(rail, rail_id=number) for number, rail in enumerate(thinned, start=first_id)]


def tracks_of(rails: Sequence[RailLine], parameters: Parameters, progress: Progress = SILENT) -> list[Centerline]:
    """Pair the rails of each class by every gauge, draw the centerlines, thin and number them.

    The rails come as users get them, so that rails from a file give the same tracks.

    Raises
    ------
    NoTrackError
        Rails run parallel, but those of no class at a gauge that was given; of one class among others, the user is
        warned.
    """
    codes = sorted({rail.class_code for rail in rails})
    centerlines: list[Centerline] = []
    refusals: dict[int, NoTrackError] = {}
    for code, share in zip(codes, progress.split(len(codes))):
        try:
            centerlines += _tracks_of_class([rail for rail in rails if rail.class_code == code], parameters, share)
        except NoTrackError as refusal:
            refusals[code] = refusal
    if refusals and not centerlines:
        raise next(iter(refusals.values()))
    for code, refusal in refusals.items():
        progress.warning(f"Class {code}: {refusal}")
    return [replace(line, track_id=number) for number, line in enumerate(centerlines, start=1)]


def _tracks_of_class(rails: Sequence[RailLine], parameters: Parameters, progress: Progress) -> tuple[Centerline, ...]:
    """Do so for the rails of one class."""
    settings = CenterlineParameters(
        tolerance_m=parameters.centerline_tolerance_m,
        max_gap_m=parameters.max_gap_m,
        smoothing_m=parameters.smoothing_xy_m,
        min_length_m=parameters.min_length_m,
    )
    gauges = distinct_gauges((parameters.gauge_m, *parameters.other_gauges_m), parameters.centerline_tolerance_m)
    centerlines: list[Centerline] = []
    refusals: list[NoTrackError] = []
    for gauge_m, step in zip(gauges, progress.split(len(gauges))):
        settings = replace(settings, other_gauges_m=tuple(other for other in gauges if other != gauge_m))
        try:
            centerlines += build_centerlines(rails, gauge_m, parameters.head_width_m, settings, step)
        except NoTrackError as refusal:
            refusals.append(refusal)
    if refusals and not centerlines:
        raise refusals[0]
    if not centerlines:
        progress.warning("No two rails run parallel: there are rails but no track centerlines.")
    return thin(centerlines, parameters.simplify_xy_m, parameters.simplify_z_m)


def geometry_of(
    centerlines: Sequence[Centerline],
    rails: Sequence[RailLine],
    source: PointSource,
    stretches: Sequence[Square],
    parameters: Parameters,
    progress: Progress = SILENT,
) -> tuple[TrackGeometry, ...]:
    """Measure the tracks of one class, if asked for."""
    if parameters.quality_step_m is None:
        return ()
    measured = measure_in_squares(rails, source, stretches, parameters.head_width_m, progress.span(0.0, 0.8))
    return measure_track_geometry(
        centerlines, measured, parameters.head_width_m, parameters.quality_step_m, progress.span(0.8, 1.0)
    )
