"""A real QGIS without a screen, in which the plugin is registered."""

from __future__ import annotations

import gc
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from faults import FINE, REFUSED, WARNED, Fault
from fuzzing.clouds import chunks_of_any_size
from rail_extract.laboratory.scenes.las import write_las

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from qgis.core import NULL, QgsApplication, QgsProcessingContext, QgsProcessingFeedback, QgsProject  # noqa: E402

EXTRACT_RAILS = "railextract:extractrails"
ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "resources" / "sample" / "sample.laz"


@pytest.fixture(scope="session", autouse=True)
def temporary(tmp_path_factory):
    """A folder for temporary files that no test of another process uses."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", str(tmp_path_factory.mktemp("temporary")))
        yield


@pytest.fixture(scope="session")
def qgis(tmp_path_factory, temporary):
    """QGIS with its processing framework, in a separate profile."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("QGIS_CUSTOM_CONFIG_PATH", str(tmp_path_factory.mktemp("profile")))
        application = QgsApplication([], True)
        application.initQgis()
    sys.path.append(str(Path(application.pkgDataPath()) / "python" / "plugins"))
    from processing.core.Processing import Processing

    Processing.initialize()
    yield application
    gc.collect()  # objects of QGIS that refer to each other must not outlive it
    Processing.deinitialize()
    application.exitQgis()


@pytest.fixture(scope="session")
def plugin(qgis):
    """The plugin, started as QGIS does."""
    from rail_extract import classFactory

    plugin = classFactory(None)
    plugin.initProcessing()
    yield plugin
    plugin.unload()


@pytest.fixture
def algorithm(qgis, plugin):
    return qgis.processingRegistry().createAlgorithmById(EXTRACT_RAILS)


@pytest.fixture
def context(qgis):
    context = QgsProcessingContext()
    context.setProject(QgsProject.instance())
    yield context
    context.temporaryLayerStore().removeAllMapLayers()  # before QGIS exits
    QgsProject.instance().clear()


class Feedback(QgsProcessingFeedback):
    """Records messages, and cancels when the progress reaches a percentage."""

    def __init__(self, cancel_at: float | None = None) -> None:
        super().__init__(False)
        self.errors: list[str] = []
        self.infos: list[str] = []
        self.warnings: list[str] = []
        self.progress: list[float] = []
        self._cancel_at = cancel_at
        self.progressChanged.connect(self._follow)

    def reportError(self, error, fatalError=False):
        self.errors.append(error)

    def pushInfo(self, info):
        self.infos.append(info)
        super().pushInfo(info)

    def pushWarning(self, warning):
        self.warnings.append(warning)

    def said(self) -> str:
        """Return all messages."""
        return "\n".join((*self.errors, *self.warnings, *self.infos))

    def _follow(self, percent: float) -> None:
        self.progress.append(percent)
        if self._cancel_at is not None and percent >= self._cancel_at:
            self.cancel()


@pytest.fixture
def new_feedback(qgis):
    return Feedback


@dataclass
class Outcome:
    """The result of a run."""

    ok: bool
    results: dict[str, Any] = field(default_factory=dict)
    error: str = ""


@pytest.fixture
def run_step(qgis, plugin, context):
    """Check the parameters and run an algorithm, given by its name if it is the plugin's, as all front ends do."""

    def run(algorithm, parameters: dict[str, Any], feedback: Feedback | None = None) -> Outcome:
        if isinstance(algorithm, str):
            algorithm = qgis.processingRegistry().createAlgorithmById(f"railextract:{algorithm}")
        feedback = feedback or Feedback()
        parameters = {name: str(value) if isinstance(value, Path) else value for name, value in parameters.items()}
        accepted, message = algorithm.checkParameterValues(parameters, context)
        if not accepted:
            return Outcome(False, error=message)
        results, ok = algorithm.run(parameters, context, feedback)
        return Outcome(ok, results, "\n".join(feedback.errors))

    return run


@pytest.fixture
def run_table(run_step, context, new_feedback):
    """Run an algorithm whose OUTPUT is a layer; returns results, layer, values by field, and what was said."""

    def run(name, feedback=None, **parameters):
        feedback = feedback or new_feedback()
        outcome = run_step(name, {"OUTPUT": "memory:", **parameters}, feedback)
        assert outcome.ok, outcome.error
        layer = context.getMapLayer(outcome.results["OUTPUT"])
        rows = [[None if value == NULL else value for value in one.attributes()] for one in layer.getFeatures()]
        values = {field: [row[at] for row in rows] for at, field in enumerate(layer.fields().names())}
        return outcome.results, layer, values, feedback

    return run


