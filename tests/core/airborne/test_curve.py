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


def test_each_difference_has_its_own_stiffness():
    t, rows = np.arange(80.0), differences(80, 2)
    kink = np.maximum(t - 40, 0)[:, None]
    sigma = np.where(np.abs(np.arange(78) - 39) < 2, 1.0, 1e-3)
    assert np.abs(smooth(kink, np.ones(80), rows, sigma).values - kink).max() < 0.3
    assert np.abs(smooth(kink, np.ones(80), rows, 1e-3).values - kink).max() > 1


def test_a_parabola_passes_through_a_curve_of_third_differences():
    t = np.arange(60.0)
    values = np.column_stack([t, 0.01 * t**2])
    assert np.allclose(smooth(values, np.ones(60), differences(60, 3), 1e-3).values, values, atol=1e-5)


def test_fewer_places_than_a_difference_needs_stay_where_they_are():
    values = np.array([[1.0, 2.0], [3.0, 5.0]])
    assert differences(2, 3).shape == (0, 2)
    assert np.allclose(smooth(values, np.ones(2), differences(2, 3), 0.1).values, values)
