"""The folder of a training: what it holds is used again only if it is whole."""

import numpy as np
import pytest
from rail_extract.core.classify.settings import Settings
from rail_extract.core.clouds.points import ask
from rail_extract.core.progress import Progress, Recording
from rail_extract.core.standards import SEARCHED_CLASSES
from rail_extract.laboratory.scenes.las import write_las
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, with_track

pytest.importorskip("torch")

from rail_extract.core.labelling.training import Plan, _examples  # noqa: E402


@pytest.mark.parametrize("is_damaged", [False, True])
def test_damaged_blocks_are_cut_again(tmp_path, is_damaged):
    rng = np.random.RandomState(3)
    xyz, on = with_track(flat(12.0, rng=rng, per_m2=100), 1.435, 0.072, 0.3)
    path = write_las(tmp_path / "labelled.las", rough(xyz, rng), classification=np.where(on, 10, 2))
    request = ask([path], SEARCHED_CLASSES)
    progress = Recording(Progress())
    values = request, Settings((1.435,), 0.072), Plan((10,), 1, 0, "CPU"), tmp_path / "rails_training", progress
    first = _examples(*values)
    if is_damaged:
        data = bytearray((first.folder / "0.npy").read_bytes())
        data[-9] ^= 255
        (first.folder / "0.npy").write_bytes(data)
    again = _examples(*values)
    assert np.array_equal(first.index, again.index)
    assert bool(progress.warnings) == is_damaged
    assert all("is damaged: the cloud is cut into blocks again" in text for text in progress.warnings)
    assert again.block(0)["rail"].sum() > 0
