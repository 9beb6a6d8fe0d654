import numpy as np
import pytest
from rail_extract.core.classify.bed import COARSE_M, Coarse, find_bed


def heights(xyz):
    x, y, z = xyz.T
    coarse = Coarse.around(x, y)
    offsets = coarse.offsets(x, y)
    return find_bed(coarse, *offsets, z.astype(np.float32)).heights(*offsets, z.astype(np.float32))


def cloud(rng, per_cell=50, size=6.0):
    """Points spread evenly: as many in each coarse cell."""
    cells = int(size / COARSE_M)
    corner = np.stack(np.meshgrid(np.arange(cells), np.arange(cells)), axis=-1).reshape(-1, 1, 2)
    xy = COARSE_M * (corner + rng.random_sample((cells * cells, per_cell, 2)))
    return np.column_stack([xy.reshape(-1, 2), np.zeros(cells * cells * per_cell)])


def inner(xyz):
    return ((xyz[:, :2] > COARSE_M) & (xyz[:, :2] < xyz[:, :2].max() - COARSE_M)).all(axis=1)


@pytest.mark.parametrize("slopes", [(0.0, 0.0), (0.02, 0.05), (-0.1, 0.03)])
def test_points_of_a_plane_have_height_zero(slopes):
    xyz = cloud(np.random.RandomState(1))
    xyz[:, 2] = xyz[:, :2] @ slopes + 100.037
    height, level = heights(xyz)
    assert np.abs(height[inner(xyz)]).max() < 0.004
    assert np.abs(np.median(height)) < 0.003
    assert not level.any()


def test_a_deck_is_a_level_of_its_own():
    rng = np.random.RandomState(2)
    ground, deck = cloud(rng), cloud(rng)
    ground[:, 2], deck[:, 2] = 0.02 * ground[:, 0], 0.02 * deck[:, 0] + 1.2
    height, level = heights(np.concatenate([ground, deck]))
    assert np.abs(height[np.tile(inner(ground), 2)]).max() < 0.004
    np.testing.assert_array_equal(level, np.repeat([0, 1], len(ground)))


def test_a_surface_less_than_the_clear_height_above_is_no_level():
    rng = np.random.RandomState(3)
    ground, above = cloud(rng), cloud(rng)
    above[:, 2] = 0.3
    height, level = heights(np.concatenate([ground, above]))
    assert not level.any()
    np.testing.assert_allclose(height[len(ground) :], 0.3, atol=0.004)


def test_single_low_points_do_not_move_the_bed():
    rng = np.random.RandomState(4)
    xyz = cloud(rng, per_cell=200)
    expected, _ = heights(xyz)
    xyz[::200, 2] = -0.5
    height, _ = heights(xyz)
    usual = np.ones(len(xyz), dtype=bool)
    usual[::200] = False
    assert np.abs(height - expected)[usual].max() < 0.005


def test_a_cell_that_shows_only_a_rail_takes_the_bed_of_its_neighbours():
    rng = np.random.RandomState(5)
    xyz = cloud(rng)
    hidden = (np.abs(xyz[:, :2] - 3.25) < 0.25).all(axis=1)
    xyz[hidden, 2] = 0.17
    height, _ = heights(xyz)
    np.testing.assert_allclose(height[hidden], 0.17, atol=0.02)


def test_stray_points_far_above_and_below_change_nothing():
    rng = np.random.RandomState(6)
    xyz = cloud(rng)
    stray = np.array([[1.1, 1.1, -4000.0], [2.2, 2.2, 9000.0]])
    height, _ = heights(np.concatenate([xyz, stray]))
    np.testing.assert_allclose(height[:-2], heights(xyz)[0], atol=1e-3)
    assert height[-2] == np.inf


def test_the_order_of_points_does_not_matter():
    rng = np.random.RandomState(7)
    xyz = cloud(rng)
    xyz[:, 2] += 0.02 * rng.standard_normal(len(xyz))
    order = rng.permutation(len(xyz))
    np.testing.assert_array_equal(heights(xyz)[0][order], heights(xyz[order])[0])


def test_the_slope_of_the_flattest_level_is_stated():
    rng = np.random.RandomState(3)
    ground, deck = cloud(rng), cloud(rng)[:900]
    ground[:, 2], deck[:, 2] = 0.5 * ground[:, 0], 0.1 * deck[:, 0] + 4.0
    xyz = np.concatenate([ground, deck])
    x, y, z = xyz.T
    coarse = Coarse.around(x, y)
    bed = find_bed(coarse, *coarse.offsets(x, y), z.astype(np.float32))
    slopes = bed.slopes(np.array([[2.2, 4.2], [2.2, 0.3], [50.0, 50.0]]))
    np.testing.assert_allclose(slopes, [0.5, 0.1, 0.0], atol=0.03)
