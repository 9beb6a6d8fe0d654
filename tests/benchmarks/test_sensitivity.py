"""The benchmark of the causes of errors: the scenes of its sweeps, its table and its pictures."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from rail_extract.core.polyline import length_along
from rail_extract.laboratory.ruler.lines import compare_lines
from rail_extract.laboratory.scenes.scanner import Scanner


@pytest.fixture(scope="module")
def sensitivity():
    folder = Path(__file__).resolve().parents[2] / "benchmarks"
    sys.path.insert(0, str(folder))
    try:
        specification = importlib.util.spec_from_file_location("sensitivity_benchmark", folder / "sensitivity.py")
        module = importlib.util.module_from_spec(specification)
        sys.modules[specification.name] = module
        specification.loader.exec_module(module)
    finally:
        sys.path.remove(str(folder))
    return module


def test_gaps_have_no_points(sensitivity):
    scene = sensitivity.track_scene(Scanner(noise_m=0.001), heading=0.0, gap_m=3.0)
    left = scene.rail_points().xyz
    left = left[np.abs(left[:, 1] - scene.rails[0][0, 1]) < 0.04]
    for middle in sensitivity.GAPS_AT_M:
        in_gap = np.abs(left[:, 0] - middle) < 1.4
        assert in_gap.sum() < 10
        assert (np.abs(left[:, 0] - middle - 2.2) < 0.5).sum() > 50


def test_density_grows_and_curves_bend(sensitivity):
    sweep = sensitivity.SWEEPS["density"]
    densities = [sensitivity.density(sweep.scene(value)) for value in sweep.values[:3]]
    np.testing.assert_allclose(np.diff(np.log2(densities)), 0.9, atol=0.2)
    curve = sensitivity.SWEEPS["curvature"].scene(40.0).centerlines[0]
    chord = np.linalg.norm(curve[-1, :2] - curve[0, :2])
    assert length_along(curve[:, :2])[-1] == pytest.approx(40.0, rel=1e-3)
    assert chord == pytest.approx(2 * 25 * np.sin(40 / 50), rel=1e-3)


def test_a_row_and_the_pictures_show_both(sensitivity, tmp_path):
    line = np.column_stack([np.arange(10.0), np.zeros(10), np.zeros(10)])
    ours, script = compare_lines([line + [0, 0.001, 0]], [line]), compare_lines([line + [0, 0.01, 0.002]], [line])
    outcome = sensitivity.Outcome(2.0, ours, script)
    figures = sensitivity._row(outcome).split()
    assert [float(figure) for figure in figures] == [2.0, 1.0, 1.0, 0.0, 100.0, 10.0, 10.0, 2.0, 100.0]
    pytest.importorskip("matplotlib")
    picture = tmp_path / "across.png"
    sensitivity.draw({"noise": [outcome, outcome]}, "lateral_rmse_m", "mm", picture)
    assert 1000 < picture.stat().st_size < 150_000