@pytest.fixture
def run(run_step):
    """The same for Extract Rails."""

    def run(parameters: dict[str, Any], feedback: Feedback | None = None) -> Outcome:
        return run_step("extractrails", {"RAILS": "memory:", **parameters}, feedback)

    return run


@pytest.fixture
def write_cloud(tmp_path):
    """Write a LAS or LAZ file with points, (n, 3), and return its path."""

    def write(
        xyz: np.ndarray,
        name: str = "cloud.las",
        class_code: int = 10,
        epsg: int | str | None = 32643,
        folder: Path = tmp_path,
        any_chunk_size: bool = False,
        strips: np.ndarray | int = 0,
    ) -> Path:
        scales = [1e-7, 1e-7, 1e-3] if epsg == 4326 else 0.001
        values = {"scales": scales, "offsets": xyz[0], "classification": class_code, "point_source_id": strips}
        with chunks_of_any_size() if any_chunk_size else nullcontext():
            return write_las(folder / name, xyz, epsg and f"EPSG:{epsg}", **values)

    return write


@pytest.fixture
def track():
    """Points, (n, 3), on two straight railheads in UTM coordinates; the spacing is between their axes."""

    def points(spacing_m: float = 1.507, length_m: float = 12.0) -> np.ndarray:
        rng = np.random.default_rng(1)
        count = int(300 * length_m)
        along, across = rng.uniform(0, length_m, 2 * count), rng.uniform(-0.036, 0.036, 2 * count)
        across += np.repeat([-spacing_m / 2, spacing_m / 2], count)
        return np.column_stack([500_000 + along, 3_000_000 + across, 100 + rng.normal(0, 0.002, 2 * count)])

    return points


@dataclass
class Bench:
    """Tools to create faults: a folder, functions that create clouds, patches, and clean-up after a run."""

    folder: Path
    cloud: Callable[..., Path]
    track: Callable[..., np.ndarray]
    patch: pytest.MonkeyPatch
    feedback: Feedback
    run: ExitStack


OUTPUTS = {
    "extractrails": ("RAILS.gpkg", "CENTERLINES.shp", "QUALITY.gpkg", "FINDINGS.gpkg", "CLEANED.tif"),
    "classifyrailpoints": ("OUTPUT.laz",),
    "growrailpoints": ("OUTPUT.laz",),
    "airbornecenterlines": ("CENTERLINES.gpkg", "STATIONS.gpkg", "FINDINGS.gpkg"),
    "rasterizerailpoints": ("OUTPUT.tif",),
    "frpdfcleanup": ("OUTPUT.tif",),
    "vectorizerails": ("OUTPUT.gpkg",),
    "buildtrackcenterlines": ("OUTPUT.gpkg",),
    "measuretrackgeometry": ("OUTPUT.gpkg",),
    "measureclearance": ("INTRUSIONS.gpkg", "OUTPUT.gpkg", "PLATFORMS.gpkg", "WIRES.gpkg", "REPORT.html"),
    "stationalongaxis": ("OUTPUT.gpkg",),
    "fitalignment": ("ELEMENTS.gpkg", "DEVIATIONS.gpkg"),
    "comparetracks": ("OUTPUT.gpkg", "REPORT.html"),
    "exportalignment": ("OUTPUT.xml",),
    "importalignment": ("ELEMENTS.gpkg", "AXIS.gpkg"),
    "trainrailclassifier": ("WEIGHTS.npz",),
}
"""Outputs of the algorithms, each a file in the folder of the test."""


@pytest.fixture
def bench(tmp_path, write_cloud, track, monkeypatch, new_feedback):
    return Bench(tmp_path, write_cloud, track, monkeypatch, new_feedback(), ExitStack())


@pytest.fixture
def meet(bench, run_step, monkeypatch):
    """Run with a fault: the result must be that of its row, and no file may be left behind."""

    def meet(fault: Fault) -> Outcome:
        feedback = bench.feedback
        temporary, out = bench.folder / "temporary", bench.folder / "out"
        temporary.mkdir(), out.mkdir()
        monkeypatch.setattr(tempfile, "tempdir", str(temporary))
        outputs = {Path(name).stem: out / name for name in OUTPUTS[fault.algorithm]}
        with bench.run:
            outcome = run_step(fault.algorithm, {**outputs, **fault.prepare(bench)}, feedback)
        said = outcome.error.strip() or " ".join(feedback.warnings)
        good = WARNED if feedback.warnings else FINE
        found = good if outcome.ok else REFUSED
        assert (found, said) == (fault.ends, said if fault.matches(said) else fault.says)
        assert "Traceback" not in said
        assert {name: outcome.results.get(name) for name in fault.gives} == fault.gives
        assert not list(temporary.iterdir())
        left = {path.stem for path in out.iterdir()}
        assert left <= set(outputs) if outcome.ok else not left
        return outcome

    return meet
