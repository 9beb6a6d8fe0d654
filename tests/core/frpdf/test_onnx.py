"""An ONNX file of a pass computes what the network computes."""

import argparse

import cv2
import numpy as np
import pytest
from rail_extract.core.frpdf import STATISTICS, onnx
from rail_extract.core.frpdf.architecture import fold
from rail_extract.core.frpdf.models import MODELS
from rail_extract.core.frpdf.weights import load_arrays


def run(net, raster, state):
    net.setInput(np.stack([raster, state])[None] * 2 - 1)
    return net.forward()[0, 0]


def test_the_passes_equal_the_network(network):
    assert_equal(network)


def test_the_passes_of_small_networks_equal_them(architecture, arrays):
    pytest.importorskip("torch")
    from rail_extract.core.frpdf.network import FRPDF, set_weights

    small = FRPDF(architecture).eval()
    set_weights(small, arrays)
    assert_equal(small)


def assert_equal(network):
    torch = pytest.importorskip("torch")
    from rail_extract.core.frpdf.network import feedback, weights_of

    passes = [onnx.to_onnx(layers, 40, 56) for layers in fold(weights_of(network))]
    nets = [cv2.dnn.readNetFromONNX(np.frombuffer(proto, np.uint8)) for proto in passes]
    raster = (np.random.default_rng(0).random((40, 56)) < 0.2).astype(np.float32)
    state = np.full_like(raster, 0.5)
    with torch.no_grad():
        for number, logits in enumerate(network(torch.from_numpy(raster)[None, None], passes=3)):
            found = run(nets[min(number, STATISTICS - 1)], raster, state)
            assert np.abs(found - logits[0, 0].numpy()).max() < 1e-4
            state = feedback(logits)[0, 0].numpy().astype(np.float32)


def test_the_command_writes_a_file_per_pass_of_each_model(tmp_path):
    parser = argparse.ArgumentParser()
    onnx.add_arguments(parser)
    onnx.run(parser.parse_args([str(tmp_path), "--side", "48"]))
    assert len(list(tmp_path.iterdir())) == STATISTICS * len(MODELS)
    raster = (np.random.default_rng(1).random((48, 48)) < 0.2).astype(np.float32)
    for model in MODELS:
        for number, layers in enumerate(fold(load_arrays(model.path)), start=1):
            path = tmp_path / f"{model.name}_pass{number}.onnx"
            assert path.read_bytes() == onnx.to_onnx(layers, 48, 48)
            assert np.ptp(run(cv2.dnn.readNetFromONNX(str(path)), raster, 0 * raster)) > 1.0
