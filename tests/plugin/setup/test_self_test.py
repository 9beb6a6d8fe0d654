import hashlib

from rail_extract.core.frpdf.models import MODELS
from rail_extract.core.progress import Progress
from rail_extract.rail_extract_plugin.setup import self_test


def test_weights_are_those_that_the_checksums_are_of():
    states = self_test.model_states()
    assert states == {model.name: "ok" for model in MODELS}, "run `sha256sum *.npz > SHA256SUMS` in models"


def test_changed_and_missing_weights_are_told(monkeypatch, tmp_path):
    monkeypatch.setattr(self_test, "CHECKSUMS", tmp_path / "SHA256SUMS")
    assert set(self_test.model_states().values()) == {"changed"}
    (tmp_path / "SHA256SUMS").write_text(f"{hashlib.sha256(b'').hexdigest()}  {MODELS[0].file}\n")
    assert self_test.model_states()[MODELS[0].name] == "changed"
    monkeypatch.setattr("rail_extract.core.frpdf.models.FOLDER", tmp_path)
    assert set(self_test.model_states().values()) == {"missing"}


def test_version_tells_what_is_missing_or_broken(monkeypatch, tmp_path):
    (tmp_path / "railbroken.py").write_text("raise OSError('no such library')")
    monkeypatch.syspath_prepend(tmp_path)
    assert self_test.version("railmissing") == "not installed"
    assert self_test.version("railbroken") == "broken (no such library)"
    assert self_test.version("numpy")[0].isdigit()


def test_run_without_a_package_says_which(run_step, monkeypatch):
    monkeypatch.setattr(
        "rail_extract.rail_extract_plugin.setup.dependencies.is_installed", lambda name: name not in ("lazrs", "laspy")
    )
    outcome = run_step("checkinstallation", {})
    assert outcome.ok
    assert outcome.results["PASSED"] is False
    assert outcome.results["SELF_TEST"] == "failed: laspy, lazrs missing, run Install packages"


def test_installation_wants_no_cuda_on_macos(run_step, monkeypatch):
    monkeypatch.setattr("sys.platform", "darwin")
    outcome = run_step("installpackages", {"TORCH": "CUDA"})
    assert not outcome.ok
    assert "set TORCH to CPU" in outcome.error


def test_nothing_is_installed_where_nothing_is_missing(run_step):
    outcome = run_step("installpackages", {})
    assert outcome.ok
    assert outcome.results["INSTALLED"] == ""


def test_straight_track_is_found():
    passed, words, _ = self_test.extract_straight(Progress())
    assert passed
    assert words.startswith("100.0% of two rails of 20 m found")
