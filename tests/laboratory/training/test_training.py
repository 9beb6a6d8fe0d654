"""Training: gradients of the CPU path, resuming, the exported statistics, evaluation."""

import argparse
from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.errors import ParameterError
from rail_extract.core.frpdf import STATISTICS
from rail_extract.core.frpdf.architecture import fold
from rail_extract.core.frpdf.weights import load_arrays
from rail_extract.laboratory.training.scores import score

torch = pytest.importorskip("torch")

from rail_extract.core.frpdf.network import PassBatchNorm2d, Recurrent, weights_of  # noqa: E402
from rail_extract.laboratory.training import evaluate, gradients, train  # noqa: E402
from rail_extract.laboratory.training.networks import TrainedNetwork  # noqa: E402


@pytest.fixture
def small(monkeypatch):
    """Make steps and statistics fast."""
    monkeypatch.setattr(train, "CROPS", ((48, 1),))
    monkeypatch.setattr(train, "CROP_SHARES", (1.0,))
    monkeypatch.setattr(train, "STATISTICS_STEPS", 2)
    monkeypatch.setattr(train, "CALIBRATION_STEPS", 2)
    monkeypatch.setattr(train, "CHECKPOINT_STEPS", 1)


def for_the_cpu(layer):
    """Replace a layer by its fast form."""
    network = torch.nn.Sequential(layer)
    gradients.train_on_cpu(network)
    return network[0]


@pytest.mark.parametrize("dilation", [3, 7, gradients.MAX_PHASED_DILATION, gradients.MAX_PHASED_DILATION + 1])
def test_gradients_of_dilated_convolutions_are_those_of_torch(dilation):
    torch.manual_seed(0)
    x = torch.randn(2, 5, 50, 61, requires_grad=True)
    plain = torch.nn.Conv2d(5, 5, 7, padding=3 * dilation, dilation=dilation, bias=False)
    own = for_the_cpu(plain)
    assert type(own) is gradients.CpuConv2d
    upstream = torch.randn(2, 5, 50, 61)
    found = torch.autograd.grad(own(x), (x, own.weight), upstream)
    expected = torch.autograd.grad(
        torch.nn.functional.conv2d(x, own.weight, padding=3 * dilation, dilation=dilation), (x, own.weight), upstream
    )
    for ours, theirs in zip(found, expected):
        assert torch.allclose(ours, theirs, rtol=1e-4, atol=1e-3)


def test_batch_norm_of_several_columns_at_once_is_that_of_torch():
    torch.manual_seed(0)
    plain = PassBatchNorm2d(5)
    own = for_the_cpu(PassBatchNorm2d(5))
    assert type(own) is gradients.CpuBatchNorm2d
    x = (torch.randn(3, 5, 64, 96) * torch.rand(5, 1, 1) + torch.randn(5, 1, 1)).requires_grad_()
    upstream = torch.randn_like(x)
    for norm in (plain, own):
        norm.current_pass = 1
    expected = torch.autograd.grad(plain(x), (x, plain.weight, plain.bias), upstream)
    found = torch.autograd.grad(own(x), (x, own.weight, own.bias), upstream)
    for ours, theirs in zip(found, expected):
        assert (ours - theirs).norm() < 0.03 * theirs.norm()
    for name in ("running_mean", "running_var", "running_mean_1", "running_var_1"):
        assert torch.allclose(getattr(own, name), getattr(plain, name), rtol=1e-3, atol=1e-3)
    assert torch.allclose(own.eval()(x), plain.eval()(x), atol=0.01)


def test_a_resumed_training_gives_the_weights_of_an_unbroken_one(small, tmp_path):
    settings = train.Settings(3, 0.003, 7, "cpu")
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    unbroken = train.train(settings, tmp_path / "a", np.inf)
    assert train.train(settings, tmp_path / "b", minutes=0.0) is None
    resumed = train.train(settings, tmp_path / "b", np.inf)
    for name, value in unbroken.state_dict().items():
        assert torch.allclose(value, resumed.state_dict()[name], atol=1e-6), name
    assert (tmp_path / "b" / "log.csv").read_text().count("\n") == 4
    with pytest.raises(ParameterError, match="has a training with --seed 7: use the same"):
        train.train(replace(settings, seed=8), tmp_path / "b", np.inf)


