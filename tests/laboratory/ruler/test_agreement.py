"""Agreement of two surveys: the shift between them, what remains, and whether stated errors explain it."""

import numpy as np
import pytest
from rail_extract.core.rails import RailLine, Support
from rail_extract.laboratory.ruler.agreement import agreement


def rail(offset_m, up_m, sigma_m=0.003, sigmaz_m=0.004, left_m=0.0):
    """Lay a rail to the east that wanders, with stations every half metre."""
    t = np.arange(0.0, 60.01, 0.5)
    xyz = np.column_stack([t, left_m + offset_m(t), up_m(t)])
    sigma = np.full(len(t), sigma_m)
    support = Support.of_one_strip(t, np.ones(len(t), dtype=int), sigma, sigmaz_m)
    return RailLine(xyz, 1, 10, 100.0, 1.0, 1.0, 0.0, support=support)


def wave(size_m, shift_m):
    return lambda t: shift_m + np.sqrt(2) * size_m * np.sin(2 * np.pi * t / 6)


def flat(t):
    return np.zeros(len(t))


def test_shift_and_spread_are_measured_and_compared_with_stated_errors():
    found = agreement([rail(flat, flat)], [rail(wave(0.003, 0.02), wave(0.008, -0.03), 0.004, 0.003)])
    assert found.length_m.sum() == pytest.approx(60, abs=0.1)
    assert found.across_m.mean() == pytest.approx(0.02, abs=1e-4)
    assert found.height_m.mean() == pytest.approx(-0.03, abs=1e-4)
    assert found.across_m.std() == pytest.approx(0.003, rel=0.03)
    assert found.sigma_m == pytest.approx(0.005)
    assert found.ratios == pytest.approx((0.003 / 0.005, 0.008 / 0.005), rel=0.03)
    assert "20.0 ± 2.9" in found.text() and "-30.0 ± 7.8" in found.text()


def test_rails_of_other_tracks_are_not_compared():
    assert agreement([rail(flat, flat)], [rail(flat, flat, left_m=1.5)]) is None
    assert agreement([], [rail(flat, flat)]) is None
    both = agreement([rail(flat, flat)], [rail(flat, flat, left_m=0.1), rail(flat, flat, left_m=1.5)])
    assert both.length_m.sum() == pytest.approx(60, abs=0.1)
