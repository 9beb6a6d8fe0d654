"""Neighbours on the layers of the network, compared with all distances."""

import numpy as np
import pytest
from rail_extract.core.learned.pyramid import LAYERS, NEIGHBOURS, RATIO, build


def points(count, seed=0):
    return np.random.RandomState(seed).uniform(-2, 2, (count, 3)).astype(np.float32)


def test_neighbours_are_the_nearest_points_of_the_same_block():
    blocks = [points(300), points(150, 1)]
    layers = build(blocks)
    assert len(layers) == LAYERS
    starts = (0, 300, 450)
    for block, start, end in zip(blocks, starts, starts[1:]):
        away = np.linalg.norm(block[:, None] - block[None], axis=-1)
        near = layers[0].near[start:end] - start
        expected = np.sort(away, axis=1)[:, :NEIGHBOURS]
        assert np.allclose(np.take_along_axis(away, near, axis=1), expected, atol=1e-6)
        assert np.array_equal(near[:, 0], np.arange(len(block)))


def test_each_layer_keeps_the_first_quarter_of_each_block():
    layers = build([points(300), points(150, 1)])
    assert layers[0].kept.tolist() == [*range(75), *range(300, 338)]
    for layer, following in zip(layers, layers[1:]):
        assert np.array_equal(layer.position[layer.kept], following.position)
        kept = layer.position[layer.kept]
        own = np.linalg.norm(layer.position - kept[layer.nearest], axis=1)
        assert len(following.position) == pytest.approx(len(layer.position) / RATIO, abs=2)
        assert own[layer.kept].max() == 0
    away = np.linalg.norm(layers[0].position[:300, None] - layers[0].position[None, :75], axis=-1)
    assert np.array_equal(layers[0].nearest[:300], away.argmin(axis=1))


@pytest.mark.parametrize("count", [1, 5])
def test_a_block_with_few_points_repeats_its_neighbours(count):
    layers = build([points(count)])
    assert layers[0].near.shape == (count, NEIGHBOURS)
    assert np.array_equal(np.unique(layers[0].near[0]), np.arange(count))
    assert len(layers[-1].position) == 1
