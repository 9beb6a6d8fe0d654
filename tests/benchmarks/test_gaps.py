"""The benchmark of gaps: the gaps it cuts, and the ones it counts as bridged."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from rail_extract.laboratory.rasters.pairs import CELL_M

pytest.importorskip("torch")


@pytest.fixture(scope="module")
def gaps():
    path = Path(__file__).resolve().parents[2] / "benchmarks" / "gaps.py"
    specification = importlib.util.spec_from_file_location("gaps_benchmark", path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


def test_a_cut_has_its_length_and_clears_one_rail_or_both(gaps):
    for reach_m, rails in ((gaps.RAIL_REACH_M, 1), (gaps.TRACK_REACH_M, 2)):
        for observed, gap in gaps.gapped_rasters(2.0, reach_m, 4):
            assert not observed[gap > 0].any()
            assert np.count_nonzero(gap) == pytest.approx(rails * 2.0 * 0.0762 / CELL_M**2, rel=0.15)
    cells = np.argwhere(next(iter(gaps.gapped_rasters(3.0, gaps.RAIL_REACH_M, 1)))[1])
    along = np.linalg.svd(cells - cells.mean(axis=0), full_matrices=False)[2][0]
    assert np.ptp(cells @ along) * CELL_M == pytest.approx(3.0, abs=0.1)


def test_the_label_bridges_all_gaps_and_the_input_none(gaps, monkeypatch):
    labels = iter([gap > 0 for _, gap in gaps.gapped_rasters(1.0, gaps.RAIL_REACH_M, 4)])
    assert gaps.bridged_share(lambda observed: observed | next(labels), 1.0, gaps.RAIL_REACH_M, 4) == 1.0
    assert gaps.bridged_share(lambda observed: observed, 1.0, gaps.RAIL_REACH_M, 4) == 0.0
