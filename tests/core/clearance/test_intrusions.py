"""Depth of surfaces: plates, poles and bushes."""

import numpy as np
import pytest
from rail_extract.core.clearance.intrusions import surface_of

NOISE_M = 0.005


def found(place):
    """Return the surface of points beside a profile whose side is at v = 0."""
    depth = -place[:, 1]
    centre = np.median(place[np.argsort(-depth)[:6]], axis=0)
    return surface_of(place, depth, centre, np.array([-1.0, 0.0]), NOISE_M, lambda one: -one[:, 1])


def pole(rng, per_m2, radius=0.055, depth=0.020):
    count = rng.poisson(per_m2 * np.pi * radius * 0.7)
    turn = rng.uniform(-np.pi / 2, np.pi / 2, count)
    place = np.column_stack([radius * np.sin(turn), radius * (1 - np.cos(turn)) - depth, rng.uniform(1, 1.7, count)])
    return place + NOISE_M * rng.standard_normal(place.shape)


def test_a_plate_is_as_deep_as_it_stands():
    rng = np.random.RandomState(1)
    errors, sigmas = [], []
    for _ in range(80):
        place = np.column_stack([rng.uniform(-0.25, 0.25, 200), np.full(200, -0.03), rng.uniform(1, 1.7, 200)])
        one = found(place + NOISE_M * rng.standard_normal(place.shape))
        errors.append(one.depth_m - 0.03)
        sigmas.append(one.sigma_m)
    assert abs(np.mean(errors)) < 1e-3
    assert np.std(errors) < 1.5e-3
    assert np.median(sigmas) < 1e-3


@pytest.mark.parametrize("per_m2", [600, 1000])
def test_a_thin_pole_is_as_deep_as_its_nearest_line(per_m2):
    rng = np.random.RandomState(2)
    made = [found(pole(rng, per_m2)) for _ in range(80)]
    errors = np.array([one.depth_m - 0.02 for one in made])
    assert abs(np.mean(errors)) < 1e-3
    assert np.sqrt(np.mean(errors**2)) < 3e-3


def test_leaves_have_no_surface_and_a_large_error():
    rng = np.random.RandomState(3)
    place = np.column_stack([rng.uniform(-0.1, 0.1, 80), rng.uniform(-0.1, 0.1, 80), rng.uniform(1, 1.5, 80)])
    one = found(place)
    assert one.depth_m == pytest.approx(np.sort(-place[:, 1])[-3], abs=0.03)
    assert one.sigma_m >= 2 * NOISE_M or one.depth_m < 0.1


def test_few_points_are_not_sure():
    place = np.array([[0.0, -0.10, 1.0], [0.01, -0.11, 1.0], [0.0, -0.09, 1.02], [0.02, -0.1, 1.01]])
    one = found(place)
    assert not one.is_sure
    assert one.depth_m == pytest.approx(0.10, abs=0.01)
