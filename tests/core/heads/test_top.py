"""The top of a head: its profile beyond its ends, and the points that are on it."""

import numpy as np
import pytest
from rail_extract.core.heads import top
from rail_extract.core.heads.head_points import HeadPoints
from rail_extract.core.heads.top import MIN_POINTS, PROFILE_BIN_M, TAIL_M, Profile, _under_disc, find_top, smoothed

WIDTH = 0.072


def profile_of(t, z):
    return Profile(t, z, np.full(len(t), 0.001))


def test_a_profile_goes_on_with_its_slope_for_a_metre_and_is_level_then(monkeypatch):
    monkeypatch.setattr(top, "TAIL_M", 2.0)
    profile = profile_of(np.linspace(10, 20, 101), 0.03 * np.linspace(10, 20, 101) + 5)
    heights = profile.at(np.array([0.0, 8.0, 9.0, 10.0, 15.0, 20.0, 21.0, 22.0, 30.0]))
    assert heights == pytest.approx(5 + 0.03 * np.array([8, 8, 9, 10, 15, 20, 21, 22, 22]))


def test_each_end_has_its_own_slope():
    t = np.linspace(0, 10, 101)
    profile = profile_of(t, np.where(t < 5, 0.02 * t, 0.1 - 0.04 * (t - 5)))
    assert profile.at(np.array([-TAIL_M, 10 + TAIL_M])) == pytest.approx([-0.02, -0.14])


def test_a_profile_shorter_than_its_tail_is_level_beyond_its_ends():
    profile = profile_of(np.array([0.0, 0.9]), np.array([0.0, 0.09]))
    assert profile.at(np.array([-1.0, 0.45, 2.0])) == pytest.approx([0.0, 0.045, 0.09])
    assert profile_of(np.array([0.0, 1.0]), np.array([0.0, 0.1])).at(np.array([2.0])) == pytest.approx([0.2])


def test_a_profile_averages_the_points_of_a_bin():
    t = np.array([0.05, 0.15, 2.05, 2.15, 2.25, 2.35])
    profile = smoothed(t, np.array([1.0, 3.0, 4.0, 4.0, 6.0, 6.0]), 0.01)
    assert profile.t == pytest.approx([0.1, 2.1, 2.3])
    assert PROFILE_BIN_M == 0.25
    assert profile.z == pytest.approx([2.0, 4.0, 6.0], abs=0.01)


def near(t, across, z):
    """Points near a line along the x axis, numbered."""
    line, free = np.array([[0.0, 0.0], [20.0, 0.0]]), np.ones((2, 81), dtype=bool)
    return HeadPoints(t, across, z, WIDTH, line, free, np.arange(len(t)))


def points(count=4000, noise_m=0.002, seed=3):
    random = np.random.default_rng(seed)
    t = np.sort(random.uniform(0, 20, count))
    across = random.uniform(-0.036, 0.036, count)
    return t, across, 0.02 * t + 0.05 * across + random.normal(0, noise_m, count)


@pytest.mark.parametrize("smoothing_m", [None, 3.0])
@pytest.mark.parametrize("noise_m", [0.001, 0.004])
def test_the_height_is_that_on_the_axis_without_faces_and_weeds(noise_m, smoothing_m):
    t, across, z = points(noise_m=noise_m)
    z[::15] -= 0.04
    z[7::50] += 0.05
    top = find_top(near(t, across, z), 0.3, 0.03, smoothing_m)
    stations = np.linspace(1, 19, 50)
    error_m = top.course.at(stations) - 0.02 * stations
    assert np.abs(error_m).max() < 0.25 * noise_m + 0.0002
    assert np.abs(error_m / top.course.sigma(stations)).max() < 4
    assert np.median(top.slope) == pytest.approx(0.05, abs=0.01)
    on_top = np.isin(np.arange(len(t)), top.points.strips)
    assert not on_top[::15].any()
    assert not on_top[7::50].any()
    assert on_top.mean() > 0.9


@pytest.mark.parametrize("count", [MIN_POINTS - 1, 40])
def test_too_few_points_show_no_top(count):
    found = find_top(near(*points(count)), 0.3, 0.03, None)
    assert (found is None) == (count < MIN_POINTS)


@pytest.mark.parametrize("noise_m", [0.0, 0.002, 0.0045])
def test_points_on_top_are_as_far_below_the_disc_as_their_noise_explains(noise_m):
    random = np.random.default_rng(1)
    t = np.sort(random.uniform(0, 20, 20_000))
    z = random.normal(0, noise_m, len(t))
    z[:: len(t) // 40] = 5 * noise_m  # the disc rests on these
    limit_m = min(0.03, max(0.01, 6.0 * noise_m))
    probes = np.arange(3, len(t), 500)
    for depth_m, is_on_top in ((0.8 * limit_m, True), (1.25 * limit_m, False)):
        z[probes] = 5 * noise_m - depth_m
        found, noise = _under_disc(t, z, 0.3, 0.03)
        assert np.mean(found[probes] == is_on_top) > 0.9
        assert noise == pytest.approx(max(noise_m, 0.001), abs=0.0006)
