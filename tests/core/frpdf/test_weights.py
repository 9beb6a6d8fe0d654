"""Weights on disk: half precision, and what is refused."""

import numpy as np
import pytest
from rail_extract.core.errors import ModelError
from rail_extract.core.frpdf.weights import load_arrays, save_arrays


def test_weights_survive_the_file_in_half_precision(random_arrays, tmp_path):
    save_arrays(tmp_path / "weights.npz", random_arrays)
    loaded = load_arrays(tmp_path / "weights.npz")
    assert loaded.keys() == random_arrays.keys()
    for name, array in random_arrays.items():
        assert loaded[name].dtype == np.float32
        assert np.allclose(loaded[name], array, rtol=2**-11 if array.ndim == 4 else 0, atol=2**-24)
    size = (tmp_path / "weights.npz").stat().st_size
    assert size < 0.55 * sum(array.nbytes for array in random_arrays.values())


def test_missing_and_damaged_weights_are_named(tmp_path):
    with pytest.raises(ModelError, match="gone.npz is missing"):
        load_arrays(tmp_path / "gone.npz")
    (tmp_path / "cut.npz").write_bytes(b"PK\x03\x04 cut")
    with pytest.raises(ModelError, match="cut.npz cannot be read"):
        load_arrays(tmp_path / "cut.npz")
