"""Train Rail Classifier, and METHOD LEARNED with its weights in Classify Rail Points and Extract Rails."""

import laspy
import numpy as np
import pytest
from rail_extract.core.classify.settings import Settings
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, with_bar, with_track

torch = pytest.importorskip("torch")

from rail_extract.core.learned import training  # noqa: E402

SIDE_M = Settings((1.435,), 0.072).side_m
CORNER = np.array([round(500_000 / SIDE_M) * SIDE_M, round(3_000_000 / SIDE_M) * SIDE_M, 100.0])


@pytest.fixture(autouse=True)
def _small(monkeypatch):
    """Make steps fast, also on computers that do other work."""
    monkeypatch.setattr(training, "BATCH", 2)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.fixture
def labelled(write_cloud):
    """12 m of track in four areas, and a kerb as high as the rails; the path, and which points are on heads."""
    rng = np.random.RandomState(3)
    xyz, on = with_track(flat(12.0, rng=rng, per_m2=400), 1.435, 0.072, 0.3)
    xyz, kerb = with_bar(xyz, 0.5, 0.3, 3.0)
    on &= ~kerb
    return write_cloud(rough(xyz, rng) + CORNER, "labelled.laz", np.where(on, 10, 2)), on


def test_a_trained_classifier_labels_points_and_gives_rails(labelled, run_step, run, tmp_path, new_feedback):
    path, on = labelled
    weights, card = tmp_path / "rails.npz", tmp_path / "card.html"
    values = {"INPUT": path, "EPOCHS": 8, "DEVICE": "CPU", "WEIGHTS": weights, "CARD": card}
    feedback = new_feedback()
    done = run_step("trainrailclassifier", values, feedback)
    assert done.ok, done.error
    assert done.results["WEIGHTS"] == str(weights)
    assert 0.5 < done.results["RECALL"] <= 1
    assert 0.5 < done.results["PRECISION"] <= 1
    assert done.results["STEPS"] > 8
    assert "labelled.laz" in card.read_text()
    assert sum("kept back: recall" in line for line in feedback.infos) >= 8
    assert sorted(one.name for one in tmp_path.iterdir()) == ["card.html", "labelled.laz", "rails.npz"]
    learned = {"INPUT": path, "METHOD": "LEARNED", "WEIGHTS": weights}
    done = run_step("classifyrailpoints", {**learned, "OUTPUT": tmp_path / "new.laz"})
    assert done.ok, done.error
    found = laspy.read(tmp_path / "new.laz").classification == 10
    assert done.results["RAIL_POINTS"] == found.sum()
    assert (found & on).sum() / on.sum() > 0.7
    assert (found & on).sum() / found.sum() > 0.9
    done = run({**learned, "CLASSIFY": True, "ITERATIONS": 1, "RAILS": tmp_path / "rails.gpkg"})
    assert done.ok, done.error
    assert done.results["RAIL_COUNT"] >= 1
    done = run({**learned, "RAILS": tmp_path / "rails.gpkg"})
    assert done.error == "METHOD LEARNED is for raw clouds: set CLASSIFY, or set METHOD to GEOMETRY."


def test_a_cancelled_training_keeps_its_checkpoint_and_continues(labelled, run_step, tmp_path, new_feedback):
    values = {"INPUT": labelled[0], "EPOCHS": 1, "DEVICE": "CPU", "WEIGHTS": tmp_path / "rails.npz"}
    done = run_step("trainrailclassifier", values, new_feedback(cancel_at=40))
    assert not done.ok
    assert done.error.startswith("Cancelled at step ")
    assert done.error.endswith("rails_training.")
    assert (tmp_path / "rails_training" / training.CHECKPOINT).exists()
    assert not (tmp_path / "rails.npz").exists()
    other = run_step("trainrailclassifier", {**values, "EPOCHS": 2})
    assert "rails_training holds another training, with other clouds or settings" in other.error
    feedback = new_feedback()
    done = run_step("trainrailclassifier", values, feedback)
    assert done.ok, done.error
    assert any(line.startswith("Continuing the training at step ") for line in feedback.infos)
    assert not (tmp_path / "rails_training").exists()
