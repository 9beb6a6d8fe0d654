"""A few of the kills of tools/kills.py and of the pairs of tools/races.py, which do many for each format."""

import subprocess
import sys
from pathlib import Path

import pytest

TOOLS = Path(__file__).resolve().parents[3] / "tools"

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no fork")


def run(tool, times):
    made = subprocess.run([sys.executable, str(TOOLS / tool), str(times)], capture_output=True, text=True)
    assert made.returncode == 0, made.stdout + made.stderr
    return made.stdout


def test_a_killed_run_leaves_the_old_output_or_the_new_one():
    said = run("kills.py", 2)
    assert said.count("whole") + said.count("absent until the next run") >= 11


def test_of_two_runs_onto_one_output_one_wins_and_the_other_says_so():
    assert len(run("races.py", 2).splitlines()) == 13
