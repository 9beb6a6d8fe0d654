"""The benchmark of raster cleanup: its set, its rows and its tables."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from rail_extract.core.frpdf.folding import fold
from rail_extract.core.frpdf.models import MODELS
from rail_extract.core.frpdf.onnx import to_onnx
from rail_extract.core.frpdf.weights import load_arrays
from rail_extract.laboratory.rasters.layouts import FAMILIES

pytest.importorskip("torch")

from rail_extract.laboratory.training import evaluate  # noqa: E402


@pytest.fixture(scope="module")
def benchmark():
    path = Path(__file__).resolve().parents[2] / "benchmarks" / "frpdf.py"
    specification = importlib.util.spec_from_file_location("frpdf_benchmark", path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


@pytest.fixture
def small(benchmark, monkeypatch):
    monkeypatch.setattr(benchmark, "SIDE", 256)
    return benchmark


def test_the_set_holds_each_family_at_each_severity_once(small):
    drawn = [(n % len(FAMILIES), n % len(small.SEVERITIES)) for n in range(small.set_size())]
    assert len(set(drawn)) == small.set_size() == 99
    family, severity, pair = small.benchmark_pair(23)
    assert (family, severity) == ("curve", small.SEVERITIES[5])
    assert pair.label.shape == (256, 256)
    assert np.array_equal(pair.observed, small.benchmark_pair(23)[2].observed)
    assert small.SEED != evaluate.EVALUATION_SEED


def test_the_input_is_measured_as_it_is(small):
    tally = small.measure("input", 3)
    pairs = [small.benchmark_pair(number) for number in range(3)]
    everything = tally.scores[0, "all"]
    assert everything.tp == sum(np.count_nonzero(pair.observed & pair.label) for _, _, pair in pairs)
    assert everything.fn + everything.tp == sum(np.count_nonzero(pair.label) for _, _, pair in pairs)
    assert sum(tally.scores[0, family].tp for family, _, _ in pairs) == everything.tp
    assert tally.scores[1, "all"].f1 > everything.f1
    assert tally.lines[0] == 0
    assert tally.lines[1] == sum(np.count_nonzero(pair.distractor) for _, _, pair in pairs)


def test_a_function_that_erases_all_removes_lines_and_bridges_nothing(small, tmp_path, monkeypatch):
    (tmp_path / "eraser.py").write_text(
        "import numpy as np\n\ndef erase(observed):\n    return np.zeros(observed.shape)\n\nerase.parameters = 7\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    tally = small.measure("eraser:erase", 8)
    assert tally.parameters == 7
    assert tally.scores[0, "all"].tp == tally.scores[0, "all"].fp == 0
    assert tally.lines[0] == tally.lines[1] > 0
    assert sum(every for _, every in tally.gaps.values()) > 0
    assert sum(done for done, _ in tally.gaps.values()) == 0


def test_weights_and_their_onnx_passes_give_one_row(small, tmp_path):
    path = MODELS[0].path
    paths = [tmp_path / f"pass{number}.onnx" for number in (1, 2)]
    for file, layer in zip(paths, fold(load_arrays(path))):
        file.write_bytes(to_onnx(layer, 256, 256))
    weights, onnx = small.measure(f"{path}@2", 1), small.measure("+".join(map(str, paths)), 1)
    assert weights.parameters == 293_545
    assert onnx.scores[0, "all"].f1 == pytest.approx(weights.scores[0, "all"].f1, abs=0.02)


def test_weights_make_a_row_for_each_number_of_passes(small):
    assert list(small.expand(["input", "a.npz"])) == ["input", "a.npz@1", "a.npz@2"]


def test_the_report_names_every_row_in_every_table(small):
    text = "\n".join(small.report([small.measure("input", 2), small.measure("closing", 2)], 2))
    assert text.count("\ninput ") == text.count("\nclosing ") == 8
    assert "lines removed" in text and "thin rails" in text
