"""A QGIS without the packages installs them from the package index and then extracts rails."""

import json
import os
import subprocess
from pathlib import Path

import pytest

CUT = "578214,578222,2494300,2494345"


class BareQgis:
    """qgis_process with a separate profile and without the packages of the virtual environment."""

    def __init__(self, profile: Path) -> None:
        self.profile = profile
        self.environment = {**os.environ, "QGIS_CUSTOM_CONFIG_PATH": str(profile)}
        self.packages = self.environment.pop("PYTHONPATH")
        self._call("plugins", "enable", "rail_extract")

    def run(self, algorithm: str, **parameters: object) -> subprocess.CompletedProcess:
        words = [f"{name}={value}" for name, value in parameters.items()]
        return self._call("--json", "run", f"railextract:{algorithm}", "--", *words)

    def results(self, algorithm: str, **parameters: object) -> dict:
        done = self.run(algorithm, **parameters)
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads(done.stdout[done.stdout.index("{") :])["results"]

    def _call(self, *words: str) -> subprocess.CompletedProcess:
        call = [os.environ["QGIS_PROCESS"], *words]
        return subprocess.run(call, env=self.environment, capture_output=True, text=True)


@pytest.fixture
def bare(tmp_path):
    return BareQgis(tmp_path / "Größe östlich 3")


@pytest.mark.network
def test_packages_are_installed_and_rails_extracted(bare, sample, tmp_path):
    parameters = {
        "INPUT": sample / "sample.laz",
        "STANDARD": "IN_75R_1000",
        "EXTENT": CUT,
        "ITERATIONS": 1,
        "RAILS": tmp_path / "rails.gpkg",
    }
    refused = bare.run("extractrails", **parameters)
    assert refused.returncode == 1
    assert "which this QGIS does not have: run Install packages" in refused.stdout + refused.stderr
    assert bare.results("checkinstallation")["SELF_TEST"].startswith("failed: laspy, lazrs, cv2 missing")

    installed = bare.results("installpackages")["INSTALLED"]
    assert "laspy" in installed
    assert "opencv" in installed
    assert "numpy" not in installed
    assert "torch" not in installed

    found = bare.results("extractrails", **parameters)
    assert found["RAIL_COUNT"] == 6
    assert found["ENGINE_USED"].startswith("OpenCV")
    assert bare.results("installpackages")["INSTALLED"] == ""


@pytest.fixture
def rasterize(bare, sample, tmp_path):
    """Run an algorithm that needs packages, and is quick."""
    given = {"INPUT": sample / "sample.laz", "STANDARD": "IN_75R_1000", "EXTENT": CUT}
    return lambda: bare.results("rasterizerailpoints", **given, OUTPUT=tmp_path / "raster.tif")


def test_folder_of_packages_from_the_environment_variable(bare, rasterize, tmp_path):
    bare.environment["RAIL_EXTRACT_PACKAGES"] = bare.packages
    assert rasterize()["OUTPUT"] == str(tmp_path / "raster.tif")


def test_folder_of_packages_from_the_setting(bare, rasterize, tmp_path):
    with (bare.profile / "profiles" / "default" / "QGIS" / "QGIS3.ini").open("a") as settings:
        settings.write(f"\n[Processing]\nConfiguration\\RAIL_EXTRACT_PACKAGES={bare.packages}\n")
    assert rasterize()["OUTPUT"] == str(tmp_path / "raster.tif")