def test_the_output_is_calibrated_to_the_largest_f1(monkeypatch):
    """Logits are high in rail cells, with noise: calibration corrects an output that finds too few cells."""
    label = (torch.rand(1, 1, 200, 200, generator=torch.manual_seed(1)) < 0.1).float()
    observed = label + 0.4 * torch.randn(label.shape, generator=torch.manual_seed(2))
    monkeypatch.setattr(train, "batch", lambda *_: (observed, label, torch.ones_like(label)))
    monkeypatch.setattr(train, "CALIBRATION_STEPS", 1)
    network = Recurrent(torch.nn.Conv2d(2, 1, 1))
    with torch.no_grad():
        network.layer.weight.copy_(torch.tensor([2.0, 0.0]).reshape(1, 2, 1, 1))
        network.layer.bias.fill_(-3.0)
    train.calibrate(network, train.Settings(1, 0.003, 0, "cpu"))

    with torch.no_grad():
        *_, logits = train.run_passes(network, observed, 2)

    def f1(threshold):
        return score((logits >= threshold)[0, 0].numpy(), label[0, 0].numpy() > 0.5).f1

    best = max(map(f1, np.arange(-2, 2, 0.1)))
    assert f1(0.0) > best - 0.003
    assert f1(-1.0) < best - 0.02
    assert f1(1.0) < best - 0.02


def test_the_command_leaves_weights_that_the_engines_take(small, tmp_path):
    parser = argparse.ArgumentParser()
    train.add_arguments(parser)
    train.run(parser.parse_args([str(tmp_path / "run"), "--steps", "2", "--device", "cpu"]))
    arrays = load_arrays(tmp_path / "run" / "weights.npz")
    assert len(fold(arrays)) == STATISTICS
    means = [arrays["layer.0.0.1.running_mean" + (f"_{n}" if n else "")] for n in range(STATISTICS)]
    assert not np.allclose(means[0], means[1])


@pytest.mark.parametrize("name", ["fast", "unet", "acnn", "pooled", "skipping"])
def test_other_networks_are_trained_and_run_like_frpdf(small, tmp_path, name, monkeypatch):
    monkeypatch.setattr(train, "CROPS", ((128, 1),))
    settings = train.Settings(1, 0.003, 3, "cpu", network=name, passes=1)
    before = train.new_network(settings).state_dict()
    network = train.train(settings, tmp_path, np.inf)
    moved = [key for key, value in network.named_parameters() if not torch.equal(value, before[key])]
    assert len(moved) == len(list(network.parameters()))
    train.recompute_statistics(network, settings)
    train.save_arrays(tmp_path / "weights.npz", weights_of(network))
    raster = np.eye(128, dtype=np.float32)
    probability = TrainedNetwork(name, tmp_path / "weights.npz").probabilities(raster, 0 * raster + 0.5, 0)
    assert probability.shape == (128, 128)
    assert 0 < probability.mean() < 0.5


def test_cleaning_without_a_network_closes_gaps_and_drops_specks():
    observed = np.zeros((64, 64), bool)
    observed[20, 5:60] = True
    observed[20, 30:32] = False
    observed[50, 50] = True
    cleaned = evaluate.classical(observed)
    assert cleaned[20, 5:60].all()
    assert not cleaned[50, 50]


class Filling:
    """A network that finds one more cell of a row in each pass, up to the pass `last`."""

    def __init__(self, cells, last):
        self.cells, self.last, self.passes = cells, last, 0

    def probabilities(self, raster, state, number):
        self.passes = number + 1
        found = np.zeros((1, self.cells), dtype=np.float32)
        found[0, : self.cells // 2 + min(number, self.last)] = 0.9
        return found


@pytest.mark.parametrize(("last", "passes"), [(0, 2), (2, 4), (9, 5)])
def test_passes_run_until_the_result_is_stable(last, passes):
    engine = Filling(100, last)
    found = evaluate.cleaner_of(engine, 0)(np.zeros((1, 100), dtype=bool))
    assert engine.passes == passes
    assert np.count_nonzero(found) == 50 + min(last, passes - 1)
