"""The network as the paper draws it."""

import numpy as np
import pytest
from rail_extract.core.frpdf.architecture import BASE

torch = pytest.importorskip("torch")

from rail_extract.core.frpdf.network import FRPDF, set_weights, weights_of  # noqa: E402


def test_a_cell_is_influenced_from_at_most_753_cells_away():
    torch.manual_seed(0)
    network = FRPDF().eval()
    for name, parameter in network.named_parameters():
        if name.endswith("0.weight") and parameter.dim() == 4:
            parameter.data.abs_()  # nothing cancels, no ReLU closes
    length = 2 * BASE.receptive_radius + 21
    strip = torch.ones(1, 2, 1, length, requires_grad=True)
    network.layer(strip)[0, 0, 0, length // 2].backward()
    seen = np.flatnonzero(strip.grad.abs().sum(dim=(0, 1, 2)).numpy()) - length // 2
    assert (seen.min(), seen.max()) == (-BASE.receptive_radius, BASE.receptive_radius)


def test_the_first_pass_has_separate_batch_statistics(network):
    raster = torch.full((1, 1, 16, 16), 1.0)
    with torch.no_grad():
        first, second, third = (network.logits(raster, raster, number) for number in range(3))
    assert not torch.allclose(first, second)
    assert torch.equal(second, third)


def test_weights_put_into_another_network_give_the_same_network(network):
    other = FRPDF().eval()
    set_weights(other, weights_of(network))
    raster = torch.rand(1, 1, 16, 16)
    with torch.no_grad():
        assert all(torch.equal(one, two) for one, two in zip(network(raster, 2), other(raster, 2)))
