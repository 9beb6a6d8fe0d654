"""How far two lines are off one steady curve."""

import numpy as np
import pytest
from rail_extract.core.vectorize.steadiness import unsteadiness


def arc(radius_m, start_m, end_m, aside_m=0.0):
    """An arc, or a straight line, that runs east at x = 0."""
    s = np.linspace(start_m, end_m, 60)
    if np.isinf(radius_m):
        return np.column_stack([s, np.full(len(s), aside_m)])
    return np.column_stack([radius_m * np.sin(s / radius_m), radius_m * (1 - np.cos(s / radius_m)) + aside_m])


@pytest.mark.parametrize("radius_m", [np.inf, 200.0, -60.0])
def test_lines_of_one_curve_are_steady(radius_m):
    assert unsteadiness(arc(radius_m, -1, -16), arc(radius_m, 1, 16), 15.0) < 0.01


def test_a_step_to_the_side_and_a_bend_are_not():
    straight = arc(np.inf, -1, -16)
    steps = [unsteadiness(straight, arc(np.inf, 1, 16, aside_m), 15.0) for aside_m in (0.1, 0.2)]
    assert steps[1] == pytest.approx(2 * steps[0], rel=0.05)
    assert steps[0] == pytest.approx(0.025, abs=0.015)
    turn = np.array([[np.cos(0.1), np.sin(0.1)], [-np.sin(0.1), np.cos(0.1)]])
    assert unsteadiness(straight, arc(np.inf, 1, 16) @ turn, 15.0) > 0.05


def test_only_the_given_length_counts():
    bent = np.concatenate([arc(np.inf, 1, 6), [[20.0, 9.0]]])
    straight = arc(np.inf, -1, -16)
    assert unsteadiness(straight, bent, 4.0) < 0.001 < 0.1 < unsteadiness(straight, bent, 15.0)


def test_lines_of_a_few_points_say_nothing():
    assert unsteadiness(arc(np.inf, -1, -1.3), arc(np.inf, 1, 1.3, 0.2), 15.0) == 0.0
