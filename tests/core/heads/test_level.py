"""Level, noise and slope across of a head, on heads whose slope and noise are known."""

import numpy as np
import pytest
from rail_extract.core.heads.level import (
    MIN_NOISE_M,
    MIN_ON_HEAD,
    cross_slope,
    fit_crown,
    in_head_frame,
    is_blended,
    medians,
    on_top,
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


def test_points_on_the_top_are_told_from_faces_and_weeds():
    t, across, z = head(noise_m=0.001, slope=0.05)
    below, above = slice(0, None, 10), slice(5, None, 50)
    z[below] -= 0.012
    z[above] += 0.012
    top, noise_m = on_top(t, across, z, WIDTH)
    assert noise_m == pytest.approx(0.0011, abs=0.0002)
    assert not top[below].any()
    assert not top[above].any()
    rest = np.ones(len(t), dtype=bool)
    rest[below] = rest[above] = False
    assert top[rest].mean() > 0.99


def test_the_limits_of_the_top_grow_with_the_noise():
    top, noise_m = on_top(*head(noise_m=0.008), WIDTH)
    assert noise_m == pytest.approx(0.008, rel=0.1)
    assert top.mean() == pytest.approx(0.932, abs=0.01)  # between 1.5 standard deviations below and 3 above


@pytest.mark.parametrize(("count", "is_enough"), [(MIN_ON_HEAD - 1, False), (MIN_ON_HEAD, True)])
def test_the_top_needs_some_points_on_the_head(count, is_enough):
    t, across, z = head(length_m=1.0, per_metre=count)
    top, _ = on_top(t, across, z, WIDTH)
    assert top.any() == is_enough
    central = across / 4  # all of them on the crown
    assert np.isfinite(in_head_frame(t, central, z, WIDTH)[1]).all() == is_enough
    assert is_blended(t, across, z - 0.02 * (np.abs(across) > 0.02), WIDTH) == is_enough


@pytest.mark.parametrize(("fall_m", "is_one"), [(0.003, False), (0.02, True)])
def test_beams_that_blend_lower_both_rims(fall_m, is_one):
    t, across, z = head(half_m=0.05)
    fall = fall_m * np.minimum(np.abs(across) / (0.5 * WIDTH), 1) ** 2
    assert is_blended(t, across, z - fall, WIDTH) == is_one
    assert not is_blended(t, across, z - 2 * np.maximum(across, 0), WIDTH)  # one rim: the line is off the head
    found = fit_crown(t, across, z - fall, WIDTH).fall(across)
    if is_one:
        rim = np.abs(np.abs(across) - 0.3 * WIDTH) < 0.001
        assert found[rim] == pytest.approx(0.02 * 0.6**2, abs=0.0015)
        assert found.max() == pytest.approx(found[np.abs(across) > 0.3 * WIDTH].min())
    else:
        assert found.max() == pytest.approx(fall_m * 0.6**2, abs=0.0003)


@pytest.mark.parametrize(("bend", "sides", "is_one"), [(8.0, (1, -1), True), (1.0, (1, -1), False), (8.0, (1,), False)])
def test_images_blur_a_head_beyond_its_rims(bend, sides, is_one):
    t, across, z = head(half_m=0.058)
    kept = (np.abs(across) <= 0.5 * WIDTH) | np.isin(np.sign(across), sides)
    z = z - 0.5 * bend * across**2
    assert is_blended(t[kept], across[kept], z[kept], WIDTH) == is_one


@pytest.mark.parametrize("slope", [-0.05, 0.05])
def test_the_frame_of_a_head_is_turned_with_it(slope):
    t, across, z = head(slope=slope, half_m=0.05)
    left, up = in_head_frame(t, across, z, WIDTH)
    assert up == pytest.approx(0.0, abs=0.006)
    assert np.abs(up[np.abs(across) < 0.03]).mean() < 0.0012
    assert left == pytest.approx(across, abs=0.001)
    side = np.full(len(t), 0.0)
    side[::20] = 0.03  # points of a face hang 30 mm below the top
    left, up = in_head_frame(t, across, z - side, WIDTH)
    assert (left - across)[::20] == pytest.approx(-0.03 * slope, abs=0.0006)


def test_what_is_known_of_a_head_does_not_depend_on_its_height_and_gradient():
    t, across, z = head(half_m=0.05)
    blended = z - 0.02 * np.minimum(np.abs(across) / (0.5 * WIDTH), 1) ** 2
    risen_m = 7.0 + 0.03 * t
    for points in (z, blended):
        assert is_blended(t, across, points + risen_m, WIDTH) == is_blended(t, across, points, WIDTH)
        fall, own = (fit_crown(t, across, one, WIDTH).fall(across) for one in (points + risen_m, points))
        np.testing.assert_allclose(fall, own, atol=0.0005)
    (top, noise_m), (own_top, own_noise_m) = (on_top(t, across, one, WIDTH) for one in (z + risen_m, z))
    assert np.mean(top == own_top) > 0.99 and noise_m == pytest.approx(own_noise_m, rel=0.1)
    up, own_up = (in_head_frame(t, across, one, WIDTH)[1] for one in (z + risen_m, z))
    inner = (t > 0.5) & (t < 19.5)  # the level of the first and last half bin is that of their middle
    np.testing.assert_allclose(up[inner], own_up[inner], atol=0.003)


def test_the_median_of_each_group_is_that_of_its_values():
    random = np.random.default_rng(5)
    count = np.concatenate([[1, 2, 3, 400], random.integers(1, 90, 50)])
    first = np.cumsum(count) - count
    values = random.normal(size=count.sum())
    expected = [np.sort(values[start : start + size])[size // 2] for start, size in zip(first, count)]
    np.testing.assert_array_equal(medians(values, first, count), expected)
