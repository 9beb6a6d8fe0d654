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
def qgis_version():
    words = [os.environ["QGIS_PROCESS"], "--version"]
    shown = subprocess.run(words, capture_output=True, text=True).stdout
    return tuple(map(int, re.search(r"QGIS (\d+)\.(\d+)", shown).groups()))


def test_parameters_as_json(qgis_version, sample, tmp_path):
    if qgis_version < (3, 24):
        pytest.skip("This qgis_process takes no JSON on standard input: 3.24 is the first.")
    inputs = {"INPUT": str(sample / "sample.laz"), "STANDARD": "IN_75R_1000", "EXTENT": CUT}
    given = json.dumps({"inputs": {**inputs, "OUTPUT": str(tmp_path / "räster 1.tif")}})
    words = [os.environ["QGIS_PROCESS"], "run", "railextract:rasterizerailpoints", "-"]
    done = subprocess.run(words, input=given, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads(done.stdout[done.stdout.index("{") :])["results"]["OUTPUT"] == str(tmp_path / "räster 1.tif")


@pytest.mark.skipif(os.name != "posix", reason="only Unix has these signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_run_that_is_ended_keeps_the_old_output_and_leaves_no_new_one(start_qgis_process, sample, tmp_path, number):
    rails, tracks = tmp_path / "rails.gpkg", tmp_path / "tracks.shp"
    rails.write_bytes(b"of an earlier run")
    parameters = {"INPUT": sample / "sample.laz", "STANDARD": "IN_75R_1000", "RAILS": rails, "CENTERLINES": tracks}
    with start_qgis_process(parameters) as process:
        shown = b""
        while b"...20" not in shown:
            letter = process.stdout.read(1)
            assert letter, shown
            shown += letter
        process.send_signal(number)
    assert process.returncode != 0
    assert [path.name for path in tmp_path.iterdir()] == ["rails.gpkg"]
    assert rails.read_bytes() == b"of an earlier run"
