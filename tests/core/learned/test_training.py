"""Training: what is kept back, resuming, cancelling, the calibrated output."""

import numpy as np
import pytest
from heard import Heard
from rail_extract.core.errors import Cancelled, ModelError, ParameterError
from rail_extract.core.learned.blocks import Examples, save_index, write_square
from rail_extract.laboratory.scenes.raw_shapes import track_beside_kerb

torch = pytest.importorskip("torch")

from rail_extract.core.learned import training  # noqa: E402
from rail_extract.core.learned.model import save  # noqa: E402
from rail_extract.core.learned.training import LabelFigures, TrainingSettings, train  # noqa: E402

SIDE = 40.0


pytestmark = pytest.mark.usefixtures("small_training")


@pytest.fixture(scope="module")
def examples(tmp_path_factory):
    """Blocks of 12 m of track and a kerb, in four areas."""
    folder = tmp_path_factory.mktemp("examples")
    xyz, on = track_beside_kerb(200)
    tile = (xyz[:, 0] > 20).astype(int)
    save_index(folder, write_square(folder, 0, (0, 0), SIDE, xyz, on, tile))
    return Examples.load(folder)


def test_blocks_on_disk_have_their_labels_and_count_all_points(examples):
    points = np.concatenate([examples.block(number) for number in range(len(examples.index))])
    core = points[points["core"]]
    assert core["rail"].sum() == examples.index["rail"].sum() > 100
    # A thinned point has the label of most of the points that it stands for.
    assert (core["rails"][core["rail"]] > 0).all()
    assert (core["others"][~core["rail"]] > 0).all()
    assert core["rails"].sum() == pytest.approx(200 * 2 * 12.56 * 0.072, rel=0.1)
    assert set(examples.index["tile"]) == {0, 1}


@pytest.mark.parametrize("name", ["0.npy", "index.npy", "checks.json"])
def test_a_damaged_folder_is_not_loaded(examples, tmp_path, name):
    for file in examples.folder.iterdir():
        data = bytearray(file.read_bytes())
        data[-9] ^= file.name == name
        (tmp_path / file.name).write_bytes(data)
    with pytest.raises(ValueError, match="damaged"):
        Examples.load(tmp_path)


def test_whole_areas_are_kept_back_some_with_rails(examples):
    kept_back = examples.validation(0)
    areas = {tuple(area) for area in examples.index["area"][kept_back]}
    assert not areas & {tuple(area) for area in examples.index["area"][~kept_back]}
    assert examples.index["rail"][kept_back].any()
    assert examples.index["rail"][~kept_back].any()
    assert any((examples.validation(seed) != kept_back).any() for seed in range(1, 9))


def test_an_interrupted_training_gives_the_same_weights(examples, tmp_path):
    once, twice = tmp_path / "once", tmp_path / "twice"
    once.mkdir()
    twice.mkdir()
    whole = train(examples, TrainingSettings(1), once, "CPU")
    with pytest.raises(Cancelled, match=r"Cancelled at step 2 of \d: the same run continues from .*twice"):
        train(examples, TrainingSettings(1), twice, "CPU", Heard(cancel_after=2))
    assert (twice / training.CHECKPOINT).exists()
    resumed = train(examples, TrainingSettings(1), twice, "CPU")
    for name, value in whole.network.state_dict().items():
        assert torch.equal(value, resumed.network.state_dict()[name]), name
    assert resumed.checks == whole.checks
    assert resumed.by_tile == whole.by_tile
    with pytest.raises(ParameterError, match="twice holds another training"):
        train(examples, TrainingSettings(2), twice, "CPU")
    (twice / training.CHECKPOINT).write_bytes(b"cut")
    with pytest.raises(ParameterError, match=r"checkpoint.pt is damaged: delete the folder .*twice and train again"):
        train(examples, TrainingSettings(1), twice, "CPU")


def test_a_full_graphics_card_is_said_in_a_sentence_and_the_checkpoint_stays(examples, tmp_path, monkeypatch):
    with pytest.raises(Cancelled):
        train(examples, TrainingSettings(1), tmp_path, "CPU", Heard(cancel_after=1))
    kept = (tmp_path / training.CHECKPOINT).read_bytes()

    def full(self, features, layers):
        raise torch.cuda.OutOfMemoryError("CUDA out of memory")

    monkeypatch.setattr(training.RandLaNet, "forward", full)
    with pytest.raises(ModelError, match=r"too little free memory for 2 blocks at once: close .* continues from"):
        train(examples, TrainingSettings(1), tmp_path, "CPU")
    assert (tmp_path / training.CHECKPOINT).read_bytes() == kept


def test_a_training_starts_from_weights(examples, tmp_path):
    first, second = tmp_path / "first", tmp_path / "second"
    first.mkdir()
    second.mkdir()
    learned = train(examples, TrainingSettings(1, seed=1), first, "CPU")
    save(tmp_path / "first.npz", learned.network)
    begun = train(examples, TrainingSettings(1, start=tmp_path / "first.npz"), second, "CPU")
    weights = [torch.nn.utils.parameters_to_vector(one.network.parameters()) for one in (learned, begun)]
    moved = (weights[1] - weights[0]).norm() / weights[0].norm()
    assert 1e-4 < moved < 0.1
    with pytest.raises(ParameterError, match="second holds another training"):
        train(examples, TrainingSettings(1), second, "CPU")


def test_the_loss_falls_and_the_output_is_calibrated(examples, tmp_path):
    trained = train(examples, TrainingSettings(6), tmp_path, "CPU")
    losses = [check.loss for check in trained.checks]
    half = len(losses) // 2
    assert np.mean(losses[half:]) < 0.9 * np.mean(losses[:half])
    assert trained.total.f1 > 0.9
    run = training._Run(examples, TrainingSettings(6), *_parts(examples), tmp_path, "cpu")
    run.resume()
    run.network.head[-1].bias.data += 3.0  # everything seems to be rail
    f1 = sum(run.evaluated_by_tile().values(), LabelFigures()).f1
    run.calibrate()
    assert sum(run.evaluated_by_tile().values(), LabelFigures()).f1 >= f1
    best = run.network.head[-1].bias.item()
    run.calibrate()  # nothing is left to change
    assert run.network.head[-1].bias.item() == pytest.approx(best, abs=training.LOGIT_STEP + 1e-6)


def _parts(examples):
    kept_back = examples.validation(0)
    return np.flatnonzero(~kept_back), np.flatnonzero(kept_back)
