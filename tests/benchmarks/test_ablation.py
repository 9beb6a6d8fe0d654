"""Rules are judged by worlds, and each rule that is switched off is one of the core."""

import runpy
from pathlib import Path

import pytest

PROGRAM = Path(__file__).resolve().parents[2] / "benchmarks" / "ablation.py"


@pytest.fixture
def ablation(monkeypatch):
    pytest.importorskip("skimage", reason="the plain script of the golden table needs it")
    monkeypatch.syspath_prepend(str(PROGRAM.parent))
    return runpy.run_path(str(PROGRAM))


def test_every_rule_is_one_of_the_core(ablation):
    off = [(module, attribute) for switch in ablation["SWITCHES"] for module, attribute, _ in switch.off]
    assert len(off) > 80
    missing = [one for one in off if not hasattr(ablation["_module"](one[0]), one[1])]
    assert not missing


def test_a_rule_is_judged_by_the_worlds_that_fail_without_it_alone(ablation):
    rows_of_worlds = ablation["rows_of_worlds"]
    outcomes = [(False, {"needed": True, "idle": False})] * 8 + [(True, {"needed": True})] * 2 + [(False, {})] * 10
    rows = list(rows_of_worlds(["needed", "idle"], outcomes))
    assert rows[0] == "20 worlds, 2 fail with all rules."
    assert rows[2] == "| `needed` | 10 | 8 | 0 | 0.008 |"
    assert rows[3] == "| `idle` | 8 | 0 | 0 | 1.000 |"
