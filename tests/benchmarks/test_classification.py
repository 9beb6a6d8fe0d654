"""The stages of the benchmark of raw clouds: functions that the classification has."""

import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


def test_every_stage_names_a_function_that_is_there(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    import classification

    assert [function for owner, function, _ in classification.STAGES if function not in vars(owner)] == []
    del sys.modules["classification"]
