"""The choice of an engine, by name and by installed packages."""

import sys
from importlib.util import find_spec

import pytest
from rail_extract.core.errors import ModelError
from rail_extract.core.frpdf import engine as engine_module
from rail_extract.core.frpdf.engine import make_engine


@pytest.fixture
def without_torch(monkeypatch):
    monkeypatch.setattr(engine_module, "find_spec", lambda name: None if name == "torch" else find_spec(name))


def test_opencv_runs_where_pytorch_is_not_installed(random_arrays, without_torch):
    assert make_engine(random_arrays, "OPENCV").description.startswith("OpenCV")
    assert make_engine(random_arrays).description.startswith("OpenCV")
    with pytest.raises(ModelError, match="package torch"):
        make_engine(random_arrays, "TORCH")


def test_opencv_does_not_run_on_a_graphics_card(random_arrays):
    with pytest.raises(ModelError, match="on the CPU only"):
        make_engine(random_arrays, "OPENCV", "CUDA")


def test_pytorch_runs_where_it_is_installed(random_arrays):
    pytest.importorskip("torch")
    assert make_engine(random_arrays).description.startswith("PyTorch")
    assert make_engine(random_arrays, "TORCH").description.startswith("PyTorch")
    assert make_engine(random_arrays, "OPENCV").description.startswith("OpenCV")


def test_opencv_replaces_a_pytorch_that_does_not_start(random_arrays, monkeypatch):
    found = find_spec("cv2")
    monkeypatch.setattr(engine_module, "find_spec", lambda name: found)  # as if installed
    monkeypatch.setitem(sys.modules, "rail_extract.core.frpdf.torch_engine", None)  # its import fails
    assert make_engine(random_arrays).description.startswith("OpenCV")
    for asked in (("TORCH", "AUTO"), ("AUTO", "CUDA")):
        with pytest.raises(ModelError, match="PyTorch is installed but does not start"):
            make_engine(random_arrays, *asked)
