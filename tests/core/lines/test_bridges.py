"""Bridges: a curve between the ends of two lines, and how much of them it replaces."""

import numpy as np
import pytest
from rail_extract.core.lines.bridges import FIT_M, STAIRS_M, bridge
from rail_extract.core.lines.ends import STEP_M


def lines(gap_m=1.0, astray=0, radius_m=None):
    """Two lines from a gap inward; the first `astray` points of the first one are drawn aside."""
    t = np.arange(0, 2 * FIT_M, STEP_M)
    ends = [np.column_stack([side * (gap_m / 2 + t), np.zeros(len(t))]) for side in (-1, 1)]
    ends[0][:astray, 1] += 2.5 * STAIRS_M
    if radius_m:
        for end in ends:
            end[:, 1] += end[:, 0] ** 2 / (2 * radius_m)
    return ends


@pytest.mark.parametrize("gap_m", [0.5, 1.03, 3.0])
def test_points_of_a_bridge_follow_the_ends_at_even_steps(gap_m):
    one, other = lines(gap_m)
    found = bridge(one, other)
    whole = np.concatenate([one[:1], found.points, other[:1]])
    steps = np.hypot(*np.diff(whole, axis=0).T)
    assert steps.max() <= STEP_M * 1.001
    assert np.ptp(steps) < 1e-9
    assert found.cuts_m == (0.0, 0.0)
    assert found.cost == pytest.approx(gap_m, abs=1e-6)


def test_what_was_drawn_aside_is_cut_off_and_nothing_else():
    one, other = lines(astray=7)
    found = bridge(one, other)
    assert found.cuts_m[1] == 0.0
    cut_m = 7 * STEP_M
    assert cut_m <= found.cuts_m[0] < cut_m + 3 * STAIRS_M
    assert found.points[0, 0] == pytest.approx(one[7, 0] + STEP_M, abs=0.3 * STEP_M)
    held = bridge(one, other, held=True)
    assert held.cuts_m == (0.0, 0.0)
    assert held.points[0, 0] > one[0, 0]


def test_a_curve_is_followed():
    one, other = lines(2.0, radius_m=200.0)
    found = bridge(one, other)
    assert np.abs(found.points[:, 1] - found.points[:, 0] ** 2 / 400).max() < 1e-4


def test_no_bridge_turns_back_or_leads_to_another_rail():
    one, other = lines()
    assert bridge(one, one + [0.5, 0]) is None
    assert bridge(one, other + [0, 0.3]) is None
