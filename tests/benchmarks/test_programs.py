"""The benchmarks: each finds what it imports, and the functions whose time it takes."""

import runpy
from pathlib import Path

import pytest
from rail_extract.core.squares import steps

PROGRAMS = sorted((Path(__file__).resolve().parents[2] / "benchmarks").glob("*.py"))


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_a_benchmark_fits_the_code_that_it_measures(program, monkeypatch):
    pytest.importorskip("torch")
    monkeypatch.syspath_prepend(str(program.parent))
    found = runpy.run_path(str(program))
    assert [name for name in found.get("STEPS", ()) if not hasattr(steps, name)] == []
    assert [name for owner, name, *_ in found.get("STAGES", ()) if name not in vars(owner)] == []
