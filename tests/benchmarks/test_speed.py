"""The benchmark of speed: its reference networks and its measures of change."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from rail_extract.core.rails import RailLine
from rail_extract.core.raster import RailRaster

torch = pytest.importorskip("torch")

from rail_extract.core.frpdf.network import weights_of  # noqa: E402


@pytest.fixture(scope="module")
def benchmark():
    path = Path(__file__).resolve().parents[2] / "benchmarks" / "speed_network.py"
    specification = importlib.util.spec_from_file_location("speed_network", path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


def raster_of(cells):
    return RailRaster({}, 0.04, 0.0, 0.0).with_cells(np.asarray(cells))


def rail(left_m=0.0, up_m=0.0, length_m=20.0):
    x = np.linspace(0.0, length_m, 41)
    return RailLine(np.column_stack([x, np.full(41, left_m), np.full(41, up_m)]), 1, 10, 100, 1.0, 1.0, 0.0)


def first_pass(network, tile):
    with torch.no_grad():
        seen = torch.from_numpy(tile)[None, None]
        return torch.sigmoid(network.logits(seen, torch.full_like(seen, 0.5), 0))[0, 0].numpy()


@pytest.fixture
def tile():
    return (np.random.default_rng(0).random((40, 50)) < 0.2).astype(np.float32)


def test_the_plain_network_is_the_one_of_the_weights(benchmark, network, tile):
    found = first_pass(benchmark.plain_network(weights_of(network)), tile)
    np.testing.assert_allclose(found, first_pass(network, tile), atol=1e-6)


def test_open_vino_computes_the_same_pass(benchmark, network, tile):
    pytest.importorskip("openvino")
    found = benchmark.open_vino(weights_of(network), "float32", 40, 50)(tile, np.full_like(tile, 0.5))
    np.testing.assert_allclose(found, first_pass(network, tile), atol=1e-5)


def test_added_and_removed_cells_are_counted(benchmark):
    reference = raster_of([[0, column] for column in range(100)])
    found = raster_of([[0, column] for column in range(2, 103)])
    assert benchmark._changed(found, reference) == pytest.approx(0.05)


def test_the_distance_of_lines_is_the_distance_by_which_one_was_moved(benchmark):
    assert benchmark._distance_m(rail(), rail(left_m=0.003, up_m=0.004)) == pytest.approx(0.005)
    assert benchmark._distance_m(rail(), rail(left_m=1.0)) == np.inf
    assert benchmark._distance_m(rail(), rail(length_m=15.0)) == np.inf


def test_a_small_share_of_the_diagonal_is_computed(benchmark, monkeypatch):
    monkeypatch.setattr(benchmark, "DIAGONAL_M", 300.0)
    (line,) = benchmark.cells_table()
    share = float(line.split(": ")[1].split(" %")[0])
    assert 3.0 < share < 10.0  # ten times as much as for the tenfold length
