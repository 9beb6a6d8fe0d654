"""The benchmarks: each finds what it imports and measures, and its processes end with the program that started them."""

import os
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rail_extract.core.squares import steps
from rail_extract.laboratory.scenes.las import write_las
from rail_extract.laboratory.scenes.scene import RAIL
from rail_extract.laboratory.scenes.whole_rails import WHOLE

PROGRAMS = sorted((Path(__file__).resolve().parents[2] / "benchmarks").glob("*.py"))


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_a_benchmark_fits_the_code_that_it_measures(program, monkeypatch):
    pytest.importorskip("torch")
    monkeypatch.syspath_prepend(str(program.parent))
    found = runpy.run_path(str(program))
    assert [name for name in found.get("STEPS", ()) if not hasattr(steps, name)] == []
    assert [name for owner, name, *_ in found.get("STAGES", ()) if name not in vars(owner)] == []


@pytest.mark.parametrize("words", [["--labelled"], []])
def test_open_data_is_evaluated_with_whole_rails_in_the_class(words, tmp_path, monkeypatch, capsys):
    pytest.importorskip("torch")
    monkeypatch.syspath_prepend(str(PROGRAMS[0].parent))
    scene = WHOLE["whole"]()
    codes = np.where(scene.classification == RAIL, 5, scene.classification)
    name = "ACQ_286_Don_Lens_F_0+950_1+000.laz"
    write_las(tmp_path / name, scene.xyz, offsets=np.floor(scene.xyz.min(axis=0)), point_format=3, classification=codes)
    runpy.run_path(str(PROGRAMS[0].parent / "open_data.py"))["main"]([str(tmp_path), *words])
    row = capsys.readouterr().out.splitlines()[2].split()
    found, right, across_mm, height_mm = (float(value) for value in row[5:9])
    assert found > 99
    assert right > 99
    assert across_mm < 10  # the median of points on one side of a head
    assert height_mm < 3
    assert row[-1] == "EN_60E1_1435"


PROGRAM = """
import os, time
from processes import processes

if __name__ == "__main__":
    pool = processes(1)
    print(pool.submit(os.getpid).result(), flush=True)
    pool.submit(time.sleep, 600)
    time.sleep(600)
"""


def test_a_process_ends_when_the_program_that_started_it_is_killed(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    environment = {**os.environ, "PYTHONPATH": str(PROGRAMS[0].parent)}
    parent = subprocess.Popen([sys.executable, program], stdout=subprocess.PIPE, env=environment, text=True)
    number = int(parent.stdout.readline())
    assert number != parent.pid
    parent.kill()
    try:
        parent.communicate(timeout=60)  # the output ends with the last process that has it
    except subprocess.TimeoutExpired:
        os.kill(number, 9)
        raise
