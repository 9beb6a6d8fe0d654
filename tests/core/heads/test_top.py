"""The top of a head: the disc that rolls along it, and its profile beyond its ends."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.heads.head_points import HeadPoints, stations_along
from rail_extract.core.heads.sections import Middles
from rail_extract.core.heads.top import TAIL_M, Profile, Top, are_sunk, by_outline, rolling_disc


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


STEP_M = 0.02


def along(count):
    """Chainages in successive bins of the disc."""
    return STEP_M * np.arange(count) + np.where(np.arange(count) > 0, 0.3 * STEP_M, 0.0)


@pytest.mark.parametrize("radius_m", [5.0, 20.0])
def test_the_disc_sags_into_gaps(radius_m):
    """By L² / (8 r) in the middle of a gap of length L."""
    z = np.zeros(150)
    z[50:101] = -0.2
    surface = rolling_disc(along(150), z, radius_m, 0.1)
    assert surface[75] == pytest.approx(-((52 * STEP_M) ** 2) / (8 * radius_m), rel=5e-3)
    np.testing.assert_allclose(np.delete(surface, np.arange(50, 101)), 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_no_point_is_above_the_disc_and_no_place_for_it_is_lower(seed):
    z = np.random.default_rng(seed).normal(0, 0.01, 300)
    centres = np.arange(-200, 500)
    disc = np.sqrt(20.0**2 - (STEP_M * (np.arange(300)[:, None] - centres)) ** 2) - 20.0
    held = (z[:, None] + disc).max(axis=0)
    surface = rolling_disc(along(300), z, 20.0, 0.1)
    np.testing.assert_allclose(surface[100:-100], (held - disc).min(axis=1)[100:-100], atol=1e-9)
    assert (surface >= z - 1e-12).all()


PLACES_M = np.arange(0.0, 80.0, 0.25)
WAVY_M = 0.03 * PLACES_M + 0.01 * np.sin(2 * np.pi * PLACES_M / 60) + np.random.default_rng(3).normal(0, 0.002, 320)


@pytest.mark.parametrize("length_m", [3.0, 4.0, 5.5, 8.0, 11.0])
@pytest.mark.parametrize("start_m", [20.0, 37.3])
def test_sections_that_show_the_web_are_below_the_course_of_the_head(start_m, length_m):
    """In world 10916, few points were on the crowns of far rails, which were 43 mm too low for 8 m."""
    after_m = PLACES_M - start_m
    sunk = (after_m > 0) & (after_m < length_m)
    np.testing.assert_array_equal(are_sunk(PLACES_M, WAVY_M - 0.043 * sunk), sunk)


def test_waves_steps_and_what_stands_on_a_head_are_not_sunk():
    step, vehicle = PLACES_M - 40 > 0, np.abs(PLACES_M - 33) < 3
    for above_m in (0.0, 0.03 * step, 0.05 * vehicle):
        assert not are_sunk(PLACES_M, WAVY_M + above_m).any()
    assert not are_sunk(PLACES_M[:0], WAVY_M[:0]).any()


@pytest.mark.parametrize("below_m", [0.0, 0.03])
def test_no_head_is_lower_than_the_points_on_it(below_m):
    """Far from a tripod, the outline was fitted to one face and the web, and was 3 cm low for 35 m (world 14657)."""
    rng = np.random.default_rng(1)
    t, stations = np.sort(rng.uniform(0, 80, 3200)), stations_along(80.0)
    z, across = rng.normal(0, 0.004, len(t)), rng.uniform(-0.03, 0.03, len(t))
    line = np.array([[0.0, 0.0], [80.0, 0.0]])
    points = HeadPoints(t, across, z, 0.072, line, np.ones((2, len(stations)), dtype=bool))
    shown = np.where(np.abs(stations - 40) < 17, -below_m, 0.0) + rng.normal(0, 0.003, len(stations))
    known = np.full(len(stations), 0.003**-2)
    outline = replace(Middles.unknown(len(stations)), top=shown, top_information=known, top_common=0 * known)
    top = Top(profile_of(stations, 0 * stations), points, np.zeros(len(t)))
    assert np.abs(by_outline(top, outline).course.at(stations)).max() < 0.006
