"""Engines compute what the network computes; cleanup stitches windows and passes."""

import argparse
import sys
from importlib.util import find_spec

import cv2
import numpy as np
import pytest
import torch
from rail_extract.core.errors import Cancelled, ModelError
from rail_extract.core.frpdf import STATISTICS, cleanup, onnx
from rail_extract.core.frpdf import engine as engine_module
from rail_extract.core.frpdf.engine import make_engine
from rail_extract.core.frpdf.models import MODELS, choose
from rail_extract.core.frpdf.network import feedback
from rail_extract.core.frpdf.opencv_engine import OpenCvEngine
from rail_extract.core.frpdf.torch_engine import TorchEngine
from rail_extract.core.frpdf.weights import load_arrays, save_arrays
from rail_extract.core.progress import Progress
from rail_extract.core.raster import RailRaster
from rail_extract.laboratory.training.train import export


class Copy:
    """An engine that finds what it sees, and takes note of the states it is told."""

    description, most_cells = "copy", 1 << 22

    def __init__(self):
        self.states = []
        self.cells = 0

    def sweep(self, seen, known, number, pieces, progress):
        assert [(piece.height, piece.width) for piece in pieces] == [one.shape for one in seen]
        self.states += [(number, state) for state in known]
        self.cells += sum(one.size for one in seen)
        progress.check()
        return seen


def line_of_cells(length):
    """A raster with one straight diagonal of cells."""
    return RailRaster({}, 0.04, 0.0, 0.0).with_cells(np.column_stack([np.arange(length), 2 * np.arange(length)]))


@pytest.mark.parametrize("make", [lambda arrays: TorchEngine(arrays, "CPU", exact=True), OpenCvEngine])
def test_the_folded_engines_equal_the_network(network, make):
    engine = make(export(network))
    raster = (np.random.default_rng(0).random((40, 57)) < 0.2).astype(np.float32)
    state = np.full_like(raster, 0.5)
    with torch.no_grad():
        for number, logits in enumerate(network(torch.from_numpy(raster)[None, None], passes=3)):
            found = engine.probabilities(raster, state, number)
            assert np.abs(found - torch.sigmoid(logits)[0, 0].numpy()).max() < 1e-6
            state = feedback(logits)[0, 0].numpy().astype(np.float32)


def test_the_onnx_command_writes_the_shipped_weights(tmp_path):
    parser = argparse.ArgumentParser()
    onnx.add_arguments(parser)
    onnx.run(parser.parse_args([str(tmp_path), "--side", "48"]))
    raster = (np.random.default_rng(1).random((48, 48)) < 0.2).astype(np.float32)
    state = np.zeros_like(raster)
    for model in MODELS:
        engine = TorchEngine(load_arrays(model.path), "CPU", exact=True)
        for number in range(STATISTICS):
            net = cv2.dnn.readNetFromONNX(str(tmp_path / f"{model.name}_pass{number + 1}.onnx"))
            net.setInput(np.stack([raster, state])[None] * 2 - 1)
            found = 1 / (1 + np.exp(-net.forward()[0, 0]))
            assert np.abs(found - engine.probabilities(raster, state, number)).max() < 1e-5


def test_weights_survive_the_file_in_half_precision(network, tmp_path):
    arrays = export(network)
    save_arrays(tmp_path / "weights.npz", arrays)
    loaded = load_arrays(tmp_path / "weights.npz")
    assert loaded.keys() == arrays.keys()
    for name, array in arrays.items():
        assert loaded[name].dtype == np.float32
        assert np.allclose(loaded[name], array, rtol=2**-11 if array.ndim == 4 else 0, atol=2**-24)
    size = (tmp_path / "weights.npz").stat().st_size
    assert size < 0.55 * sum(array.nbytes for array in arrays.values())


def test_missing_and_damaged_weights_are_named(tmp_path):
    with pytest.raises(ModelError, match="gone.npz are missing"):
        load_arrays(tmp_path / "gone.npz")
    (tmp_path / "cut.npz").write_bytes(b"PK\x03\x04 cut")
    with pytest.raises(ModelError, match="can't be read"):
        load_arrays(tmp_path / "cut.npz")


def test_arrays_of_another_network_are_refused():
    with pytest.raises(ModelError, match="no weights of FRPDF"):
        make_engine({"layer.0.weight": np.zeros(3, np.float32)})


def test_engines_are_chosen_by_name_and_by_what_is_installed(network, monkeypatch):
    arrays = export(network)
    assert make_engine(arrays, "OPENCV").description.startswith("OpenCV")
    assert make_engine(arrays).description.startswith("PyTorch")
    monkeypatch.setattr(engine_module, "find_spec", lambda name: None if name == "torch" else find_spec(name))
    assert make_engine(arrays).description.startswith("OpenCV")
    with pytest.raises(ModelError, match="package torch"):
        make_engine(arrays, "TORCH")
    with pytest.raises(ModelError, match="processor alone"):
        make_engine(arrays, "OPENCV", "CUDA")


def test_a_pytorch_that_does_not_start_gives_way_to_opencv(network, monkeypatch):
    arrays = export(network)
    monkeypatch.setitem(sys.modules, "rail_extract.core.frpdf.torch_engine", None)  # its import fails
    assert make_engine(arrays).description.startswith("OpenCV")
    for asked in (("TORCH", "AUTO"), ("AUTO", "CUDA")):
        with pytest.raises(ModelError, match="PyTorch is there but does not start"):
            make_engine(arrays, *asked)


@pytest.mark.parametrize("standard", [(1.435, 0.0762), (1.0, 0.06191), (1.676, 0.0667)])
def test_the_zoo_serves_the_worlds_standards(standard):
    nearest = min(MODELS, key=lambda model: abs(np.log(model.ratio * standard[1] / standard[0])))
    assert choose(*standard) == nearest
    assert nearest.path.exists()


def test_a_ratio_that_no_model_covers_is_refused():
    with pytest.raises(ModelError, match="GAUGE and HEAD_WIDTH"):
        choose(1.435, 0.150)


def test_every_cell_comes_out_once():
    raster = line_of_cells(3000)
    assert set(map(tuple, cleanup.clean(raster, Copy()).cells().tolist())) == set(map(tuple, raster.cells().tolist()))


def test_the_first_pass_is_told_nothing_and_later_ones_what_was_found():
    engine, raster = Copy(), line_of_cells(100)
    cleanup.clean(raster, engine, passes=3)
    assert all((state == 0.5).all() for number, state in engine.states if number == 0)
    assert all(set(np.unique(state)) <= {0.0, 1.0} for number, state in engine.states if number > 0)
    assert {number for number, _ in engine.states} == {0, 1, 2}
    told = sum(state.any() for number, state in engine.states if number == 2)
    assert told > 0


def test_passes_end_when_nothing_changes():
    engine = Copy()
    cleanup.clean(line_of_cells(100), engine, passes=cleanup.UNTIL_STABLE)
    assert max(number for number, _ in engine.states) == 1


def test_a_cancel_ends_the_pass():
    class Impatient(Progress):
        def is_cancelled(self):
            return True

    with pytest.raises(Cancelled):
        cleanup.clean(line_of_cells(100), Copy(), progress=Impatient())
