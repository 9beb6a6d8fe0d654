"""The steps of the walk on squares: what the network sees beyond a border."""

from dataclasses import replace

import numpy as np
import pytest
from built import IN_FEET, rails_of, slanted_cloud, source_of
from rail_extract.core.frpdf.cleanup import clean
from rail_extract.core.parameters import Parameters
from rail_extract.core.progress import SILENT, Recording
from rail_extract.core.rails import Support
from rail_extract.core.raster import TILE, cell_size, rasterize
from rail_extract.core.squares.seams import trim
from rail_extract.core.squares.steps import (
    assembled,
    clean_square,
    engine_for,
    merged,
    mosaic,
    own_tiles,
    square_side,
    whole_rails,
)
from rail_extract.core.standards import STANDARDS
from rail_extract.core.tiles.grid import Filling, MemorySource, Square, lay_out, parted

STANDARD = STANDARDS["EN_60E1_1435"]
CELL = 0.04
SIDE = 4 * TILE * CELL


@pytest.mark.parametrize("passes", [1, 2])
def test_a_gap_at_a_border_is_bridged_as_in_an_undivided_raster(passes):
    """A gap of 2 m, one half in either of two squares, cleaned by the network itself."""
    parameters = Parameters(STANDARD.gauge_m, STANDARD.head_width_m, passes, engine="OPENCV", square_tiles=4)
    side_m, random = square_side(parameters), np.random.RandomState(1)
    x = side_m + np.concatenate([random.uniform(-25, -1, 8000), random.uniform(1, 25, 8000)])
    left = random.random_sample(len(x)) < 0.5
    y = 10.0 + left * (STANDARD.gauge_m + STANDARD.head_width_m) + random.uniform(-0.03, 0.03, len(x))
    source = source_of(np.column_stack([x, y, np.zeros(len(x))]), side_m=side_m)
    first, second = lay_out([source], source)
    cell_m, engine = cell_size(parameters.gauge_m, parameters.head_width_m), engine_for(parameters)
    half = round(1.0 / cell_m)  # cells of half a gap
    for square, start in ((first, 4 * TILE - half), (second, 0)):
        found = clean_square(source, square, parameters, engine)
        all_points = source.near(square, side_m).xyz
        expected = own_tiles(clean(rasterize(all_points, cell_m), engine, passes), square)
        cells, whole = (set(map(tuple, raster.cells().tolist())) for raster in (found, expected))
        bridged = {column for _, column in cells if start <= column < start + half}
        assert len(bridged) == half
        assert len(cells ^ whole) < 0.02 * len(
            whole
        )  # 0.0153 with the margin of 64 cells; without one, the gap stays open


def test_rasters_of_squares_make_the_raster_of_the_whole():
    points = slanted_cloud()
    source = MemorySource(points, SIDE)
    squares = {square.key: square for square in lay_out([source], source)}
    rasters = {key: own_tiles(rasterize(source.near(square, 1.0).xyz, CELL), square) for key, square in squares.items()}
    whole = assembled(rasters, squares, IN_FEET)
    places = np.sort(whole.to_local(whole.cells()), axis=0)
    zero = Square.on_grid((0, 0), SIDE, IN_FEET)
    direct = rasterize(points.xyz - zero.frame.shift_to(IN_FEET), CELL)
    expected = np.sort(direct.to_local(direct.cells()) + zero.frame.shift_to(IN_FEET)[:2], axis=0)
    np.testing.assert_allclose(places, expected, rtol=0, atol=1e-6)


def test_a_mosaic_contains_the_tiles_of_the_neighbours():
    points = slanted_cloud()
    source = MemorySource(points, SIDE)
    squares = {square.key: square for square in lay_out([source], source)}
    rasters = {key: own_tiles(rasterize(source.near(one, 0.0).xyz, CELL), one) for key, one in squares.items()}
    key = sorted(squares)[2]
    seen = mosaic(rasters, squares[key], 4)
    expected = rasterize(source.near(squares[key], SIDE - 1e-6).xyz, CELL)
    assert set(seen.tiles) == set(expected.tiles)
    assert all((seen.tiles[place] == expected.tiles[place]).all() for place in seen.tiles)


def test_rasters_of_both_parts_of_a_class_are_one():
    points = replace(slanted_cloud(), strips=np.repeat([1, 2], 2000))
    zero = Square.on_grid((0, 0), SIDE, IN_FEET).frame.shift_to(IN_FEET)
    rasters = []
    for source in parted(MemorySource(points, SIDE), [2]):
        assert isinstance(source, (MemorySource, Filling))
        squares = {square.key: square for square in lay_out([source], source)}
        own = {key: own_tiles(rasterize(source.near(one, 0.0).xyz, CELL), one) for key, one in squares.items()}
        rasters.append(assembled(own, squares, IN_FEET))
    whole = rasterize(points.xyz - zero, CELL)
    places = np.sort(merged(*rasters).to_local(merged(*rasters).cells()), axis=0)
    np.testing.assert_allclose(places, np.sort(whole.to_local(whole.cells()) + zero[:2], axis=0), atol=1e-6)


def test_lines_whose_place_no_points_show_are_left_out():
    """In worlds 10876 and 11062, far lines with a standard error of 0.3 m were up to 12 cm off their heads."""
    parameters = Parameters(STANDARD.gauge_m, STANDARD.head_width_m)
    lines = [np.array([[0.0, y], [30.0, y]]) for y in (0.0, 5.0, 10.0)]
    rails, errors_m = rails_of(*lines), ([0.3, 0.3], [0.3, 0.002], [0.002, 0.002])
    supports = [
        Support.of_one_strip(np.array([0.0, 30.0]), np.array([0, 100]), np.array(error_m)) for error_m in errors_m
    ]
    rails = [replace(rail, support=support) for rail, support in zip(rails, supports)]
    progress = Recording(SILENT)
    found = whole_rails([trim(rails, Square((0, 0), IN_FEET, np.inf))], IN_FEET, parameters, progress=progress)
    assert len(found) == 2
    assert [warning.startswith("1 line (30 m) left out: no points show") for warning in progress.warnings] == [True]


@pytest.mark.parametrize(("points", "kept"), [((249, 250, 3000), (250, 3000)), ((249, 250, 900), (249, 250, 900))])
def test_far_lines_with_too_few_points_to_show_a_head_are_left_out(points, kept):
    """A tenth of the density of the others is far; from the air, rails of all lengths have the same."""
    parameters = Parameters(STANDARD.gauge_m, STANDARD.head_width_m)
    lines = (np.array([[0.0, y], [30.0, y]]) for y in (0.0, 5.0, 10.0))
    rails = [replace(rail, points=count) for rail, count in zip(rails_of(*lines), points)]
    parts, progress = [trim(rails, Square((0, 0), IN_FEET, np.inf))], Recording(SILENT)
    found = whole_rails(parts, IN_FEET, parameters, progress=progress, least_points=250)
    assert tuple(rail.points for rail in found) == kept
    assert len(progress.warnings) == len(points) - len(kept)
    assert len(whole_rails(parts, IN_FEET, parameters)) == len(points)
