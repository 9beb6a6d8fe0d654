"""The benchmark of whole calls: what it counts, and what it says about it."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def calls():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER))
        specification = importlib.util.spec_from_file_location("speed_calls", FOLDER / "speed_calls.py")
        module = importlib.util.module_from_spec(specification)
        sys.modules[specification.name] = module
        specification.loader.exec_module(module)
    return module


@pytest.fixture
def program(tmp_path, monkeypatch):
    """A program in the place of `qgis_process`, whose child computes for half a second of processor time."""
    path = tmp_path / "program"
    path.write_text(
        f"#!{sys.executable}\n"
        "import os, subprocess, sys\n"
        "work = 'import time\\nwhile time.process_time() < 0.5: pass'\n"
        "subprocess.run([sys.executable, '-c', work])\n"
        "sys.exit(sys.argv[-1] == 'FAIL=1' or 'OMP_NUM_THREADS' in os.environ)\n"
    )
    path.chmod(0o755)
    monkeypatch.setenv("QGIS_PROCESS", str(path))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")


def test_the_processor_time_of_all_processes_counts(calls, program):
    spent = calls.timed("anything", [])
    assert 0.5 <= spent.cpu_s < 1.5
    assert spent.wall_s >= 0.5


def test_a_call_that_fails_ends_the_benchmark(calls, program):
    with pytest.raises(SystemExit, match="ended with 1"):
        calls.timed("anything", ["FAIL=1"])


def test_busy_programs_end_with_the_call(calls):
    started = []
    real = subprocess.Popen
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(calls.subprocess, "Popen", lambda *words: started.append(real(*words)) or started[-1])
        with calls.busy_programs(2):
            assert [one.poll() for one in started] == [None, None]
    assert [one.returncode for one in started] == [-9, -9]


def test_ratios_are_compared_with_the_limits(calls):
    idle = calls.Spent(10.0, 8.0)
    assert calls.verdict([idle, calls.Spent(15.0, 9.0)]) == "1.50 (1.12)"
    assert calls.verdict([idle, calls.Spent(15.0, 16.0)]) == "1.50 (2.00), above 1.6 (1.15)"
    assert calls.verdict([idle, calls.Spent(20.0, 8.0)]) == "2.00 (1.00), above 1.6 (1.15)"
    assert calls.row("a call", [idle]) == "| a call | 10.0 (8.0) |  |"


def test_every_call_names_an_algorithm_and_existing_inputs(calls, tmp_path):
    words = calls.CALLS["growing"].words(tmp_path)
    inputs = [Path(word.split("=", 1)[1]) for word in words if word.startswith(("INPUT=", "SEEDS="))]
    assert len(inputs) == 2
    assert all(file.stat().st_size for file in inputs)
    assert '"Point"' in inputs[1].read_text()
