"""Training: gradients of the CPU path, resuming, the exported statistics, evaluation."""

import argparse

import numpy as np
import pytest
import torch
from rail_extract.core.frpdf import STATISTICS
from rail_extract.core.frpdf.torch_engine import TorchEngine
from rail_extract.core.frpdf.weights import load_arrays
from rail_extract.core.training import evaluate, gradients, train


@pytest.fixture
def small(monkeypatch):
    """Make steps and statistics cost little."""
    monkeypatch.setattr(train, "CROPS", ((48, 1),))
    monkeypatch.setattr(train, "CROP_SHARES", (1.0,))
    monkeypatch.setattr(train, "STATISTICS_STEPS", 2)
    monkeypatch.setattr(train, "CHECKPOINT_STEPS", 1)


@pytest.mark.parametrize("dilation", [3, 7, gradients.LARGEST_PHASED_DILATION, gradients.LARGEST_PHASED_DILATION + 1])
def test_gradients_of_dilated_convolutions_are_those_of_torch(dilation):
    torch.manual_seed(0)
    x = torch.randn(2, 5, 50, 61, requires_grad=True)
    plain = torch.nn.Conv2d(5, 5, 7, padding=3 * dilation, dilation=dilation, bias=False)
    own = gradients.train_on_cpu(torch.nn.Sequential(plain))[0]
    assert type(own) is gradients.CpuConv2d
    upstream = torch.randn(2, 5, 50, 61)
    found = torch.autograd.grad(own(x), (x, own.weight), upstream)
    expected = torch.autograd.grad(
        torch.nn.functional.conv2d(x, own.weight, padding=3 * dilation, dilation=dilation), (x, own.weight), upstream
    )
    for ours, theirs in zip(found, expected):
        assert torch.allclose(ours, theirs, rtol=1e-4, atol=1e-3)


def test_the_learning_rate_rises_and_falls_as_a_cosine():
    settings = train.Settings(1000, 0.003, 0, "cpu")
    assert train.learning_rate(0, settings) == pytest.approx(0.003 / train.WARM_UP_STEPS)
    assert train.learning_rate(500, settings) == pytest.approx(0.0015)
    assert train.learning_rate(999, settings) < 1e-5


def test_the_loss_of_a_perfect_answer_is_small_and_of_the_opposite_large():
    label = (torch.arange(100.0).reshape(1, 1, 10, 10) % 3 == 0).float()
    assert train.loss_of(40 * label - 20, label) < 0.01
    assert train.loss_of(20 - 40 * label, label) > 10


def test_a_resumed_training_ends_where_an_unbroken_one_does(small, tmp_path):
    settings = train.Settings(3, 0.003, 7, "cpu")
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    unbroken = train.train(settings, tmp_path / "a", np.inf)
    assert train.train(settings, tmp_path / "b", minutes=0.0) is None
    resumed = train.train(settings, tmp_path / "b", np.inf)
    for name, value in unbroken.state_dict().items():
        assert torch.allclose(value, resumed.state_dict()[name], atol=1e-6), name
    assert (tmp_path / "b" / "log.csv").read_text().count("\n") == 4


def test_the_command_leaves_weights_that_the_engine_takes(small, tmp_path):
    parser = argparse.ArgumentParser()
    train.add_arguments(parser)
    train.run(parser.parse_args([str(tmp_path / "run"), "--steps", "2", "--device", "cpu"]))
    arrays = load_arrays(tmp_path / "run" / "weights.npz")
    engine = TorchEngine(arrays, "CPU")
    raster = np.zeros((32, 32), np.float32)
    assert engine.probabilities(raster, raster, 0).shape == (32, 32)
    means = [arrays["layer.0.0.1.running_mean" + (f"_{n}" if n else "")] for n in range(STATISTICS)]
    assert not np.allclose(means[0], means[1])


def test_the_evaluation_set_is_fixed_and_its_input_poor():
    pairs = evaluate.evaluation_pairs(6)
    again = evaluate.evaluation_pairs(6)
    assert all(np.array_equal(a.observed, b.observed) for a, b in zip(pairs, again))
    assert {pair.label.shape for pair in pairs} == {(evaluate.SIDE, evaluate.SIDE)}
    assert 0.1 < evaluate.evaluate("input", lambda x: x, pairs).scores.f1 < 0.5


def test_the_classical_row_closes_and_drops_specks():
    observed = np.zeros((64, 64), bool)
    observed[20, 5:60] = True
    observed[20, 30:32] = False
    observed[50, 50] = True
    cleaned = evaluate.classical(observed)
    assert cleaned[20, 5:60].all()
    assert not cleaned[50, 50]
