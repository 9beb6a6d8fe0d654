"""The command `train-classifier`, and `classify` with its weights."""

import laspy
import numpy as np
import pytest
from rail_extract.__main__ import INTERRUPTED, main
from rail_extract.core.classify.settings import Settings
from rail_extract.laboratory.ruler.whole_clouds import classify_cloud  # noqa: E402
from rail_extract.laboratory.scenes.las import write_las
from rail_extract.laboratory.scenes.raw_shapes import track_beside_kerb

SIDE_M = Settings((1.435,), 0.072).side_m
CORNER = np.array([round(500_000 / SIDE_M) * SIDE_M, round(5_000_000 / SIDE_M) * SIDE_M, 100.0])


pytestmark = pytest.mark.usefixtures("small_training")


@pytest.fixture
def save(tmp_path):
    def save(name, xyz, codes):
        return str(write_las(tmp_path / name, xyz + CORNER, offsets=CORNER, scales=0.0005, classification=codes))

    return save


@pytest.fixture
def labelled(save):
    xyz, on = track_beside_kerb(400)
    west = xyz[:, 0] < 20
    return [save(f"{name}.laz", xyz[part], np.where(on, 10, 2)[part]) for name, part in (("w", west), ("e", ~west))]


def test_weights_label_the_cloud_and_the_card_describes_them(labelled, save, tmp_path, capsys):
    weights, card = tmp_path / "out" / "rails.npz", tmp_path / "out" / "card.html"
    words = ["train-classifier", *labelled, "--weights", str(weights), "--card", str(card), "--epochs", "8"]
    assert main([*words, "--device", "CPU"]) == 0
    assert "of blocks kept back" in capsys.readouterr().out
    assert sorted(one.name for one in weights.parent.iterdir()) == ["card.html", "rails.npz"]
    page = card.read_text()
    assert "w.laz" in page or "e.laz" in page
    for part in ("Rail classes", "8, ", "112,769 weights", "<svg"):
        assert part in page
    xyz, on = track_beside_kerb(400)
    raw = save("raw.laz", xyz, np.full(len(xyz), 2))
    new = tmp_path / "new.laz"
    assert main(["classify", raw, "--output", str(new), "--method", "LEARNED", "--weights", str(weights)]) == 0
    found = np.asarray(laspy.read(new).classification) == 10
    assert (found & on).sum() / on.sum() > 0.7
    assert (found & on).sum() / found.sum() > 0.9
    assert f"{found.sum()} of {len(xyz)} points are on rails" in capsys.readouterr().out
    order = np.random.RandomState(1).permutation(len(xyz))
    settings = Settings((1.435,), 0.072, weights=weights)
    places = laspy.read(raw).xyz
    one, other = (classify_cloud(places[part], settings) for part in (..., order))
    assert np.array_equal(one.rail, found)
    assert np.array_equal(other.rail, one.rail[order])
    assert 15 < one.figures.paired_m < 26


def test_a_training_continues_after_its_time(labelled, tmp_path, capsys):
    weights, folder = tmp_path / "rails.npz", tmp_path / "rails_training"
    words = ["train-classifier", *labelled, "--weights", str(weights), "--epochs", "1"]
    assert main([*words, "--minutes", "0"]) == INTERRUPTED
    assert "Cancelled" in capsys.readouterr().err
    assert not folder.exists()  # nothing had been read
    assert main([*words, "--minutes", "0.02"]) == INTERRUPTED or weights.exists()
    if folder.exists():
        other = ["train-classifier", labelled[0], "--weights", str(weights)]
        assert main(other) == 1
        assert "rails_training holds another training, with other clouds or settings" in capsys.readouterr().err
    assert main(words) == 0
    assert weights.exists() and not folder.exists()
