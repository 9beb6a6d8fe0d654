"""The toolbox and the dialogs open without the packages that take time to load, and a run first says what it does."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SAMPLE = Path(__file__).resolve().parents[2] / "resources" / "sample" / "sample.laz"

SESSION = """
import json, os, sys
from pathlib import Path
from qgis.core import QgsApplication, QgsProcessingContext, QgsProcessingFeedback

application = QgsApplication([], True)
application.initQgis()
sys.path.append(str(Path(application.pkgDataPath()) / "python" / "plugins"))
from processing.core.Processing import Processing
Processing.initialize()

heavy = ("numpy", "scipy", "laspy", "lazrs", "pyproj", "torch", "cv2")
of_qgis = [name for name in heavy if name in sys.modules]  # newer QGIS imports numpy itself
from rail_extract import classFactory

def loaded():
    return [name for name in heavy if name in sys.modules and name not in of_qgis]

plugin = classFactory(None)
plugin.initProcessing()
found = {"toolbox": loaded()}
for algorithm in plugin.provider.algorithms():
    dialog = algorithm.create().createCustomParametersWidget(None)
    found[algorithm.name()] = loaded()

class Feedback(QgsProcessingFeedback):
    said = []
    def setProgressText(self, text):
        self.said.append((text, loaded()))
        self.cancel()

algorithm, feedback, context = plugin.provider.algorithm("extractrails").create(), Feedback(), QgsProcessingContext()
parameters = {"INPUT": sys.argv[1], "STANDARD": "IN_75R_1000", "RAILS": "memory:"}
assert algorithm.prepare(parameters, context, feedback)
try:
    algorithm.runPrepared(parameters, context, feedback)
except Exception:
    pass
print(json.dumps([found, feedback.said]), flush=True)
os._exit(0)
"""


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """Packages that were loaded when toolbox and dialogs had opened, and with the first words of a run."""
    folder = tmp_path_factory.mktemp("session")
    environment = {**os.environ, "QGIS_CUSTOM_CONFIG_PATH": str(folder), "QT_QPA_PLATFORM": "offscreen"}
    words = [sys.executable, "-c", SESSION, str(SAMPLE)]
    done = subprocess.run(words, capture_output=True, text=True, cwd=folder, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_toolbox_and_dialogs_load_no_package(session):
    found, _ = session
    assert len(found) > 10
    assert {name: loaded for name, loaded in found.items() if loaded} == {}


def test_a_run_says_what_it_does_before_it_loads_what_takes_longest(session):
    text, loaded = session[1][0]
    assert text == "Loading packages"
    assert not {"torch", "cv2"} & set(loaded)
