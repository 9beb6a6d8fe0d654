"""The steps of the walk, each on one square or one class: raster, network, lines, heights, tracks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..classify.thin import SURROUNDINGS_M, drawn
from ..clouds.points import RailPoints
from ..errors import ParameterError
from ..frame import LocalFrame
from ..frpdf.cleanup import MARGIN, clean, make_engine, max_passes
from ..frpdf.engine import Engine
from ..frpdf.models import choose
from ..frpdf.weights import load_arrays
from ..heads.elevation import ElevationParameters, elevate, flat_rail, flat_rails, numbered
from ..heads.head_points import judged, lengths_by_kind, near_lines
from ..heads.refinement import refine
from ..heads.roads import onto_heads
from ..heads.strips import measure_strips, rows_of
from ..heads.unmarked import told_apart
from ..lines.ends import FIT_M
from ..lines.finishing import finished
from ..lines.network import LineNetwork
from ..lines.smoothing import smooth_network
from ..parameters import ALIGNED, Parameters
from ..progress import SILENT, Progress, counted
from ..rails import RailLine
from ..raster import TILE, RailRaster, cell_size, rasterize
from ..tiles.grid import HALO_M, OVERLAP_M, Key, PointSource, Square, around
from ..tracks.parallels import widths_by_gauge
from ..vectorize import vectorize
from .seams import SquareRails, join, trim

FAR_SHARE = 0.1
"""Points per metre of a far rail, at most, by those of the densest rail: they fall with the square of the distance from
a scanner on the track, so that this rail is three times as far away."""


def square_side(parameters: Parameters) -> float:
    """Return the side of the squares in metres; `ParameterError` if they overlap with more than their neighbours."""
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

    The network also sees cells that are drawn along thin rails (docs/method.md section 2.3).
    """
    cell_m = cell_size(parameters.gauge_m, parameters.head_width_m)
    margin_m = max_passes(parameters.passes) * MARGIN * cell_m
    seen = _seen(source.near(square, margin_m + SURROUNDINGS_M).xyz, parameters, cell_m)
    raster = rasterize(seen[square.holds(seen, margin_m)], cell_m)
    return own_tiles(clean(raster, engine, parameters.passes, progress), square)


def _seen(points: np.ndarray, parameters: Parameters, cell_m: float) -> np.ndarray:
    """Return what the network sees, (n, 2) local metres: points, (m, 3), and places along thin rails."""
    return np.concatenate([points[:, :2], drawn(points, parameters.spacings_m, cell_m)])


def rails_of_square(
    source: PointSource,
    square: Square,
    rasters: Mapping[Key, RailRaster],
    parameters: Parameters,
    progress: Progress = SILENT,
) -> SquareRails:
    """Draw the rails of a square, given its cleaned raster and those of the neighbours that have one."""
    tiles = overlap_tiles(parameters)
    raster = mosaic(rasters, square, tiles)
    overlap_m = tiles * _tile_side(parameters)
    points = source.near(square, overlap_m)
    if not square.is_whole_plane:
        # A line may be longer than the part of it that the square shows; `whole_rails` drops the lines that are short.
        parameters = replace(parameters, min_length_m=min(parameters.min_length_m, overlap_m - HALO_M))
    rails, strips, blunt = _all_vertices(raster, source.class_code, points, parameters, progress)
    found = replace(trim(rails, square, strips), blunt=blunt)
    if points.strips is None or points.found or points.blunt is not None:
        return found
    return replace(found, kinds=_kinds(source, square, np.unique(points.strips), rails, parameters))


def _kinds(
    source: PointSource, square: Square, strips: np.ndarray, rails: Sequence[RailLine], parameters: Parameters
) -> np.ndarray:
    """Return how long heads look sharp and blunt in each strip of a square; see `SquareRails`."""
    lines, rows = [rail.xyz[:, :2] for rail in rails], []
    for strip in strips.tolist() if lines else []:
        own = replace(source.of_strips([strip]).near(square, 0.0), blunt=False)
        rows.append([strip, *lengths_by_kind(near_lines(lines, own, parameters.head_width_m))])
    return np.array(rows).reshape(-1, 3)


