"""Weights on disk, what is refused, the probabilities of a square, and the shipped weights."""

import sys

import numpy as np
import pytest
from built import raw_track
from rail_extract.core.errors import ModelError
from rail_extract.core.learned import model
from rail_extract.core.learned.blocks import cut, thin
from rail_extract.core.progress import Progress, Recording
from rail_extract.laboratory.ruler.classification import score
from rail_extract.laboratory.scenes.raw_catalogue import AIR


def test_without_pytorch_one_sentence_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ModelError, match="METHOD LEARNED needs PyTorch: install it with the algorithm Install"):
        model.load(tmp_path / "any.npz")


@pytest.fixture
def network():
    torch = pytest.importorskip("torch")
    from rail_extract.core.learned.network import RandLaNet

    torch.manual_seed(1)
    return RandLaNet()


def test_weights_survive_the_file(network, tmp_path):
    model.save(tmp_path / "weights.npz", network)
    loaded = model.load(tmp_path / "weights.npz")
    assert (tmp_path / "weights.npz").stat().st_size < 2e6
    for name, value in network.state_dict().items():
        if not name.endswith("num_batches_tracked"):
            assert np.array_equal(value, loaded.state_dict()[name]), name
    assert not loaded.training
    network.stem.linear.weight.data[0, 0] = np.nan
    model.save(tmp_path / "weights.npz", network)
    with pytest.raises(ModelError, match=r"weights.npz holds weights that are not numbers"):
        model.load(tmp_path / "weights.npz")


def track():
    thinned = thin(raw_track(6.0, 1000)[0])
    return thinned, cut(thinned, 41.0)


def test_all_points_of_cores_get_a_probability_and_no_others(network):
    thinned, blocks = track()
    found = model.Classifier(network, "CPU").probabilities(thinned, blocks)
    assert np.array_equal(np.isfinite(found), thinned.railhigh)
    assert found[thinned.railhigh].std() > 0


def test_a_full_graphics_card_is_left_for_the_cpu_or_named(network, monkeypatch):
    """The card itself is not needed: its error is raised by the first call."""
    import torch

    def full(*_):
        classifier._network.forward = forward
        raise torch.cuda.OutOfMemoryError("CUDA out of memory")

    thinned, blocks = track()
    forward = network.forward
    classifier = model.Classifier(network, "AUTO")
    network.forward = full
    progress = Recording(Progress())
    assert np.isfinite(classifier.probabilities(thinned, blocks, progress)).any()
    assert progress.warnings == ("The graphics card has too little free memory: continuing on the CPU.",)
    classifier = model.Classifier(network, "CPU")
    network.forward = full
    with pytest.raises(ModelError, match="too little free memory: set DEVICE to CPU"):
        classifier.probabilities(thinned, blocks)


def test_the_shipped_weights_find_the_rails_in_a_cloud_from_the_air():
    pytest.importorskip("torch")
    learned, _ = score(AIR["air 150"](5), True, model.SHIPPED)
    assert learned.recall > 0.97
    assert learned.precision > 0.96
