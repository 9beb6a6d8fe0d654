"""The list of stages describes the network of the paper, and the shipped weights fit it."""

import numpy as np
import pytest
from rail_extract.core.frpdf import architecture, folding
from rail_extract.core.frpdf.models import MODELS
from rail_extract.core.frpdf.weights import load_arrays


def test_a_pass_sees_753_cells_far():
    assert architecture.BASE.receptive_radius == 753


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_the_shipped_weights_have_a_layer_for_each_convolution_of_the_stages(model):
    for layers in folding.fold(load_arrays(model.path)):
        assert sum(layer.reach for layer in layers) == architecture.BASE.receptive_radius
        assert [layer.convolution.dilation for layer in layers] == [1, 1, 1, 3, 7, 15, 31, 63, 127, 1, 1, 1]
        assert [layer.reduction is not None for layer in layers] == [False] * 2 + [True] * 7 + [False] * 3
        assert [layer.is_output for layer in layers] == [False] * 11 + [True]
        weights = sum(layer.convolution.weight.size for layer in layers)
        assert weights + sum(layer.reduction.weight.size for layer in layers if layer.reduction) == 292_680
        shapes = [layer.convolution.weight.shape for layer in layers]
        assert shapes == [(24, 2, 7, 7)] + [(24, 24, 7, 7)] * 10 + [(1, 24, 1, 1)]


def test_both_kinds_of_pass_share_all_but_the_batch_statistics(random_arrays):
    first, later = folding.fold(random_arrays)
    for one, other in zip(first[:-1], later[:-1]):
        ratios = one.convolution.weight / other.convolution.weight
        assert np.ptp(ratios.reshape(24, -1), axis=1).max() < 1e-4
        assert np.abs(ratios.mean(axis=(1, 2, 3)) - 1).max() > 0.1
    assert first[-1].convolution.weight is later[-1].convolution.weight
