"""Real qgis_process, with the plugin as it is unpacked from the zip."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

EXTRACT_RAILS = "railextract:extractrails"


def command(parameters: dict[str, object], *options: str, algorithm: object = EXTRACT_RAILS) -> list[str]:
    """Words of a qgis_process call; the algorithm is an id, or the file of a model."""
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
def start_qgis_process():
    def start(parameters: dict[str, object]) -> subprocess.Popen:
        return subprocess.Popen(command(parameters), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    return start


@pytest.fixture(scope="session")
def sample(request) -> Path:
    return request.config.rootpath / "resources" / "sample"
