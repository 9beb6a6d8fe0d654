"""The top of a head: the disc that rolls along it, and its profile beyond its ends."""

import numpy as np
import pytest
from rail_extract.core.heads.top import TAIL_M, Profile, rolling_disc


def profile_of(t, z):
    return Profile(t, z, np.full(len(t), 0.001))


def test_each_end_has_its_own_slope():
    t = np.linspace(0, 10, 101)
    profile = profile_of(t, np.where(t < 5, 0.02 * t, 0.1 - 0.04 * (t - 5)))
    assert profile.at(np.array([-TAIL_M, 10 + TAIL_M])) == pytest.approx([-0.02, -0.14])


def test_a_profile_shorter_than_its_tail_is_level_beyond_its_ends():
    profile = profile_of(np.array([0.0, 0.9]), np.array([0.0, 0.09]))
    assert profile.at(np.array([-1.0, 0.45, 2.0])) == pytest.approx([0.0, 0.045, 0.09])
    assert profile_of(np.array([0.0, 1.0]), np.array([0.0, 0.1])).at(np.array([2.0])) == pytest.approx([0.2])


@pytest.mark.parametrize("radius_m", [5.0, 20.0])
def test_the_disc_rests_on_the_highest_points_and_sags_into_gaps(radius_m):
    """By L² / (8 r) in the middle of a gap of length L."""
    t = np.concatenate([np.arange(0.01, 1.0, 0.02), [1.51], np.arange(2.01, 3.0, 0.02)])
    z = np.where(np.isin(np.arange(len(t)), [50]), -0.1, 0.0)
    surface = rolling_disc(t, z, radius_m, 0.1)
    assert surface[50] == pytest.approx(-(1.02**2) / (8 * radius_m), abs=2e-4)
    np.testing.assert_allclose(np.delete(surface, 50), 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_no_point_is_above_the_disc_and_no_place_for_it_is_lower(seed):
    random = np.random.default_rng(seed)
    t, z = np.arange(0.01, 6.0, 0.02), random.normal(0, 0.01, 300)
    surface = rolling_disc(t, z, 20.0, 0.03)
    apart = t[:, None] - t[None, :]
    disc = np.sqrt(20.0**2 - apart**2) - 20.0
    centres = (z[None, :] + disc).max(axis=1)
    np.testing.assert_allclose(surface, (centres[:, None] - disc).min(axis=0), atol=1e-9)
    assert (surface >= z).all()
