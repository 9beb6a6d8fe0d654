"""The list of stages describes the network of the paper, and the shipped weights fit it."""

import numpy as np
from rail_extract.core.frpdf import architecture, folding
from rail_extract.core.frpdf.models import choose
from rail_extract.core.frpdf.weights import load_arrays


def test_a_pass_sees_753_cells_far():
    assert architecture.BASE.receptive_radius == 753


def folded(name):
    return folding.fold(load_arrays(choose(1.435, 0.0762, name).path))


def products(layers):
    weights = [layer.convolution.weight for layer in layers]
    weights += [layer.reduction.weight for layer in layers if layer.reduction]
    return sum(weight.size for weight in weights) / folding.block_side(layers) ** 2


def test_the_shipped_weights_have_a_layer_for_each_convolution_of_the_stages():
    for layers in folded("base"):
        assert sum(layer.reach for layer in layers) == architecture.BASE.receptive_radius
        assert [layer.convolution.dilation for layer in layers] == [1, 1, 1, 3, 7, 15, 31, 63, 127, 1, 1, 1]
        assert [layer.reduction is not None for layer in layers] == [False] * 2 + [True] * 7 + [False] * 3
        assert [layer.is_output for layer in layers] == [False] * 11 + [True]
        assert products(layers) == 292_680
        shapes = [layer.convolution.weight.shape for layer in layers]
        assert shapes == [(24, 2, 7, 7)] + [(24, 24, 7, 7)] * 10 + [(1, 24, 1, 1)]


def test_the_fast_model_costs_less_than_a_sixth_of_base():
    for layers in folded("fast"):
        assert 4 * sum(layer.reach for layer in layers) == architecture.FAST.receptive_radius == 324
        assert products(layers) < 292_680 / 6
        assert [layer.convolution.dilation for layer in layers] == [1, 1, 1, 2, 4, 8, 16, 32, 8, 4, 2, 1, 1, 1]


def test_blocks_hold_the_cells_of_the_raster_in_their_order():
    cells = np.arange(2 * 8 * 12).reshape(2, 8, 12)
    blocks = folding.into_blocks(cells, 4)
    assert blocks.shape == (32, 2, 3)
    assert np.array_equal(blocks[16:, 1, 2].reshape(4, 4), cells[1, 4:, 8:])
    assert np.array_equal(folding.from_blocks(blocks[:16], 4), cells[0])


def test_both_kinds_of_pass_share_all_but_the_batch_statistics(random_arrays):
    first, later = folding.fold(random_arrays)
    for one, other in zip(first[:-1], later[:-1]):
        ratios = one.convolution.weight / other.convolution.weight
        assert np.ptp(ratios.reshape(24, -1), axis=1).max() < 1e-4
        assert np.abs(ratios.mean(axis=(1, 2, 3)) - 1).max() > 0.1
    assert first[-1].convolution.weight is later[-1].convolution.weight
