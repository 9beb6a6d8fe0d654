"""The real qgis_process, with the plugin unpacked from the zip."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from lines import read_lines

EXTRACT_RAILS = "railextract:extractrails"

STANDARD = "IN_75R_1000"
"""Rail standard of the sample."""


def command(parameters: dict[str, object], *options: str, algorithm: object = EXTRACT_RAILS) -> list[str]:
    """Arguments of a qgis_process call; the algorithm is an id or the file of a model."""
    words = [f"{name}={value}" for name, value in parameters.items()]
    return [os.environ["QGIS_PROCESS"], *options, "run", str(algorithm), "--", *words]


@pytest.fixture(scope="session", autouse=True)
def environment():
    if "QGIS_PROCESS" not in os.environ:
        pytest.exit('These tests need the environment of make: run `make test`, or eval "$(make -s env)" first.', 1)


@pytest.fixture(scope="session")
def qgis_process():
    def run(
        parameters: dict[str, object], *options: str, algorithm: object = EXTRACT_RAILS
    ) -> subprocess.CompletedProcess:
        return subprocess.run(command(parameters, *options, algorithm=algorithm), capture_output=True, text=True)

    return run


@pytest.fixture(scope="session")
def succeed(qgis_process):
    """Run an algorithm by its name, or the file of a model, and return the results by name."""

    def run(algorithm: str | Path, parameters: dict[str, object]) -> dict[str, Any]:
        of_plugin = isinstance(algorithm, str)
        done = qgis_process(parameters, "--json", algorithm=f"railextract:{algorithm}" if of_plugin else algorithm)
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads(done.stdout[done.stdout.index("{") :])["results"]

    return run


@pytest.fixture(scope="session")
def qgis_process_help():
    def run(algorithm: str) -> str:
        words = [os.environ["QGIS_PROCESS"], "help", algorithm]
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout

    return run


@pytest.fixture(scope="session")
def start_qgis_process():
    def start(parameters: dict[str, object]) -> subprocess.Popen:
        return subprocess.Popen(command(parameters), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    return start


@pytest.fixture(scope="session")
def sample(request) -> Path:
    return request.config.rootpath / "resources" / "sample"


@pytest.fixture(scope="session")
def truth(sample):
    return lambda kind: read_lines(sample / "sample_truth.geojson", where=f"kind = '{kind}'")


@dataclass
class Run:
    """A run on the sample, and the files that it wrote."""

    results: dict
    cloud: Path
    rails: Path
    centerlines: Path
    quality: Path
    cleaned: Path
    report: Path


@pytest.fixture(scope="session")
def extracted(succeed, sample, tmp_path_factory):
    """The sample, extracted in a folder and into files whose names contain spaces and umlauts."""
    folder = tmp_path_factory.mktemp("Größe östlich 1")
    cloud = shutil.copy(sample / "sample.laz", folder / "Schienen 1.laz")
    names = ("Schiënen.gpkg", "Gleis achsen.shp", "Güte.shp", "gesäubert 1.tif", "Bericht ü.html")
    outputs = dict(zip(("RAILS", "CENTERLINES", "QUALITY", "CLEANED", "REPORT"), (folder / name for name in names)))
    return Run(succeed("extractrails", {"INPUT": cloud, "STANDARD": STANDARD, **outputs}), cloud, *outputs.values())
