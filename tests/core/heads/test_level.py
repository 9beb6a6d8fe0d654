"""Level, noise and slope across of a head, on heads whose slope and noise are known."""

import numpy as np
import pytest
from rail_extract.core.heads.level import (
    MIN_NOISE_M,
    cross_slope,
    medians,
    robust_sigma,
    rough_level,
)

WIDTH = 0.072


def head(length_m=20.0, per_metre=300, half_m=0.036, noise_m=0.001, slope=0.0, start_m=0.0, seed=1):
    """Points of a head: chainage, offset, and height above the level of the axis."""
    random = np.random.default_rng(seed)
    count = int(length_m * per_metre)
    t = start_m + np.sort(random.uniform(0, length_m, count))
    across = random.uniform(-half_m, half_m, count)
    return t, across, slope * across + random.normal(0, noise_m, count)


@pytest.mark.parametrize("slope", [-0.08, 0.0, 0.05])
@pytest.mark.parametrize("start_m", [0.0, 1000.3])
def test_the_slope_across_is_found_wherever_the_head_is(slope, start_m):
    t, across, z = head(slope=slope, start_m=start_m)
    found = cross_slope(t, across, z, WIDTH)
    assert found.shape == t.shape
    assert found == pytest.approx(slope, abs=0.006)


def test_the_slope_follows_a_change_along_the_line():
    t, across, z = head(length_m=40.0)
    z = z + np.where(t < 20, 0.06, -0.06) * across
    found = cross_slope(t, across, z, WIDTH)
    assert found[t < 16] == pytest.approx(0.06, abs=0.008)
    assert found[t > 24] == pytest.approx(-0.06, abs=0.008)


def test_few_points_show_hardly_any_slope():
    """The prior keeps the slope small where noise alone would determine it."""
    t, across, z = head(per_metre=3, noise_m=0.02)
    assert np.abs(cross_slope(t, across, z, WIDTH)).max() < 0.15


def test_the_noise_is_that_of_most_values():
    values = np.random.default_rng(2).normal(5.0, 0.004, 20_000)
    values[:2000] += 1.0
    assert robust_sigma(values) == pytest.approx(0.0047, abs=0.0006)
    assert robust_sigma(np.zeros(9)) == robust_sigma(np.empty(0)) == MIN_NOISE_M


@pytest.mark.parametrize("start_m", [0.0, 500.2])
def test_the_rough_level_follows_a_gradient_and_not_weeds(start_m):
    t, _, z = head(start_m=start_m)
    z = z + 0.03 * (t - start_m)
    weeds = (t > start_m + 8) & (t < start_m + 8.9)
    level = rough_level(t, z + 0.2 * weeds)
    assert level == pytest.approx(0.03 * (t - start_m), abs=0.02)


def test_a_rail_on_a_bridge_does_not_lift_the_level():
    t, _, z = head(length_m=40.0)
    z = np.where((t > 15) & (t < 20), z + 6.0, z)
    assert rough_level(t, z) == pytest.approx(0.0, abs=0.01)


def test_the_median_of_each_group_is_that_of_its_values():
    random = np.random.default_rng(5)
    count = np.concatenate([[1, 2, 3, 400], random.integers(1, 90, 50)])
    first = np.cumsum(count) - count
    values = random.normal(size=count.sum())
    expected = [np.sort(values[start : start + size])[size // 2] for start, size in zip(first, count)]
    np.testing.assert_array_equal(medians(values, first, count), expected)
