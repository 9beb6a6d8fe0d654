"""Smooth curves: the minimum of the penalised sum, and the variance of a full inverse."""

import numpy as np
from rail_extract.core.airborne.curve import smooth


def dense(weight, sigma, order):
    difference = np.diff(np.eye(len(weight)), order, axis=0)
    return np.diag(weight) + difference.T @ difference / sigma**2


def test_curve_and_variance_are_those_of_the_full_matrix():
    rng = np.random.RandomState(1)
    values, weight = rng.normal(size=(150, 2)), rng.uniform(0, 100, 150)
    weight[40:50] = 0
    for order in (2, 3):
        found = smooth(values, weight, 0.05, order)
        matrix = dense(weight, 0.05, order)
        assert np.allclose(found.values, np.linalg.solve(matrix, weight[:, None] * values), atol=1e-6)
        inverse, difference = np.linalg.inv(matrix), np.diff(np.eye(150), order, axis=0)
        assert np.allclose(found.variance, np.diag(inverse), rtol=1e-3)
        squares = ((difference @ found.values) ** 2).sum(axis=1)
        assert np.allclose(found.bend - squares, np.diag(difference @ inverse @ difference.T), rtol=1e-3)


def test_each_difference_has_its_own_stiffness():
    t = np.arange(80.0)
    kink = np.maximum(t - 40, 0)[:, None]
    sigma = np.where(np.abs(np.arange(78) - 39) < 2, 1.0, 1e-3)
    assert np.abs(smooth(kink, np.ones(80), sigma, 2).values - kink).max() < 0.3
    assert np.abs(smooth(kink, np.ones(80), 1e-3, 2).values - kink).max() > 1


def test_a_parabola_passes_through_a_curve_of_third_differences():
    t = np.arange(60.0)
    values = np.column_stack([t, 0.01 * t**2])
    assert np.allclose(smooth(values, np.ones(60), 1e-3, 3).values, values, atol=1e-5)
