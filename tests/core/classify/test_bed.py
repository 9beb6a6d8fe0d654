import numpy as np
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


def test_a_deck_is_a_level_of_its_own():
    rng = np.random.RandomState(2)
    ground, deck = cloud(rng), cloud(rng)
    ground[:, 2], deck[:, 2] = 0.02 * ground[:, 0], 0.02 * deck[:, 0] + 1.2
    height, level = heights(np.concatenate([ground, deck]))
    assert np.abs(height[np.tile(inner(ground), 2)]).max() < 0.004
    np.testing.assert_array_equal(level, np.repeat([0, 1], len(ground)))


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


def test_the_slope_of_the_flattest_level_is_stated():
    rng = np.random.RandomState(3)
    ground, deck = cloud(rng), cloud(rng)[:900]
    ground[:, 2], deck[:, 2] = 0.5 * ground[:, 0], 0.1 * deck[:, 0] + 4.0
    xyz = np.concatenate([ground, deck])
    x, y, z = xyz.T
    coarse = Coarse.around(x, y)
    bed = find_bed(coarse, *coarse.offsets(x, y), z.astype(np.float32))
    gradients = bed.gradients(np.array([[2.2, 4.2], [2.2, 0.3], [50.0, 50.0]]))
    np.testing.assert_allclose(gradients, [[0.5, 0.0], [0.1, 0.0], [0.0, 0.0]], atol=0.03)
