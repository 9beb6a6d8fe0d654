"""Polylines in plan: stations, projection of points, normals and direction."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.polyline import left_normals, project, resample, starts_at_its_end

ANGLES = st.floats(0, 2 * np.pi)


def arc(radius, length, count=400):
    angle = np.linspace(0, length / radius, count)
    return radius * np.column_stack([np.sin(angle), 1 - np.cos(angle)])


@given(st.integers(0, 2**32 - 1), st.floats(0.3, 20), st.floats(0.01, 3))
@settings(deadline=None)
def test_resampled_stations_are_even_and_keep_the_ends(seed, length, step):
    random = np.random.default_rng(seed)
    vertices = np.cumsum(random.uniform(0, length, (6, 3)), axis=0)
    stations, t = resample(vertices, step)
    np.testing.assert_allclose(stations[[0, -1]], vertices[[0, -1]])
    assert np.diff(t).max() <= step + 1e-9
    assert np.ptp(np.diff(t)) < 1e-9


@given(ANGLES)
def test_feet_have_the_chainage_and_the_offset_of_their_points(angle):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    t, across = np.array([0.3, 2.5, 7.1, 9.9]), np.array([0.05, -0.08, 0.0, 0.02])
    line = np.array([[0.0, 0.0], [10.0, 0.0]]) @ turn.T
    feet = project([line], np.column_stack([t, across]) @ turn.T, 0.1)
    assert feet.point.tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(feet.t, t, atol=1e-9)
    np.testing.assert_allclose(feet.across, across, atol=1e-9)


def test_points_out_of_reach_or_past_an_end_are_left_out():
    line = np.array([[0.0, 0.0], [10.0, 0.0]])
    xy = np.array([[5.0, 0.2], [-0.05, 0.0], [10.05, 0.01], [5.0, 0.09], [1e6, 0.0]])
    assert project([line], xy, 0.1).point.tolist() == [3]


@pytest.mark.parametrize("side", [1, -1])
def test_no_point_on_either_side_of_a_tight_curve_is_lost(side):
    line = arc(25.0, 30.0)
    angle = np.random.default_rng(0).uniform(0.01, 1.19, 3000)
    radius = 25.0 - side * 0.08
    xy = np.column_stack([radius * np.sin(angle), 25.0 - radius * np.cos(angle)])
    feet = project([line], xy, 0.1)
    assert len(feet.t) == len(xy)
    np.testing.assert_allclose(feet.across, side * 0.08, atol=1e-4)
    np.testing.assert_allclose(feet.t, 25.0 * angle[feet.point], atol=1e-3)


def test_points_are_assigned_to_the_nearest_line_and_sorted_along_it():
    lines = [np.array([[0.0, y], [20.0, y]]) for y in (0.0, 0.15, 3.0)]
    random = np.random.default_rng(4)
    xy = np.column_stack([random.uniform(0.1, 19.9, 500), random.uniform(-0.1, 3.1, 500)])
    feet = project(lines, xy, 0.1)
    distance = np.abs(xy[:, 1][:, None] - np.array([0.0, 0.15, 3.0]))
    expected = np.flatnonzero(distance.min(axis=1) <= 0.1)
    assert sorted(feet.point) == expected.tolist()
    # Where two lines are about equally near, either may be chosen.
    clear = np.abs(distance[feet.point, 0] - distance[feet.point, 1]) > 0.02
    np.testing.assert_array_equal(feet.line[clear], distance.argmin(axis=1)[feet.point][clear])
    for number in range(3):
        mine = feet.of(number)
        assert np.all(mine.line == number)
        assert np.all(np.diff(mine.t) >= 0)


def test_normals_point_to_the_left():
    np.testing.assert_allclose(left_normals(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])), [[0, 1]] * 3)


@pytest.mark.parametrize(
    ("step", "turned"),
    [
        ((10, 0), False),
        ((-10, 0), True),
        ((10, -9), False),
        ((-0.1, 10), False),
        ((0.1, -10), True),
        ((-0.2, 10), True),
        ((0.2, -10), False),
    ],
)
def test_lines_start_in_the_west_or_in_the_south_if_they_run_north(step, turned):
    assert starts_at_its_end(np.array([[5.0, 5.0], np.add([5.0, 5.0], step)])) is turned
