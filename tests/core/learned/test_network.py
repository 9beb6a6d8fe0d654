"""The layers of RandLA-Net."""

import numpy as np
import pytest
from rail_extract.core.learned.blocks import build

torch = pytest.importorskip("torch")

from rail_extract.core.learned import network  # noqa: E402
from rail_extract.core.learned.model import inputs  # noqa: E402


def places(count, seed=0):
    rng = np.random.RandomState(seed)
    return np.column_stack([rng.uniform(-2, 2, (count, 3)), rng.uniform(0, 0.4, count)]).astype(np.float32)


@pytest.fixture
def net():
    torch.manual_seed(0)
    return network.RandLaNet()


def test_there_is_one_logit_for_each_point_and_a_gradient_for_each_weight(net):
    logits = net(*inputs([places(300), places(100, 1)], "cpu"))
    assert logits.shape == (400,)
    logits.square().sum().backward()
    for name, parameter in net.named_parameters():
        assert parameter.grad is not None and parameter.grad.abs().max() > 0, name


def test_blocks_do_not_see_each_other(net):
    net.eval()
    one, other = places(300), places(100, 1)
    with torch.inference_mode():
        together = net(*inputs([one, other], "cpu"))
        alone = torch.cat([net(*inputs([block], "cpu")) for block in (one, other)])
    assert torch.allclose(together, alone, atol=1e-5)


def test_the_order_of_points_and_of_neighbours_does_not_matter(net):
    """The result of a block of layers is permuted with its points, whatever the order of the neighbours."""
    net.eval()
    place = places(200)
    (layer, *_) = build([place[:, :3]])
    x = torch.randn(200, network.STEM)
    order = np.random.RandomState(2).permutation(200)
    new_number = np.argsort(order)
    near = new_number[layer.near[order]][:, ::-1].copy()
    moved = type(layer)(layer.position[order], near, layer.kept, layer.nearest)
    with torch.inference_mode():
        before = net.encoder[0](x, network.Tensors.of(layer, "cpu"))
        after = net.encoder[0](x[order], network.Tensors.of(moved, "cpu"))
    assert before.std() > 0.01
    assert torch.allclose(after, before[order], atol=1e-5)


def test_one_block_can_be_learned_by_heart(net):
    place = places(400)
    rail = torch.from_numpy(np.abs(place[:, 0]) < 0.5)
    prepared = inputs([place], "cpu")
    optimizer = torch.optim.Adam(net.parameters(), 0.01)
    for _ in range(50):
        loss = torch.nn.functional.binary_cross_entropy_with_logits(net(*prepared), rail.float())
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    assert ((net(*prepared) > 0) == rail).float().mean() > 0.98
