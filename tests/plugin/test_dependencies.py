import subprocess
import sys
from pathlib import Path

import numpy
import pytest
from rail_extract.rail_extract_plugin import dependencies
from rail_extract.rail_extract_plugin.dependencies import PACKAGES, explain_missing, missing_packages

ROOT = Path(__file__).resolve().parents[2]

BARE_QGIS = """
import importlib.abc, sys

class Absent(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {absent!r}:
            raise ModuleNotFoundError(name)

for name in list(sys.modules):
    if name.split(".")[0] in {absent!r}:
        del sys.modules[name]
sys.meta_path.insert(0, Absent())

from qgis.core import QgsApplication
application = QgsApplication([], False)
from rail_extract import classFactory
plugin = classFactory(None)
plugin.initProcessing()
print([algorithm.id() for algorithm in plugin.provider.algorithms()])
"""


@pytest.fixture
def without_laspy(monkeypatch):
    find_spec = dependencies.find_spec
    monkeypatch.setattr(dependencies, "find_spec", lambda name: None if name == "laspy" else find_spec(name))


def test_algorithm_can_run_here(algorithm):
    assert algorithm.canExecute() == (True, "")


def test_missing_package_is_named_with_its_remedy(algorithm, without_laspy):
    executable, reason = algorithm.canExecute()
    assert not executable
    assert reason.startswith("Missing Python package laspy: run ")
    assert reason.endswith('"laspy[lazrs]" and restart QGIS.')
    assert f"numpy=={numpy.__version__}" in reason


def test_missing_package_ends_a_run_before_it_begins(algorithm, context, new_feedback, without_laspy, tmp_path):
    feedback = new_feedback()
    results, ok = algorithm.run({"INPUT": str(tmp_path)}, context, feedback)
    assert not ok
    assert feedback.errors[0].startswith("Missing Python package laspy")


def test_two_packages_make_a_plural():
    assert explain_missing(PACKAGES[-2:]).startswith("Missing Python packages pyproj, torch: run ")


@pytest.mark.parametrize(
    ("absent", "missing"),
    [({"cv2", "laspy"}, ["laspy"]), ({"torch"}, []), ({"torch", "cv2"}, ["cv2"]), ({"scipy"}, [])],
)
def test_a_need_is_met_by_any_of_its_modules(monkeypatch, absent, missing):
    monkeypatch.setattr(dependencies, "find_spec", lambda name: None if name in absent else name)
    assert [package.module for package in missing_packages((("laspy",), ("cv2", "torch")))] == missing


def test_requirements_file_lists_the_same():
    lines = (ROOT / "requirements.txt").read_text().splitlines()
    listed = {line for line in lines if line and not line.startswith("#")}
    assert listed == {package.requirement for package in PACKAGES} - set(dependencies.OWNED_BY_QGIS)


def test_toolbox_loads_without_any_package(tmp_path):
    absent = {package.module for package in PACKAGES}
    script = BARE_QGIS.format(absent=absent)
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=tmp_path)
    assert "'railextract:extractrails'" in run.stdout, run.stderr
    assert run.stdout.count("railextract:") == 5
