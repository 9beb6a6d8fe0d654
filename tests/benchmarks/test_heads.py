"""The benchmark of heads: its figures on lines with known errors, its lines kept in a folder, and its ratios."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from rail_extract.core.parameters import Parameters
from rail_extract.core.rails import RailLine, Support
from rail_extract.laboratory.scenes.scanner import Scanner
from rail_extract.laboratory.scenes.uneven import plain_track


@pytest.fixture(scope="module")
def heads():
    path = Path(__file__).resolve().parents[2] / "benchmarks" / "heads.py"
    specification = importlib.util.spec_from_file_location("heads_benchmark", path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


def test_errors_and_shares_are_those_of_the_lines(heads):
    x = np.arange(0, 50.1, 0.1)
    true = np.column_stack([x, 0 * x, 0 * x])
    stations = np.arange(0.125, 50, 0.25)
    # Off by 3 mm to the left, in the second half as high as 2 mm.
    line = np.column_stack([x, 0 * x + 0.003, np.where(x < 25, 0.0, 0.002)])
    sigma_m = np.where(stations < 10, 0.004, 0.002)
    support = Support(stations, np.ones(len(stations), int), sigma_m, sigmaz_m=np.full(len(stations), 0.0011))
    rail = RailLine(line, 1, 10, 100, 0.0, 0.0, 0.0, support=support)
    row = dict(zip(heads.COLUMNS, heads.errors_of([rail], [true])))
    assert (row["across"], row["p95"]) == pytest.approx((3.0, 3.0))
    assert (row["height"], row["p95 z"]) == pytest.approx((2 / np.sqrt(2), 2.0), rel=0.01)
    assert (row["in 1 s"], row["in 2 s"]) == pytest.approx((20, 100), abs=1)
    assert (row["in 1 sz"], row["in 2 sz"], row["found"]) == pytest.approx((50, 100, 100), abs=1)


def test_lines_are_drawn_once_and_measured_from_the_folder(heads, tmp_path, monkeypatch):
    scene = plain_track("short", 1, Scanner(noise_m=0.004), kept=0.5)
    parameters = Parameters(scene.standard.gauge_m, scene.standard.head_width_m)
    first = heads.drawn_once(scene, parameters, tmp_path)
    monkeypatch.setattr(heads, "clean_square", None)
    again = heads.drawn_once(scene, parameters, tmp_path)
    assert len(first.lines) == 2
    for one, other in zip(first.lines, again.lines):
        np.testing.assert_array_equal(one, other)
    row = dict(zip(heads.COLUMNS, heads.figures_of(scene, tmp_path)))
    assert row["across"] < 2 and row["height"] < 0.6 and row["found"] > 99 and row["seconds"] > 0


def test_ratios_are_those_of_the_same_seeds(heads):
    before = {"kind": {"1": [2.0] * 4 + [50] * 5 + [1.0], "2": [9.0] * 10}}
    now = {"kind": {"1": [1.0] * 4 + [60] * 5 + [2.0]}, "new": {"1": [1.0] * 10}}
    ratios, mean = (line.split() for line in heads.compared(now, before).splitlines()[1:])
    assert ratios == ["kind", "0.50", "0.50", "0.50", "0.50", "2.00", "-1.00", "-1.00"]
    assert mean[2:] == ["0.50"] * 4 + ["2.00"]
