"""A few of the kills of tools/kills.py, which kills fifty times for each format."""

import subprocess
import sys
from pathlib import Path

import pytest

TOOL = Path(__file__).resolve().parents[3] / "tools" / "kills.py"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no fork")
def test_a_killed_run_leaves_the_old_output_or_the_new_one():
    run = subprocess.run([sys.executable, str(TOOL), "2"], capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    assert run.stdout.count("whole") + run.stdout.count("absent until the next run") >= 8
