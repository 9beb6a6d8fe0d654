"""A QGIS whose Python has none of our packages installs them from the package index, and then extracts rails."""

import json
import os
import subprocess

import pytest

CUT = "578214,578222,2494300,2494345"


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """Start qgis_process with a new profile and without the packages of the virtual environment."""
    environment = {**os.environ, "QGIS_CUSTOM_CONFIG_PATH": str(tmp_path_factory.mktemp("Größe östlich 3"))}
    del environment["PYTHONPATH"]

    def start(*words: str) -> subprocess.Popen:
        return subprocess.Popen(
            [os.environ["QGIS_PROCESS"], *words], env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )

    with start("plugins", "enable", "rail_extract") as enabling:
        assert b"rail_extract" in enabling.stdout.read()
    return start


@pytest.fixture(scope="module")
def run_bare(bare):
    def run(algorithm: str, **parameters: object) -> tuple[int, str]:
        words = [f"{name}={value}" for name, value in parameters.items()]
        with bare("--json", "run", f"railextract:{algorithm}", "--", *words) as process:
            output = process.stdout.read().decode()
        return process.returncode, output

    return run


def results_of(output: str) -> dict:
    return json.loads(output[output.index("\n{") :])["results"]


@pytest.mark.network
def test_packages_are_installed_and_rails_extracted(run_bare, sample, tmp_path):
    parameters = {
        "INPUT": sample / "sample.laz",
        "STANDARD": "IN_75R_1000",
        "EXTENT": CUT,
        "ITERATIONS": 1,
        "RAILS": tmp_path / "rails.gpkg",
    }
    code, output = run_bare("extractrails", **parameters)
    assert code == 1
    assert "which this QGIS does not have: run Install packages" in output
    code, output = run_bare("checkinstallation")
    assert code == 0
    assert results_of(output)["SELF_TEST"].startswith("failed: laspy, lazrs, cv2 missing")

    code, output = run_bare("installpackages")
    assert code == 0, output
    installed = results_of(output)["INSTALLED"]
    assert "laspy" in installed
    assert "opencv" in installed
    assert "numpy" not in installed
    assert "torch" not in installed

    code, output = run_bare("extractrails", **parameters)
    assert code == 0, output
    found = results_of(output)
    assert found["RAIL_COUNT"] == 6
    assert found["ENGINE_USED"].startswith("OpenCV")
    code, output = run_bare("installpackages")
    assert results_of(output)["INSTALLED"] == ""


def test_installation_is_checked(qgis_process):
    run = qgis_process({}, "--json", algorithm="railextract:checkinstallation")
    assert run.returncode == 0, run.stdout + run.stderr
    results = json.loads(run.stdout[run.stdout.index("{") :])["results"]
    assert results["SELF_TEST"].startswith("passed: 100.0%"), results
    assert results["PASSED"] is True
    assert results["MODELS"] == "base ok"
    assert "laspy 2" in results["VERSIONS"]
