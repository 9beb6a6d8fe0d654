"""A folded convolution equals a convolution with batch norm; weights of other networks are refused."""

import numpy as np
import pytest
from rail_extract.core.errors import ModelError
from rail_extract.core.frpdf.architecture import EPSILON, fold


def test_a_folded_convolution_equals_convolution_and_batch_norm(random_arrays):
    values = np.random.default_rng(0).random((2, 7, 7)).astype(np.float32)
    for number, suffix in enumerate(("", "_1")):
        convolution = fold(random_arrays)[number][0].convolution
        plain = np.tensordot(random_arrays["layer.0.0.0.weight"], values, 3)
        mean, variance = (random_arrays[f"layer.0.0.1.running_{kind}{suffix}"] for kind in ("mean", "var"))
        scale, shift = random_arrays["layer.0.0.1.weight"], random_arrays["layer.0.0.1.bias"]
        expected = (plain - mean) / np.sqrt(variance + EPSILON) * scale + shift
        found = np.tensordot(convolution.weight, values, 3) + convolution.bias
        np.testing.assert_allclose(found, expected, atol=1e-5)


def changed(name, change):
    return lambda arrays: {**arrays, name: change(arrays[name])}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda arrays: {"layer.0.weight": np.zeros(3, np.float32)}, "'layer.0.0.0.weight'"),
        (changed("layer.0.0.0.weight", lambda array: array[:23]), r"shape \(23, 2, 7, 7\) instead of \(24, 2, 7, 7\)"),
        (changed("layer.3.dilated.1.bias", lambda array: array[:1]), r"bias has the shape \(1,\) instead of \(24,\)"),
        (changed("layer.9.bias", lambda array: array * np.nan), "layer.9.bias contains a value that is not a number"),
        (changed("layer.3.reduce.1.running_mean_1", lambda array: array + np.inf), "running_mean_1 contains a value"),
        (changed("layer.3.reduce.1.running_var_1", lambda array: -array), "layer.3.reduce has a negative variance"),
    ],
)
def test_other_weights_are_refused(random_arrays, change, reason):
    with pytest.raises(ModelError, match=rf"^The weights file does not belong to FRPDF \(.*{reason}.*\): reinstall"):
        fold(change(random_arrays))