def whole_rails(
    results: Iterable[SquareRails],
    frame: LocalFrame,
    parameters: Parameters,
    first_id: int = 1,
    progress: Progress = SILENT,
    least_points: int = 0,
) -> list[RailLine]:
    """Join the rails of all squares, drop the short ones, cut turns too sharp for a rail, simplify and number them.

    Rails whose place no points show are left out, and far ones with fewer than `least_points` on their heads. Results
    that are let go of once they were yielded save a third of the memory of a long railway.
    """
    rails = [rail for rail in join(results, frame) if rail.length_m >= parameters.min_length_m]
    rails = _chosen(
        rails,
        [_is_placed(rail, parameters.head_width_m) for rail in rails],
        "no points show where across their heads are. Classify more points of these rails if you need them.",
        progress,
    )
    rails = _chosen(
        rails,
        _are_shown(rails, least_points),
        f"far from the scanner, fewer than {least_points} points do not show a railhead. Classify these rails if you "
        "need them.",
        progress,
    )
    return _numbered(numbered(rails), parameters, first_id, progress)


def _chosen(rails: Sequence[RailLine], kept: Sequence[bool], why: str, progress: Progress) -> list[RailLine]:
    """Choose rails, and warn why the others are left out."""
    others_m = [rail.length_m for rail, is_kept in zip(rails, kept) if not is_kept]
    if others_m:
        progress.warning(f"{counted(len(others_m), 'line')} ({sum(others_m):,.0f} m) left out: {why}")
    return [rail for rail, is_kept in zip(rails, kept) if is_kept]


def _is_placed(rail: RailLine, head_width_m: float) -> bool:
    """Return whether a line is known to lie on its head anywhere; one that was not measured may lie anywhere."""
    return rail.support is None or float(rail.support.sigma_m.min()) <= head_width_m


def _are_shown(rails: Sequence[RailLine], least_points: int) -> list[bool]:
    """Return which rails do not lack points because they are far away; from the air, all are as far."""
    densities = [rail.points / rail.length_m for rail in rails if rail.points >= least_points]
    far = FAR_SHARE * max(densities, default=0.0)
    return [rail.points >= min(least_points, far * rail.length_m) for rail in rails]


def lines_of(
    raster: RailRaster,
    class_code: int,
    points: RailPoints | None,
    parameters: Parameters,
    progress: Progress = SILENT,
    first_id: int = 1,
) -> list[RailLine]:
    """Turn the cleaned raster of one class into rails: vectorize, smooth, move onto the heads, add heights, simplify.

    Without points the rails stay where the raster shows them, and have no heights.
    """
    drawn, _, _ = _all_vertices(raster, class_code, points, parameters, progress)
    return _numbered(drawn, parameters, first_id, progress)


def _all_vertices(
    raster: RailRaster, class_code: int, points: RailPoints | None, parameters: Parameters, progress: Progress
) -> tuple[tuple[RailLine, ...], np.ndarray, bool | None]:
    """Turn the cleaned raster of one class into rails that have all their vertices.

    Also returns the offsets of strips, see `strips.rows_of`, and whether heads are blunt, see `RailPoints`.
    """
    drawing, measuring = progress.split(2)
    network = draw_lines(raster, parameters, drawing)
    if points is not None:
        points = judged(points, network.lines, parameters.head_width_m)
    return measure_lines(network, points, class_code, parameters, raster.cell_m, measuring)


def draw_lines(raster: RailRaster, parameters: Parameters, progress: Progress = SILENT) -> LineNetwork:
    """Draw the smoothed lines that a cleaned raster shows."""
    network = vectorize(
        raster,
        parameters.head_width_m,
        parameters.max_gap_m,
        parameters.gap_angle_deg,
        parameters.min_length_m,
        progress,
        parameters.spacings_m,
    )
    return smooth_network(network, parameters.smoothing_xy_m, progress.span(1.0, 1.0))


