"""Lines that change over to a check rail and back follow their rail; what bends as rails do stays."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.polyline import Polyline, project
from rail_extract.core.vectorize.detours import straighten
from scipy.spatial import cKDTree

LENGTH_M, RAMP_M, CHECK_RAIL_M = 60.0, 2.0, 0.13


def rail(radius_m=np.inf, begins_m=0.0, ends_m=LENGTH_M):
    """Points every 0.1 m of a line that is an arc between two chainages, and straight elsewhere, (n, 2)."""
    t = np.arange(0.0, LENGTH_M + 0.05, 0.1)
    heading = (np.clip(t, begins_m, ends_m) - begins_m) / radius_m
    steps = 0.1 * np.column_stack([np.cos(heading), np.sin(heading)])
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps[:-1], axis=0)])


def led_aside(points, start_m, length_m, aside_m=CHECK_RAIL_M):
    """Lead a line aside between two chainages, over ramps at both ends."""
    own = Polyline(points)
    knots = start_m + np.array([0.0, RAMP_M, length_m - RAMP_M, length_m])
    return points + np.interp(own.t, knots, [0.0, aside_m, aside_m, 0.0])[:, None] * own.normals


def straightened(line):
    """Lead one line past its detours; the cells that show it are as wide as a head."""
    sides = 0.036 * Polyline(line).normals
    network = LineNetwork((line,), line[[0, -1]], np.array([[0, 1]]))
    (only,) = straighten(network, cKDTree(np.concatenate([line + sides, line - sides]))).lines
    return only


def farthest(line, truth):
    """Largest distance of the vertices of a line from another line, metres."""
    return float(np.abs(project([truth], line, 1.0).across).max())


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from([np.inf, 1500.0, 300.0, -190.0]),
    st.floats(12.0, 35.0),
    st.floats(4.5, 8.0),
    st.sampled_from([CHECK_RAIL_M, -CHECK_RAIL_M]),
    st.integers(0, 1000),
)
@example(np.inf, 22.0, 13.0, CHECK_RAIL_M, 0)
def test_a_line_is_led_past_a_check_rail(radius_m, start_m, length_m, aside_m, seed):
    truth = rail(radius_m)
    drawn = led_aside(truth, start_m, length_m, aside_m)
    drawn = drawn + np.random.default_rng(seed).uniform(-0.005, 0.005, drawn.shape)
    assert farthest(drawn, truth) > 0.12
    now = straightened(drawn)
    assert farthest(now, truth) < 0.03
    assert (now[[0, -1]] == drawn[[0, -1]]).all()


def test_each_of_several_detours_is_replaced():
    truth = rail()
    drawn = led_aside(led_aside(truth, 8.0, 5.0), 35.0, 6.0, -CHECK_RAIL_M)
    assert farthest(straightened(drawn), truth) < 0.01


@pytest.mark.parametrize(("radius_m", "length_m"), [(25, 30), (100, 30), (500, 30), (60, 3), (100, 5)])
def test_curves_of_trams_and_turnouts_stay(radius_m, length_m):
    """Without the test of directions, a bridge would cut the last two short."""
    line = rail(radius_m, LENGTH_M / 2, LENGTH_M / 2 + length_m)
    assert straightened(line) is line


def test_of_two_courses_the_longer_one_stays():
    """Between two long parts to the left, a short one is the detour, although it is on the course of the outermost."""
    line = rail()
    aside = led_aside(line, 10.0, 40.0) - led_aside(line, 27.0, 6.0) + line
    now = straightened(aside)
    middle = (now[:, 0] > 20.0) & (now[:, 0] < 40.0)
    np.testing.assert_allclose(now[middle, 1], CHECK_RAIL_M, atol=0.01)


def test_a_course_away_from_all_cells_is_none():
    line = led_aside(rail(), 25.0, 8.0, 0.4)
    assert straightened(line) is line
