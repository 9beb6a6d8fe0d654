import hashlib

from qgis.core import QgsApplication
from rail_extract.core.frpdf.models import MODELS
from rail_extract.core.progress import Progress
from rail_extract.core.rails import RailNetwork
from rail_extract.rail_extract_plugin.setup import self_test


def test_weights_match_their_checksums():
    states = self_test.model_states()
    assert states == {model.name: "ok" for model in MODELS}, "run `sha256sum *.npz > SHA256SUMS` in models"


def test_changed_and_missing_weights_are_detected(monkeypatch, tmp_path):
    monkeypatch.setattr(self_test, "CHECKSUMS", tmp_path / "SHA256SUMS")
    assert set(self_test.model_states().values()) == {"changed"}
    (tmp_path / "SHA256SUMS").write_text(f"{hashlib.sha256(b'').hexdigest()}  {MODELS[0].file}\n")
    assert self_test.model_states()[MODELS[0].name] == "changed"
    monkeypatch.setattr("rail_extract.core.frpdf.models.FOLDER", tmp_path)
    assert set(self_test.model_states().values()) == {"missing"}


def test_version_of_missing_and_broken_packages(monkeypatch, tmp_path):
    (tmp_path / "railbroken.py").write_text("raise OSError('no such library')")
    monkeypatch.syspath_prepend(tmp_path)
    assert self_test.version("railmissing") == "not installed"
    assert self_test.version("railbroken") == "broken (no such library)"
    assert self_test.version("numpy")[0].isdigit()


def test_result_of_the_check_is_shown_and_written(run_step, new_feedback, tmp_path, monkeypatch):
    """QGIS opens a dialog only for algorithms that have a visible parameter, if only an output."""
    algorithm = QgsApplication.processingRegistry().createAlgorithmById("railextract:checkinstallation")
    assert algorithm.countVisibleParameters() == 1
    feedback = new_feedback()
    outcome = run_step("checkinstallation", {"REPORT": tmp_path / "check.html"}, feedback)
    assert outcome.ok
    said = "Rail Extract works here. Self test passed: 100.0% of the true rails found"
    assert said in feedback.said()
    page = (tmp_path / "check.html").read_text(encoding="utf-8")
    assert "<h1>Rail Extract works here.</h1>" in page
    assert f"<td>{outcome.results['SELF_TEST']}</td>" in page
    monkeypatch.setattr(
        "rail_extract.rail_extract_plugin.setup.dependencies.is_installed", lambda name: name != "laspy"
    )
    feedback = new_feedback()
    assert run_step("checkinstallation", {}, feedback).ok
    (warning,) = feedback.warnings
    assert warning == ("Rail Extract does not work here. Self test failed: laspy missing: run Install packages.")


def test_cuda_on_macos_is_refused(run_step, monkeypatch):
    monkeypatch.setattr("sys.platform", "darwin")
    outcome = run_step("installpackages", {"TORCH": "CUDA"})
    assert not outcome.ok
    assert "set TORCH to CPU" in outcome.error


def test_nothing_is_installed_where_nothing_is_missing(run_step):
    outcome = run_step("installpackages", {})
    assert outcome.ok
    assert outcome.results["INSTALLED"] == ""


def test_missing_rails_fail(monkeypatch):
    monkeypatch.setattr(
        "rail_extract.core.pipeline.extract_rails",
        lambda points, *rest: RailNetwork((), (), points[0].frame, "none", (), ()),
    )
    verdict = self_test.extract_sample(Progress())
    assert not verdict.passed
    assert verdict.words.startswith("0.0% of the true rails found")
