"""Fixtures that test modules of several folders share."""

import pytest


@pytest.fixture(scope="session")
def network():
    """An untrained network with odd batch statistics, so that folding and passes have something to get wrong."""
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
