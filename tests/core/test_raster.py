"""The sparse raster: windows, cells and coordinates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.raster import TILE, RailRaster, rasterize
from scipy import ndimage

CELLS = st.lists(st.tuples(st.integers(-600, 600), st.integers(-600, 600)), min_size=1, max_size=40)


@given(CELLS)
def test_cells_survive_tiling(cells):
    raster = RailRaster({}, 0.04, 0.0, 0.0).with_cells(np.array(cells))
    assert set(map(tuple, raster.cells().tolist())) == set(cells)
    assert raster.count() == len(set(cells))


@given(CELLS, st.integers(-700, 500), st.integers(-700, 500), st.integers(1, 700), st.integers(1, 300))
def test_a_window_contains_its_cells(cells, row, column, height, width):
    window = RailRaster({}, 0.04, 0.0, 0.0).with_cells(np.array(cells)).read(row, column, height, width)
    inside = {(r - row, c - column) for r, c in cells if row <= r < row + height and column <= c < column + width}
    assert set(map(tuple, np.argwhere(window).tolist())) == inside


def test_mapping_tiles_equals_mapping_the_whole():
    rng = np.random.default_rng(1)
    cells = rng.integers(-TILE, 2 * TILE, size=(4000, 2))
    raster = RailRaster({}, 0.04, 0.0, 0.0).with_cells(cells)
    dilated = raster.map_tiles(lambda window: ndimage.binary_dilation(window, np.ones((5, 5))), margin=2)
    whole = ndimage.binary_dilation(raster.read(-2 * TILE, -2 * TILE, 5 * TILE, 5 * TILE), np.ones((5, 5)))
    assert np.array_equal(dilated.read(-2 * TILE, -2 * TILE, 5 * TILE, 5 * TILE), whole)


def test_a_stray_point_a_thousand_kilometres_away_costs_one_tile():
    raster = rasterize(np.array([[0.0, 0.0], [1e6, 1e6]]), 0.04)
    assert len(raster.tiles) == 2


@pytest.mark.parametrize("reach_m", [1.0, 1e4, 1e9])
def test_every_point_sets_its_cell_wherever_it_is(reach_m):
    xy = np.random.default_rng(3).uniform(-reach_m, reach_m, (500, 2))
    cells = rasterize(np.repeat(xy, 3, axis=0), 0.04).cells()
    expected = np.floor(np.column_stack([-xy[:, 1], xy[:, 0]]) / 0.04 + 1e-6).astype(np.int64)
    assert set(map(tuple, cells.tolist())) == set(map(tuple, expected.tolist()))


def test_many_points_are_rasterized_in_parts(monkeypatch):
    xy = np.random.RandomState(0).uniform(-20, 20, (1000, 2))
    whole = rasterize(xy, 0.04)
    monkeypatch.setattr("rail_extract.core.raster.POINTS_AT_ONCE", 300)
    parts = rasterize(xy, 0.04)
    assert whole.tiles.keys() == parts.tiles.keys()
    assert all(np.array_equal(whole.tiles[key], parts.tiles[key]) for key in whole.tiles)
    assert rasterize(xy[:0], 0.04).count() == 0
