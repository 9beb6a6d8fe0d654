"""The smoother: how close it comes, whether its errors hold, and how it bends."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.heads.smoother import (
    BLUNT,
    BLUNT_HEIGHTS,
    SHARP,
    bridge_error,
    smooth,
)

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


def test_errors_of_a_cloud_are_not_followed_but_the_arc_of_a_turnout_is():
    """Errors of 5 mm, alike over 1 to 10 m, about straight track and an arc of 300 m."""
    t, inner = np.arange(0.25, 60.0, 0.25), slice(12, -12)
    arc = np.clip(t - 25.0, 0.0, None) ** 2 / 600.0
    off_m, within = {SHARP.length_m: [], BLUNT.length_m: []}, []
    for seed in range(8):
        random = np.random.default_rng(seed)
        length_m, phase = 10.0 ** random.uniform(0, 1, 40), random.uniform(0, 2 * np.pi, 40)
        errors = 0.005 * np.sqrt(2 / 40) * np.cos(2 * np.pi * t[:, None] / length_m + phase).sum(axis=1)
        values, information = arc + errors + random.normal(0, 0.005, len(t)), np.full(len(t), 0.005**-2)
        for expected in (SHARP, BLUNT):
            found = smooth(t, values, information, 0.0, 60.0, None, expected)
            off_m[expected.length_m].append((found.at(t) - arc)[inner])
        within.append(np.abs(off_m[BLUNT.length_m][-1]) < 2 * found.sigma(t)[inner])
    followed, told_apart = (np.sqrt(np.mean(np.square(off_m[one.length_m]))) for one in (SHARP, BLUNT))
    assert told_apart < 0.75 * followed
    assert told_apart < 0.002
    assert np.mean(within) > 0.9


def test_the_error_of_a_gap_grows_towards_the_middle():
    t, values, information = measured(grade, 2)
    shown = (t < 24) | (t > 34)
    found = smooth(t[shown], values[shown], information[shown], 0.0, 60.0)
    middle, edge = np.array([29.0]), np.array([22.0])
    assert np.abs(found.at(middle) - grade(middle)) < 3 * found.sigma(middle)
    assert found.sigma(middle) > 1.4 * found.sigma(edge)


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


def test_a_line_that_bends_is_straightened_but_not_one_in_a_curve():
    """The third differences of the line count: stairs of a raster bend it, an arc does not."""
    t = np.arange(0, 60.05, 0.1)
    places = np.arange(0.5, 60, 0.5)
    for radius_m in (3000.0, 1e9):
        arc = t**2 / (2 * radius_m)
        line = np.column_stack([t, arc + 0.004 * np.sin(2 * np.pi * t / 1.7)])
        known = np.arange(2.0, 60, 4.0)
        values = -0.004 * np.sin(2 * np.pi * known / 1.7)
        found = smooth(known, values, np.full(len(known), 0.0005**-2), 0.0, 60.0, line)
        left = found.at(places) + 0.004 * np.sin(2 * np.pi * places / 1.7)
        assert np.sqrt(np.mean(left**2)) < 0.0012


def test_a_sharp_arc_that_begins_abruptly_is_kept_by_few_points():
    """World 12969: a tram turnout of 25 m below a drone, with an error of 10 cm per point."""
    t = np.arange(0.0, 22.05, 0.1)
    line = np.column_stack([t, np.clip(t - 8.0, 0.0, None) ** 2 / 50.0])
    off_m = []
    for seed in range(8):
        places, values, information = measured(lambda t: 0.0 * t, seed, 22.0, 4.0, 0.05)
        off_m.append(smooth(places, values, information, 0.0, 22.0, line, BLUNT).at(t))
    assert np.sqrt(np.mean(np.square(off_m))) < 0.025


def test_heights_do_not_follow_a_stray_bin():
    """In a survey by a drone, points 9 m above a rail are classified as rail; the line went up to them."""
    t = np.arange(0.125, 60.0, 0.25)
    heights = np.random.default_rng(0).normal(0, 0.01, len(t))
    heights[120] = 9.0
    course = smooth(t, heights, np.full(len(t), 4 / 0.02**2), -1.0, 61.0, None, BLUNT_HEIGHTS).at(t)
    assert np.abs(np.diff(course) / 0.25).max() < 0.1


def test_a_course_may_turn_where_nothing_is_measured():
    """Cubics that are 0 at both ends of a gap of 10 m, and beyond the last value."""
    found = bridge_error(np.array([0.0, 10.0]), np.array([-3.0, 0.0, 5.0, 8.0, 10.0, 12.0]), 1e-4)
    expected = [27 / 6, 0.0, 5 * 5 * 10 / 12, 2 * 8 * 10 / 12, 0.0, 8 / 6]
    np.testing.assert_allclose(found, 1e-4 * np.array(expected), atol=1e-12)
