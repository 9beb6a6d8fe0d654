import numpy as np
import pytest
from rail_extract.core.classify.settings import BURIED, HEADS
from rail_extract.core.classify.tops import EMPTY, Grid, highest_of_blocks, middles_of_tops, narrow_tops, tops_of
from rail_extract.core.raster import rasterize
from rail_extract.laboratory.scenes.raw_shapes import flat, turned, with_bar

WIDTH, CELL = 0.072, 0.04


def tops(xyz):
    grid, cell = Grid.around(xyz[:, 0], xyz[:, 1], CELL)
    low = xyz[:, 2] < 0.95
    return tops_of(grid, cell[low], *2 * (xyz[low, 2].astype(np.float32),)), cell


def inner(xyz):
    return (np.abs(xyz[:, :2] - xyz[:, :2].mean(axis=0)) < np.ptp(xyz[:, 0]) / 2 - 0.3).all(axis=1)


def test_cells_are_those_of_the_raster():
    xyz = flat(2.0, 0.037)
    found, cell = tops(xyz)
    middles = found.grid.middles(np.unique(cell))
    raster = rasterize(xyz, CELL)
    expected = raster.to_local(raster.cells())
    np.testing.assert_allclose(np.unique(middles.round(6), axis=0), np.unique(expected.round(6), axis=0))


def test_a_top_is_the_highest_point_below_the_band_and_higher_ones_mark_the_cell():
    xyz = np.array([[0.01, 0.01, z] for z in (0.2, 0.1, 0.7, 0.31)] + [[0.5, 0.5, 0.05]])
    found, cell = tops(xyz)
    assert found.top.ravel()[cell].tolist() == [310, 310, 310, 310, 50]
    assert np.count_nonzero(found.high) == 1
    assert np.count_nonzero(found.seen) == 2
    assert np.count_nonzero(found.top != EMPTY) == 2


@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi / 4])
def test_a_bar_of_a_railhead_is_found_with_all_its_cells(angle):
    xyz, on = with_bar(flat(), WIDTH, angle)
    found, cell = tops(xyz)
    candidates = set(narrow_tops(found, HEADS).tolist())
    here = inner(xyz)
    assert set(cell[on & here].tolist()) == candidates & set(cell[here].tolist())


@pytest.mark.parametrize("angle", [0.0, np.pi / 4])
def test_a_wide_bar_a_kerb_and_a_wall_are_not_candidates(angle):
    ground = flat()
    wide, _ = with_bar(ground, 0.5, angle)
    kerb, _ = with_bar(ground, 10.0, angle, left_m=5.0)
    wall = ground[turned(ground, angle)[1] > 0.0]
    walls = np.concatenate([wall, np.column_stack([wall[:, :2], np.full(len(wall), 0.0)])])
    near = np.abs(turned(walls, angle)[1]) < 0.01
    walls[near, 2] = np.random.RandomState(1).uniform(0, 2.0, near.sum())
    for xyz in (wide, kerb, walls):
        assert not len(narrow_tops(tops(xyz)[0], HEADS))


def test_a_bar_in_a_thin_cloud_is_found():
    rng = np.random.RandomState(2)
    hits = seen = 0
    for _ in range(20):
        xyz, on = with_bar(flat(6.0, rng=rng, per_m2=30), WIDTH, 0.3)
        found, cell = tops(xyz)
        on &= inner(xyz)
        candidates = narrow_tops(found, HEADS)
        hits += np.isin(cell[on], candidates).sum()
        seen += on.sum()
    assert seen > 100
    assert hits / seen >= 0.99


@pytest.mark.parametrize(("band", "finds"), [(HEADS, False), (BURIED, True)])
def test_a_rail_that_is_buried_up_to_the_head_is_found_on_a_smooth_surface(band, finds):
    xyz, on = with_bar(flat(), WIDTH)
    xyz[:, 2] = np.where(on, 0.065, 0.035)
    found, cell = tops(xyz)
    assert np.isin(cell[on & inner(xyz)], narrow_tops(found, band)).mean() == (1.0 if finds else 0.0)


def test_blocks_keep_their_highest_cell():
    xyz = np.array([[0.01, -0.01, 0.1], [0.05, -0.01, 0.2], [0.01, -0.05, 0.15], [0.09, -0.01, 0.1]])
    found, cell = tops(xyz)
    kept = highest_of_blocks(found, np.unique(cell))
    np.testing.assert_array_equal(kept, np.sort(cell[[1, 3]]))


def test_the_middle_of_a_top_leaves_out_lower_points_and_other_cells():
    xyz = np.array([[0.025, 0.01, 0.2], [0.035, 0.02, 0.17], [0.005, 0.03, 0.1], [0.06, 0.02, 0.2], [0.5, 0.5, 0.05]])
    found, cell = tops(xyz)
    places = middles_of_tops(found, HEADS, cell[:1], xyz[:, :2], cell, xyz[:, 2].astype(np.float32))
    np.testing.assert_allclose(places[cell[0]], [0.03, 0.015], atol=1e-4)
    assert np.isnan(places[cell[3]]).all()
