"""The smoother: how close it comes, whether its errors hold, and how it bends."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.heads.smoother import BAND, _covariance, smooth

NOISE_M = 0.0008


def measured(course, seed, length_m=60.0, per_m=4.0, noise_m=NOISE_M):
    """Chainages, values with noise, and their information."""
    random = np.random.default_rng(seed)
    t = np.sort(random.uniform(0, length_m, int(per_m * length_m)))
    return t, course(t) + random.normal(0, noise_m, len(t)), np.full(len(t), noise_m**-2)


def grade(t):
    return 0.004 * t + 0.01 * np.sin(2 * np.pi * t / 80)


def waves(t):
    return grade(t) + 0.001 * np.sin(2 * np.pi * t / 6)


def weld(t):
    return grade(t) - 0.003 * np.exp(-np.abs(t - 30) / 0.5)


@pytest.mark.parametrize("course, largest_m", [(grade, 0.0003), (waves, 0.0004), (weld, 0.0004)])
def test_errors_are_small_and_as_large_as_stated(course, largest_m):
    t = np.linspace(0.5, 59.5, 200)
    errors_m, stated_m = [], []
    for seed in range(8):
        found = smooth(*measured(course, seed), 0.0, 60.0)
        errors_m.append(found.at(t) - course(t))
        stated_m.append(found.sigma(t))
    errors_m, stated_m = np.array(errors_m), np.array(stated_m)
    assert np.sqrt(np.mean(errors_m**2)) < largest_m
    within = np.abs(errors_m) / stated_m
    assert np.mean(within < 1) > 0.55
    assert np.mean(within < 2) > 0.9
    assert np.sqrt(np.mean(stated_m**2)) < 2 * np.sqrt(np.mean(errors_m**2))


def test_rails_without_waves_are_smoothed_further_than_those_with_waves():
    t = np.linspace(5, 55, 200)
    smooth_m, rough_m = (smooth(*measured(course, 1), 0.0, 60.0).sigma(t).mean() for course in (grade, waves))
    assert smooth_m < 0.7 * rough_m


def test_the_error_of_a_gap_grows_towards_the_middle():
    t, values, information = measured(grade, 2)
    shown = (t < 24) | (t > 34)
    found = smooth(t[shown], values[shown], information[shown], 0.0, 60.0)
    middle, edge = np.array([29.0]), np.array([22.0])
    assert np.abs(found.at(middle) - grade(middle)) < 3 * found.sigma(middle)
    assert found.sigma(middle) > 3 * found.sigma(edge)


@settings(max_examples=15, deadline=None)
@given(st.floats(-50, 50), st.floats(-0.1, 0.1), st.integers(0, 1000))
def test_level_and_gradient_do_not_matter(level, gradient, seed):
    t, values, information = measured(grade, seed, length_m=20.0)
    first = smooth(t, values, information, -1.0, 21.0)
    tilted = smooth(t, values + level + gradient * t, information, -1.0, 21.0)
    places = np.linspace(-1, 21, 30)
    assert tilted.at(places) == pytest.approx(first.at(places) + level + gradient * places, abs=5e-5)
    assert tilted.sigma(places) == pytest.approx(first.sigma(places), rel=0.02)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_few_values_give_a_course(count):
    t = np.linspace(2.0, 2.4, count)
    found = smooth(t, np.full(count, 5.0), np.full(count, 1e6), 1.0, 3.4)
    assert found.at(np.array([0.0, 2.0, 9.0])) == pytest.approx(5.0, abs=0.001)
    assert np.isfinite(found.sigma(np.array([1.0, 2.0, 3.4]))).all()


def test_the_stated_errors_are_those_of_the_whole_matrix():
    random = np.random.default_rng(5)
    lower = np.tril(np.triu(random.normal(0, 1, (9, 9)), -3)) + 5 * np.eye(9)
    factor = np.array([np.append(np.diag(lower, -apart), np.zeros(apart)) for apart in range(BAND)])
    inverse = np.linalg.inv(lower @ lower.T)
    for apart, row in enumerate(_covariance(factor)):
        assert row[: 9 - apart] == pytest.approx(np.diag(inverse, -apart))
