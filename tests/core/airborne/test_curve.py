"""Smooth curves: the minimum of the penalised sum, and the covariance of a full inverse."""

import numpy as np
from rail_extract.core.airborne.curve import differences, smooth


def test_curve_and_covariance_are_those_of_the_full_matrix():
    rng = np.random.RandomState(1)
    values, weight = rng.normal(size=(150, 2)), rng.uniform(0, 100, 150)
    weight[40:50] = 0
    for order in (2, 3):
        found = smooth(values, weight, differences(150, order), 0.05)
        difference = np.diff(np.eye(150), order, axis=0)
        matrix = np.diag(weight) + difference.T @ difference / 0.05**2
        inverse = np.linalg.inv(matrix)
        assert np.allclose(found.values, inverse @ (weight[:, None] * values), atol=1e-6)
        assert np.allclose(found.variance, np.diag(inverse), rtol=1e-6)
        squares = ((difference @ found.values) ** 2).sum(axis=1)
        assert np.allclose(found.bend - squares, np.diag(difference @ inverse @ difference.T), rtol=1e-5)
