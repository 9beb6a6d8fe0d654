import numpy as np
import pytest
from rail_extract.core.classify.lines import Marks, find_lines
from rail_extract.core.classify.partner import runs_inside, stations_with_partner
from rail_extract.core.classify.pieces import links

GAUGE, WIDTH = 1.435, 0.072
SPACING = GAUGE + WIDTH


def bars(*lefts, height=None, length=10.0, slopes=None):
    """Lines along x at distances to the left, with the number of its bar for each cell."""
    x = np.arange(0, length, 0.08)
    slopes = slopes or [0.0] * len(lefts)
    xy = np.concatenate([np.column_stack([x, left + slope * x]) for left, slope in zip(lefts, slopes)])
    bar = np.repeat(np.arange(len(lefts)), len(x))
    heights = np.zeros(len(lefts)) if height is None else np.array(height)
    lines = find_lines(Marks(xy, heights[bar]), 1.0, 0.035, 0.05)
    return lines, bar, (xy[:, 0] > 0.7) & (xy[:, 0] < length - 0.7)


def test_two_rails_at_the_gauge_are_partners_at_all_stations():
    lines, _, inner = bars(0, SPACING)
    assert (stations_with_partner(lines, [SPACING], 0.05)[inner] == 5).all()


def test_a_widened_gauge_still_pairs():
    lines, _, inner = bars(0, SPACING + 0.03)
    assert (stations_with_partner(lines, [SPACING], 0.05)[inner] >= 2).all()


@pytest.mark.parametrize("off", [-0.12, 0.12])
def test_a_guard_rail_is_not_the_partner_of_the_far_rail(off):
    lines, _, _ = bars(0, SPACING + off)
    assert not stations_with_partner(lines, [SPACING], 0.05).any()


def test_rails_of_different_height_are_not_partners():
    lines, _, _ = bars(0, SPACING, height=[0.1, 0.2])
    assert not stations_with_partner(lines, [SPACING], 0.05).any()


def test_each_of_several_gauges_pairs():
    lines, bar, inner = bars(0, 1.072, SPACING)
    found = stations_with_partner(lines, [SPACING, 1.072], 0.05)
    assert (found[inner] == 5).all()
    only = stations_with_partner(lines, [SPACING], 0.05)
    assert not only[bar == 1].any()


@pytest.mark.parametrize("left", [WIDTH + 0.045, GAUGE - 0.4, -0.4])
def test_guard_and_third_rails_run_inside(left):
    lines, bar, inner = bars(0, SPACING, left)
    paired = stations_with_partner(lines, [SPACING], 0.05) >= 2
    inside = runs_inside(lines, paired, links(lines), [GAUGE], WIDTH)
    np.testing.assert_array_equal(inside[inner], (bar == 2)[inner])


def test_the_rail_of_the_next_track_does_not_run_inside():
    lines, _, _ = bars(0, SPACING, SPACING + 2.0)
    paired = stations_with_partner(lines, [SPACING], 0.05) >= 2
    assert not runs_inside(lines, paired, links(lines), [GAUGE], WIDTH).any()


def test_a_branch_does_not_run_inside():
    lines, bar, inner = bars(0, SPACING, 0.2, slopes=[0, 0, 1 / 9])
    paired = stations_with_partner(lines, [SPACING], 0.05) >= 2
    assert not runs_inside(lines, paired, links(lines), [GAUGE], WIDTH)[(bar == 2) & inner].any()


def test_nothing_has_no_partner():
    lines = find_lines(Marks(np.empty((0, 2)), np.empty(0)), 1.0, 0.035, 0.05)
    assert stations_with_partner(lines, [SPACING], 0.05).shape == (0,)
