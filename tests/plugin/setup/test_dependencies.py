import subprocess
import sys
from pathlib import Path

import numpy
import pytest
import scipy
from rail_extract.rail_extract_plugin.algorithms import ALGORITHMS
from rail_extract.rail_extract_plugin.setup import dependencies
from rail_extract.rail_extract_plugin.setup.dependencies import PACKAGES, explain_missing, missing_packages, pins

ROOT = Path(__file__).resolve().parents[3]

QGIS_WITHOUT = """
import importlib.abc, os, socket, sys

ABSENT = set(sys.argv[1:])

class Absent(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ABSENT:
            raise ModuleNotFoundError(name)

for name in list(sys.modules):
    if name.split(".")[0] in ABSENT:
        del sys.modules[name]
sys.meta_path.insert(0, Absent())

def refuse(*arguments):
    sys.exit("the network is used")

socket.socket.connect = socket.getaddrinfo = refuse
os.environ["QT_QPA_PLATFORM"] = "offscreen"

from qgis.core import QgsApplication
application = QgsApplication([], True)
from qgis.PyQt.QtWidgets import QApplication
from rail_extract import classFactory
plugin = classFactory(None)
plugin.initProcessing()
for algorithm in plugin.provider.algorithms():
    print(algorithm.name(), *algorithm.canExecute())
if QApplication.topLevelWidgets():
    sys.exit("a window is open")
os._exit(0 if sys.stdout.flush() is None else 1)
"""


@pytest.fixture
def reasons_without(tmp_path):
    """Message of each algorithm about missing packages, by name, in a QGIS without some packages."""

    def run(*absent: str) -> dict[str, str]:
        words = [sys.executable, "-c", QGIS_WITHOUT, *absent]
        done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr
        lines = [line.split(" ", 2) for line in done.stdout.splitlines()]
        return {name: reason for name, able, reason in lines if (able == "True") == (reason == "")}

    return run


def test_wording_depends_on_the_number_of_packages_and_algorithms():
    reason = explain_missing("This", PACKAGES[-2:], ["One", "Two", "Three"])
    assert "needs the Python packages pyproj, torch, which" in reason
    assert reason.endswith(" One, Two and Three work without them.")
    assert explain_missing("This", PACKAGES[-2:], []).endswith("in a shell.")
    assert explain_missing("This", PACKAGES[-1:], ["One"]).endswith(" One works without it.")


@pytest.mark.parametrize(
    ("absent", "missing"),
    [({"cv2", "laspy"}, ["laspy"]), ({"torch"}, []), ({"torch", "cv2"}, ["cv2"]), ({"scipy"}, [])],
)
def test_one_module_of_a_need_is_enough(monkeypatch, absent, missing):
    monkeypatch.setattr(dependencies, "find_spec", lambda name: None if name in absent else name)
    assert [package.module for package in missing_packages((("laspy",), ("cv2", "torch")))] == missing


def test_requirements_file_lists_the_same_packages():
    lines = (ROOT / "requirements.txt").read_text().splitlines()
    listed = {line for line in lines if line and not line.startswith("#")}
    assert listed == {package.requirement for package in PACKAGES} - set(dependencies.OWNED_BY_QGIS)


def test_pins_are_the_versions_of_qgis():
    assert pins() == [f"numpy=={numpy.__version__}", f"scipy=={scipy.__version__}"]


def test_toolbox_loads_without_any_package(reasons_without):
    need_numpy = ("skimage", "matplotlib", "shapely")
    reasons = reasons_without(*(package.module for package in PACKAGES), *need_numpy)
    assert set(reasons) == {algorithm.JOB.name for algorithm in ALGORITHMS}
    assert {name for name, reason in reasons.items() if not reason} == {"installpackages", "checkinstallation"}
    assert "numpy, scipy, laspy, lazrs, cv2, pyproj" in reasons["extractrails"]
