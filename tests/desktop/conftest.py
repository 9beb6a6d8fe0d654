"""The real QGIS on a virtual display, with a fresh profile in which the plugin is installed from its zip."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rail_extract.core.disk import Destination
from rail_extract.core.fields import CENTERLINES, RAILS
from rail_extract.core.files.layers import lines_layer
from rail_extract.core.files.writing import write_layers
from rail_extract.core.frame import LocalFrame
from rail_extract.laboratory.scenes import clearance
from rail_extract.laboratory.scenes.las import write_las
from rail_extract.laboratory.scenes.raw_strips import strip

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]

SCREEN = "-screen 0 1600x1000x24"

LIMIT_S = 600
"""After which QGIS is ended; a scenario takes a tenth of this."""

GOES_ON = {"reopened": "review"}
"""Scenarios that begin with the profile that another one left."""

BEGIN = """
import sys
sys.path.insert(0, {here!r})
import driver, scenarios
driver.start(scenarios.{scenario}, {folder!r})
"""


@dataclass
class Session:
    """What a scenario found: results as it kept them, and the folder of the files that it wrote, and of its pictures.

    `code` is how QGIS ended, 0 or the number of a signal below 0, and `said` what it wrote to the terminal.
    """

    results: dict[str, Any]
    folder: Path
    code: int
    said: str

    def __getitem__(self, name: str) -> Any:
        return self.results[name]


@pytest.fixture(scope="session")
def raw_cloud(tmp_path_factory):
    """A raw cloud of 12 m of track that states no coordinate system."""
    return _written(tmp_path_factory.mktemp("clouds") / "raw.las", 12.0, rail_class=1)


@pytest.fixture(scope="session")
def labelled_cloud(tmp_path_factory):
    """A cloud of 40 m of track whose points on heads have class 10."""
    return _written(tmp_path_factory.mktemp("clouds") / "labelled.las", 40.0, rail_class=10)


def _written(path: Path, length_m: float, rail_class: int) -> Path:
    """Write a strip of track, with a class for the points on heads."""
    track = strip(length_m)
    xyz = track.xyz + [500_000.0, 3_000_000.0, 100.0]
    return write_las(path, xyz, classification=np.where(track.head, rail_class, 1))


@pytest.fixture(scope="session")
def gauge_folder(tmp_path_factory):
    """A folder with a cloud, `cloud.las`, of 90 m of curve with two plates in EBO_G1, and its lines, `lines.gpkg`."""
    folder = tmp_path_factory.mktemp("gauge")
    scene = clearance.double_track(1, 500.0, clearance.SHORT, apart_m=0.0)
    clearance.bed(scene)
    for at, depth_m in ((30.0, 0.030), (50.0, 0.080)):
        clearance.plate(scene, at, 1, 1.645 - depth_m, (1.5, 2.5))
    clearance.platform(scene, (10.0, 80.0), -1, 1.70, 0.55)
    clearance.write_points(folder / "cloud.las", scene.points, scene.codes)
    tracks, rails = clearance.lines_of(scene)
    layers = [lines_layer(RAILS, rails), lines_layer(CENTERLINES, tracks)]
    write_layers(layers, Destination.at(folder / "lines.gpkg"), LocalFrame(np.zeros(3)))
    return folder


@pytest.fixture(scope="session")
def run_scenario(tmp_path_factory, raw_cloud, labelled_cloud, gauge_folder):
    """Run a scenario, once: tests share what it found. One that goes on has the profile of another one."""
    programs = {name: shutil.which(name) for name in ("qgis", "xvfb-run")}
    if not all(programs.values()) or "QGIS_PROCESS" not in os.environ:
        pytest.exit("These tests need QGIS, Xvfb and the environment of make: run `make test-desktop`.", 1)

    @cache
    def run(scenario: str) -> Session:
        folder = tmp_path_factory.mktemp(scenario)
        begin = folder / "begin.py"
        # QGIS calls layers of files by the files, unless they are in its folder for temporary ones.
        temporary = folder / "temporary"
        temporary.mkdir()
        begin.write_text(BEGIN.format(here=str(HERE), scenario=scenario, folder=str(folder)), encoding="utf-8")
        environment = {
            **os.environ,
            "QT_QPA_PLATFORM": "xcb",
            "TMPDIR": str(temporary),
            "RAIL_EXTRACT_SAMPLE": str(ROOT / "resources" / "sample" / "sample.laz"),
            "RAIL_EXTRACT_RAW": str(raw_cloud),
            "RAIL_EXTRACT_LABELLED": str(labelled_cloud),
            "RAIL_EXTRACT_GAUGE": str(gauge_folder),
            "RAIL_EXTRACT_ZIP": str(ROOT / "build" / "rail_extract.zip"),
        }
        for name in ("QGIS_PLUGINPATH", "QGIS_CUSTOM_CONFIG_PATH"):
            environment.pop(name, None)
        profiles = (run(GOES_ON[scenario]).folder if scenario in GOES_ON else folder) / "profiles"
        qgis = [programs["qgis"], "--profiles-path", profiles, "--noversioncheck", "--nologo"]
        command = [programs["xvfb-run"], "-a", "-s", SCREEN, *qgis, "--code", begin]
        ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=LIMIT_S)
        results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
        return Session(results, folder, ended.returncode, ended.stdout + ended.stderr)

    return run
