"""Errors of single points and misalignment, told apart by what partitions leave."""

import numpy as np
import pytest
from rail_extract.core.alignment.noise import Noise
from rail_extract.core.alignment.structure import CANT, PLAN, Signal, find_structure, noise_of

S = np.arange(0.0, 1200.0)


def errors(noise, seed):
    random = np.random.default_rng(seed)
    shared = np.zeros(len(S))
    if noise.shared_m:
        covariance = noise.covariance(np.abs(S[:, None] - S)) + 1e-12 * np.eye(len(S))
        shared = np.linalg.cholesky(covariance) @ random.standard_normal(len(S))
    return shared + noise.white_m * random.standard_normal(len(S))


@pytest.mark.parametrize("truth", [Noise(0.002), Noise(0.001, 0.003, 8.0)])
def test_the_noise_of_a_curve_is_found(truth):
    y = np.where(S > 500, (S - 500) ** 2 / 1200, 0.0)
    found = [
        noise_of(Signal(S, y + errors(truth, seed), np.ones(len(S)), PLAN), 0.01)[0].effective_m(1.0)
        for seed in range(3)
    ]
    assert np.median(found) == pytest.approx(truth.effective_m(1.0), rel=0.35)


def test_errors_that_only_neighbours_share_do_not_make_elements():
    s, random = np.arange(280.0), np.random.default_rng(3)
    kernel = np.exp(-2.0 * (np.arange(-12, 13) / 4.0) ** 2)
    shared = np.convolve(random.standard_normal(len(s) + 24), kernel, mode="valid") / np.sqrt(np.sum(kernel**2))
    cant = np.interp(s, [20.0, 110.0, 170.0, 260.0], [0.0, 0.110, 0.110, 0.0]) + 0.0005 * shared
    chain, found = find_structure(Signal(s, cant, np.ones(len(s)), CANT), 0.005, 5.0, True)
    np.testing.assert_allclose(chain.p, [20, 110, 170, 260], atol=2.5)
    assert found.shared_m == pytest.approx(0.0005, rel=0.5)
