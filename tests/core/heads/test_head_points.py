"""What the points of a head show of it, on heads whose slope and noise are known."""

import numpy as np
import pytest
from rail_extract.core.heads.edges import station_count
from rail_extract.core.heads.head_points import MIN_ON_HEAD, HeadPoints, near_lines
from rail_extract.core.heads.top import fit_crown

WIDTH = 0.072


def head(length_m=20.0, per_metre=300, half_m=0.036, noise_m=0.001, slope=0.0, start_m=0.0, seed=1):
    """Points of a head: chainage, offset, and height above the level of the axis."""
    random = np.random.default_rng(seed)
    count = int(length_m * per_metre)
    t = start_m + np.sort(random.uniform(0, length_m, count))
    across = random.uniform(-half_m, half_m, count)
    return t, across, slope * across + random.normal(0, noise_m, count)


def near(t, across, z):
    """Points near a line along the x axis."""
    line = np.array([[0.0, 0.0], [20.0, 0.0]])
    return HeadPoints(t, across, z, WIDTH, line, np.ones((2, station_count(20.0)), dtype=bool))


def test_points_belong_to_the_nearest_line_in_order_along_it():
    lines = [np.array([[0.0, y], [10.0, y]]) for y in (0.0, 0.1)]
    xyz = np.array([[7.0, 0.02, 1.0], [3.0, 0.09, 2.0], [2.0, -0.03, 3.0], [5.0, 1.0, 4.0]])
    one, other = near_lines(lines, xyz, np.array([WIDTH, 0.06]), np.array([4, 5, 6, 7]))
    np.testing.assert_allclose([one.t, one.across, one.z], [[2, 7], [-0.03, 0.02], [3, 1]])
    np.testing.assert_allclose([other.t, other.across, other.z], [[3], [-0.01], [2]])
    assert (one.strips.tolist(), other.strips.tolist()) == ([6, 4], [5])
    assert (one.width_m, other.width_m, one.length_m) == (WIDTH, 0.06, 10.0)
    assert not one.free[1].any() and one.free[0].all() and not other.free[0].any()
    assert one.within(0.3).tolist() == [False, True]
    assert one[one.within(0.3)].strips.tolist() == [4]


def test_points_on_the_top_are_told_from_faces_and_weeds():
    t, across, z = head(noise_m=0.001, slope=0.05)
    below, above = slice(0, None, 10), slice(5, None, 50)
    z[below] -= 0.012
    z[above] += 0.012
    top, noise_m = near(t, across, z).top
    assert noise_m == pytest.approx(0.0011, abs=0.0002)
    assert not top[below].any()
    assert not top[above].any()
    rest = np.ones(len(t), dtype=bool)
    rest[below] = rest[above] = False
    assert top[rest].mean() > 0.99


def test_the_limits_of_the_top_grow_with_the_noise():
    top, noise_m = near(*head(noise_m=0.008)).top
    assert noise_m == pytest.approx(0.008, rel=0.1)
    assert top.mean() == pytest.approx(0.932, abs=0.01)  # between 1.5 standard deviations below and 3 above


@pytest.mark.parametrize(("count", "is_enough"), [(MIN_ON_HEAD - 1, False), (MIN_ON_HEAD, True)])
def test_the_top_needs_some_points_on_the_head(count, is_enough):
    t, across, z = head(length_m=1.0, per_metre=count)
    top, _ = near(t, across, z).top
    assert top.any() == is_enough
    central = across / 4  # all of them on the crown
    assert np.isfinite(near(t, central, z).in_frame()[1]).all() == is_enough
    assert near(t, across, z - 0.02 * (np.abs(across) > 0.02)).is_blended == is_enough


@pytest.mark.parametrize(("fall_m", "is_one"), [(0.003, False), (0.02, True)])
def test_beams_that_blend_lower_both_rims(fall_m, is_one):
    t, across, z = head(half_m=0.05)
    fall = fall_m * np.minimum(np.abs(across) / (0.5 * WIDTH), 1) ** 2
    assert near(t, across, z - fall).is_blended == is_one
    assert not near(t, across, z - 2 * np.maximum(across, 0)).is_blended  # one rim: the line is off the head
    found = fit_crown(near(t, across, z - fall)).fall(across)
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
    assert near(t[kept], across[kept], z[kept]).is_blended == is_one


@pytest.mark.parametrize("slope", [-0.05, 0.05])
def test_the_frame_of_a_head_is_turned_with_it(slope):
    t, across, z = head(slope=slope, half_m=0.05)
    left, up = near(t, across, z).in_frame()
    assert up == pytest.approx(0.0, abs=0.006)
    assert np.abs(up[np.abs(across) < 0.03]).mean() < 0.0012
    assert left == pytest.approx(across, abs=0.001)
    side = np.full(len(t), 0.0)
    side[::20] = 0.03  # points of a face hang 30 mm below the top
    left, up = near(t, across, z - side).in_frame()
    assert (left - across)[::20] == pytest.approx(-0.03 * slope, abs=0.0006)


def test_what_is_known_of_a_head_does_not_depend_on_its_height_and_gradient():
    t, across, z = head(half_m=0.05)
    blended = z - 0.02 * np.minimum(np.abs(across) / (0.5 * WIDTH), 1) ** 2
    risen_m = 7.0 + 0.03 * t
    for points in (z, blended):
        assert near(t, across, points + risen_m).is_blended == near(t, across, points).is_blended
        fall, own = (fit_crown(near(t, across, one)).fall(across) for one in (points + risen_m, points))
        np.testing.assert_allclose(fall, own, atol=0.0005)
    (top, noise_m), (own_top, own_noise_m) = (near(t, across, one).top for one in (z + risen_m, z))
    assert np.mean(top == own_top) > 0.99 and noise_m == pytest.approx(own_noise_m, rel=0.1)
    up, own_up = (near(t, across, one).in_frame()[1] for one in (z + risen_m, z))
    inner = (t > 0.5) & (t < 19.5)  # the level of the first and last half bin is that of their middle
    np.testing.assert_allclose(up[inner], own_up[inner], atol=0.003)
