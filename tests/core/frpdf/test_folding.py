"""A folded convolution equals a convolution with batch norm; weights of other networks are refused."""

import numpy as np
import pytest
from rail_extract.core.errors import ModelError
from rail_extract.core.frpdf.folding import EPSILON, fold


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


def test_weights_of_another_network_are_refused():
    with pytest.raises(ModelError, match="does not belong to FRPDF .'layer.0.0.1.running_mean'.: reinstall"):
        fold({"layer.0.weight": np.zeros(3, np.float32)})
