"""The top of a head: its profile beyond its ends."""

import numpy as np
import pytest
from rail_extract.core.heads.top import TAIL_M, Profile


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
