import numpy as np
import pytest
from rail_extract.core.standards import STANDARDS
from rail_extract.laboratory.ruler.classification import hectares, lines_from, score
from rail_extract.laboratory.ruler.lines import match
from rail_extract.laboratory.scenes.raw import scan_world
from rail_extract.laboratory.scenes.raw_catalogue import line as plan
from rail_extract.laboratory.scenes.raw_catalogue import parallel
from rail_extract.laboratory.scenes.raw_scanner import RawScanner
from rail_extract.laboratory.scenes.raw_world import (
    ground,
    running_rails,
)


@pytest.fixture(scope="module")
def plain():
    curve = plan(15.0, 1 / 300, 0.4)
    return scan_world(
        "plain", parallel(curve, (0.0,)), STANDARDS["EN_60E1_1435"], [RawScanner()], [ground, running_rails], 3
    )


def test_heads_are_found_and_nothing_else(plain):
    result, rail = score(plain)
    assert result.recall > 0.99
    assert result.precision > 0.99
    assert rail.sum() == result.figures.points


def test_labels_of_everything_score_badly(plain, monkeypatch):
    from rail_extract.core.classify.square import Classified
    from rail_extract.core.rails import SearchFigures
    from rail_extract.laboratory.ruler import classification

    everything = Classified(np.ones(len(plain.xyz), dtype=bool), SearchFigures())
    monkeypatch.setattr(classification, "classify_cloud", lambda *_, **__: everything)
    result, _ = score(plain)
    assert result.recall == 1.0
    assert result.precision < 0.1


def test_lines_of_the_labels_lie_on_the_rails(plain):
    pytest.importorskip("torch")
    found = lines_from(plain, plain.head).within(0.05)
    assert found.completeness > 0.98


def test_lines_without_truth_are_wrong_over_their_whole_length(plain):
    found = match([np.array([[0.0, 0, 0], [30, 0, 0]]), np.array([[0.0, 5, 0], [0, 17, 0]])], [])
    assert found.wrong_m() == pytest.approx(42.0)
    assert found.within(0.05).correctness == 0.0
    assert np.isnan(found.within(0.05).completeness)
    nothing = lines_from(plain, np.zeros(len(plain.xyz), dtype=bool))
    assert nothing.wrong_m() == 0.0 and nothing.within(0.05).completeness == 0.0
    # 15 m long and 28 m wide; squares at its edges are partly outside.
    assert hectares(plain) == pytest.approx(0.042, rel=0.15)
