"""Networks that see less far than FRPDF, so that a small raster holds everything they see."""

import cv2
import numpy as np
import pytest
from rail_extract.core.frpdf import architecture as module
from rail_extract.core.frpdf.architecture import Architecture
from rail_extract.core.frpdf.onnx import to_onnx

SMALL = (
    Architecture(channels=24, kernel_radius=3, dilations=(1, 2, 1, 3, 2, 4, 5)),
    Architecture(channels=20, kernel_radius=1, dilations=(1, 3, 2), block=4),
)
GAIN = 2.4
"""Without it, random weights would let every difference die out on its way through the layers."""


@pytest.fixture(params=SMALL, ids=["cells", "blocks"])
def architecture(request, monkeypatch):
    """The only architecture that weights can have."""
    monkeypatch.setattr(module, "ARCHITECTURES", (request.param,))
    return request.param


@pytest.fixture
def radius(architecture):
    """Greatest distance in cells from which a cell can be influenced."""
    return architecture.receptive_radius


@pytest.fixture
def arrays(architecture, monkeypatch):
    """Its weights; they find about half of the cells along a line."""
    rng, arrays = np.random.default_rng(3), {}

    def draw(_, name, shape):
        if "running_mean" in name:
            values = rng.normal(0, 0.3, shape)
        elif "running_var" in name:
            values = rng.uniform(0.5, 2.0, shape)
        elif len(shape) == 4:
            values = rng.uniform(-1, 1, shape) / np.sqrt(np.prod(shape[1:]))
        else:
            values = np.full(shape, GAIN if name.endswith(".1.weight") else 0.0)
        return arrays.setdefault(name, values.astype(np.float32))

    with monkeypatch.context() as context:
        context.setattr(module, "_checked", draw)
        module.fold(arrays)
    raster = np.pad(np.eye(60, dtype=np.float32), architecture.receptive_radius)
    logits = logits_of(arrays, raster, np.full_like(raster, 0.5), 0)
    arrays[f"layer.{len(architecture.stages) - 1}.bias"] -= np.median(logits)
    return arrays


@pytest.fixture
def whole_pass(radius):
    """Run a pass of the whole network from an ONNX file: weights, raster, state and number of the pass to logits."""
    return logits_of


def logits_of(arrays, raster, state, number):
    net = cv2.dnn.readNetFromONNX(np.frombuffer(to_onnx(module.fold(arrays)[number], *raster.shape), np.uint8))
    net.setInput(np.stack([raster, state])[None] * 2 - 1)
    return net.forward()[0, 0]
