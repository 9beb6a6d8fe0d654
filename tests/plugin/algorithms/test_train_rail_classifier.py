"""Train Rail Classifier, and METHOD LEARNED with its weights in Classify Rail Points and Extract Rails."""

import laspy
import numpy as np
import pytest
from rail_extract.core.classify.settings import Settings
from rail_extract.laboratory.scenes.raw_shapes import track_beside_kerb

torch = pytest.importorskip("torch")

from rail_extract.core.learned import training  # noqa: E402

SIDE_M = Settings((1.435,), 0.072).side_m
CORNER = np.array([round(500_000 / SIDE_M) * SIDE_M, round(3_000_000 / SIDE_M) * SIDE_M, 100.0])


pytestmark = pytest.mark.usefixtures("small_training")


def test_a_cancelled_training_continues_and_its_weights_label_points(write_cloud, run_step, tmp_path, new_feedback):
    xyz, on = track_beside_kerb(400)
    path = write_cloud(xyz + CORNER, "labelled.laz", np.where(on, 10, 2))
    weights, card = tmp_path / "rails.npz", tmp_path / "card.html"
    values = {"INPUT": path, "EPOCHS": 8, "DEVICE": "CPU", "WEIGHTS": weights, "CARD": card}
    done = run_step("trainrailclassifier", values, new_feedback(cancel_at=20))
    assert not done.ok
    assert done.error.startswith("Cancelled at step ") and done.error.endswith("rails_training.")
    assert (tmp_path / "rails_training" / training.CHECKPOINT).exists()
    feedback = new_feedback()
    done = run_step("trainrailclassifier", values, feedback)
    assert done.ok, done.error
    assert any(line.startswith("Continuing the training at step ") for line in feedback.infos)
    assert done.results["WEIGHTS"] == str(weights)
    assert 0.5 < done.results["RECALL"] <= 1
    assert "labelled.laz" in card.read_text()
    assert sorted(one.name for one in tmp_path.iterdir()) == ["card.html", "labelled.laz", "rails.npz"]
    learned = {"INPUT": path, "METHOD": "LEARNED", "WEIGHTS": weights}
    done = run_step("classifyrailpoints", {**learned, "OUTPUT": tmp_path / "new.laz"})
    assert done.ok, done.error
    assert done.results["RAIL_POINTS"] == np.count_nonzero(laspy.read(tmp_path / "new.laz").classification == 10)
    done = run_step("extractrails", {**learned, "RAILS": tmp_path / "rails.gpkg"})
    assert done.error == "METHOD LEARNED is for raw clouds: set CLASSIFY, or set METHOD to GEOMETRY."