def measure_lines(
    network: LineNetwork,
    points: RailPoints | None,
    class_code: int,
    parameters: Parameters,
    cell_m: float,
    progress: Progress = SILENT,
) -> tuple[tuple[RailLine, ...], np.ndarray, bool | None]:
    """Move the lines of `draw_lines` onto their heads and measure them; see `_all_vertices`."""
    refining, elevating = progress.split(2)
    elevation = ElevationParameters(
        tolerance_xy_m=parameters.tolerance_xy_m,
        tolerance_z_m=parameters.tolerance_z_m,
        crown_radius_m=parameters.crown_radius_m,
        smoothing_z_m=parameters.smoothing_z_m,
        cell_m=cell_m,
        min_length_m=parameters.min_length_m,
        align=parameters.strips == ALIGNED,
    )
    if points is None:
        return flat_rails(network, class_code, elevation), rows_of((), ()), None
    drawn = [flat_rail(line, class_code) for line in network.lines]
    heads = widths_by_gauge(drawn, parameters.gauges, parameters.centerline_tolerance_m)
    network = replace(network, lines=onto_heads(network.lines, points, heads, parameters.spacings_m))
    settings = parameters.smoothing_xy_m, refining, elevation.align, cell_m
    if points.blunt:  # or so they look: two sharp passes that are apart make a ridge together
        points = told_apart(points, network.lines, heads)
    network = refine(network, points, heads, *settings)
    told = told_apart(points, network.lines, heads)
    if told is not points:
        points, network = told, refine(network, told, heads, *settings)
    near = near_lines(network.lines, points, heads, elevating.span(0.0, 0.6))
    strips = [measure_strips(head) for head in near]
    rails = elevate(network, near, class_code, elevation, elevating.span(0.6, 1.0), strips)
    return rails, rows_of(network.lines, strips), points.blunt


def _numbered(rails: Sequence[RailLine], parameters: Parameters, first_id: int, progress: Progress) -> list[RailLine]:
    """Finish rails and number them from `first_id`."""
    whole = finished(rails, parameters, progress)
    return [replace(rail, rail_id=number) for number, rail in enumerate(whole, start=first_id)]


def own_tiles(raster: RailRaster, square: Square) -> RailRaster:
    """Keep the tiles of a raster that are in the square."""
    if square.is_whole_plane:
        return raster
    count = tiles_along(square.side_m, raster.cell_m)
    inside = {
        (row, column): tile for (row, column), tile in raster.tiles.items() if -count <= row < 0 and 0 <= column < count
    }
    return replace(raster, tiles=inside)


def mosaic(rasters: Mapping[Key, RailRaster], square: Square, margin: int) -> RailRaster:
    """Combine the raster of a square with `margin` tiles of its neighbours' around it.

    Each raster has its origin at the corner of its own square; that of a neighbour may be missing.
    """
    own = rasters[square.key]
    if square.is_whole_plane:
        return own
    count, tiles = tiles_along(square.side_m, own.cell_m), {}
    for key in around(square.key):
        down, right = -count * (key[1] - square.key[1]), count * (key[0] - square.key[0])
        for (row, column), tile in rasters[key].tiles.items() if key in rasters else ():
            place = (row + down, column + right)
            if -count - margin <= place[0] < margin and -margin <= place[1] < count + margin:
                tiles[place] = tile
    return replace(own, tiles=tiles)


def assembled(rasters: Mapping[Key, RailRaster], squares: Mapping[Key, Square], frame: LocalFrame) -> RailRaster:
    """Combine the rasters of all squares into one in a local frame."""
    first = min(rasters)
    if squares[first].is_whole_plane:
        return rasters[first]
    count = tiles_along(squares[first].side_m, rasters[first].cell_m)
    x0, y0, _ = squares[first].frame.shift_to(frame)
    tiles = {
        (row - count * (key[1] - first[1]), column + count * (key[0] - first[0])): tile
        for key, raster in rasters.items()
        for (row, column), tile in raster.tiles.items()
    }
    return replace(rasters[first], tiles=tiles, x0=float(x0), y0=float(y0))


def merged(one: RailRaster, other: RailRaster) -> RailRaster:
    """Combine two rasters of one frame whose grids differ by whole tiles."""
    tiles, side_m = dict(one.tiles), TILE * one.cell_m
    down, right = round((one.y0 - other.y0) / side_m), round((other.x0 - one.x0) / side_m)
    for (row, column), tile in other.tiles.items():
        key = (row + down, column + right)
        tiles[key] = tiles[key] | tile if key in tiles else tile
    return replace(one, tiles=tiles)


def tiles_along(side_m: float, cell_m: float) -> int:
    """Return the number of raster tiles along the side of a square."""
    return round(side_m / (TILE * cell_m))
