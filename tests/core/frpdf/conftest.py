"""A network that sees less far than FRPDF, so that a small raster holds everything it sees."""

import cv2
import numpy as np
import pytest
from rail_extract.core.frpdf import folding
from rail_extract.core.frpdf.architecture import CHANNELS, Combined, Output, Stacked
from rail_extract.core.frpdf.onnx import to_onnx

STAGES = (Stacked(2), *map(Combined, (1, 2, 1, 3, 2, 4, 5)), Stacked(CHANNELS), Output())
GAIN = 2.4
"""Without it, random weights would let every difference die out on its way through the layers."""


@pytest.fixture
def radius(monkeypatch):
    """Greatest distance in cells from which a cell can be influenced."""
    monkeypatch.setattr(folding, "STAGES", STAGES)
    return sum(stage.reach for stage in STAGES)


@pytest.fixture
def arrays(random_arrays, radius):
    """Its weights; they find about half of the cells along a line."""
    arrays = {name: array * GAIN if name.endswith(".1.weight") else array for name, array in random_arrays.items()}
    raster = np.pad(np.eye(60, dtype=np.float32), radius)
    bias = arrays["layer.9.bias"]
    arrays["layer.9.bias"] = bias - np.median(logits_of(arrays, raster, np.full_like(raster, 0.5), 0))
    return arrays


@pytest.fixture
def whole_pass(radius):
    """Run a pass of the whole network from an ONNX file: weights, raster, state and number of the pass to logits."""
    return logits_of


def logits_of(arrays, raster, state, number):
    net = cv2.dnn.readNetFromONNX(np.frombuffer(to_onnx(folding.fold(arrays)[number], *raster.shape), np.uint8))
    net.setInput(np.stack([raster, state])[None] * 2 - 1)
    return net.forward()[0, 0]
