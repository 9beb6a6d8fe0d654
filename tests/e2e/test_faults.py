"""Faults that need a separate process: a killed run, and parameters as JSON on standard input."""

import json
import os
import re
import signal
import subprocess

import pytest

CUT = "578214,578222,2494300,2494345"
"""Eight metres of three tracks, which the network processes quickly."""


@pytest.fixture(scope="module")
def speaks_json():
    """Skip if qgis_process does not accept JSON."""
    words = [os.environ["QGIS_PROCESS"], "--version"]
    shown = subprocess.run(words, capture_output=True, text=True).stdout
    major, minor = map(int, re.search(r"QGIS (\d+)\.(\d+)", shown).groups())
    if (major, minor) < (3, 24):
        pytest.skip(f"qgis_process of QGIS {major}.{minor} takes no JSON on standard input: 3.24 is the first")


def run_json(inputs):
    words = [os.environ["QGIS_PROCESS"], "run", "railextract:rasterizerailpoints", "-"]
    return subprocess.run(words, input=json.dumps({"inputs": inputs}), capture_output=True, text=True)


def test_parameters_as_json(speaks_json, sample, tmp_path):
    inputs = {"INPUT": str(sample / "sample.laz"), "STANDARD": "IN_75R_1000", "EXTENT": CUT}
    done = run_json({**inputs, "OUTPUT": str(tmp_path / "räster 1.tif")})
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads(done.stdout[done.stdout.index("{") :])["results"]["OUTPUT"] == str(tmp_path / "räster 1.tif")


def test_bad_json_input_is_one_sentence_and_an_exit_code(speaks_json, tmp_path):
    done = run_json({"INPUT": "gone.laz", "OUTPUT": str(tmp_path / "o.tif")})
    assert done.returncode == 1
    assert "gone.laz does not exist" in done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name != "posix", reason="only Unix has this signal")
def test_killed_run_keeps_the_old_output_and_leaves_no_new_one(start_qgis_process, sample, tmp_path):
    rails, tracks = tmp_path / "rails.gpkg", tmp_path / "tracks.shp"
    rails.write_bytes(b"of an earlier run")
    parameters = {"INPUT": sample / "sample.laz", "STANDARD": "IN_75R_1000", "RAILS": rails, "CENTERLINES": tracks}
    with start_qgis_process(parameters) as process:
        shown = b""
        while b"...20" not in shown:
            letter = process.stdout.read(1)
            assert letter, shown
            shown += letter
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert [path.name for path in tmp_path.iterdir()] == ["rails.gpkg"]
    assert rails.read_bytes() == b"of an earlier run"
