"""Fixtures that test modules of several folders share."""

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("any machine", max_examples=50, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")


@pytest.fixture(scope="session")
def network():
    """An untrained network with unusual batch statistics, so that errors in folding and in the passes show."""
    torch = pytest.importorskip("torch")
    from rail_extract.core.frpdf.network import FRPDF

    torch.manual_seed(3)
    network = FRPDF()
    for name, buffer in network.named_buffers():
        if "running_mean" in name:
            buffer.normal_(0, 0.3)
        if "running_var" in name:
            buffer.uniform_(0.5, 2.0)
    return network.eval()


@pytest.fixture(scope="session")
def random_arrays():
    """Weights with the names and shapes of the shipped ones and random values, made without PyTorch."""
    from rail_extract.core.frpdf.models import MODELS
    from rail_extract.core.frpdf.weights import load_arrays

    rng = np.random.default_rng(3)
    arrays = {}
    for name, array in load_arrays(MODELS[0].path).items():
        if "running_mean" in name:
            values = rng.normal(0, 0.3, array.shape)
        elif "running_var" in name:
            values = rng.uniform(0.5, 2.0, array.shape)
        elif array.ndim == 4:
            values = rng.uniform(-1, 1, array.shape) / np.sqrt(array[0].size)
        else:
            values = np.full(array.shape, float(name.endswith(".1.weight")))
        arrays[name] = values.astype(np.float32)
    return arrays


@pytest.fixture
def small_training(monkeypatch):
    """Steps of a training that are fast, also on computers that do other work: each waits for the slowest thread."""
    torch = pytest.importorskip("torch")
    from rail_extract.core.learned import training

    monkeypatch.setattr(training, "BATCH", 2)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)
