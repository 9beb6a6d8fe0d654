"""Ends of lines."""

import numpy as np
import pytest
from rail_extract.core.lines.ends import STEP_M, cut_back, even_points, tip_and_direction, turned

LINE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 3.0]])


@pytest.mark.parametrize(("length_m", "count", "last"), [(np.inf, 41, [1, 3]), (2.0, 21, [1, 1]), (0.02, 2, [0.02, 0])])
def test_points_are_even_and_at_least_two(length_m, count, last):
    points = even_points(LINE, length_m)
    assert len(points) == count
    assert points[0] == pytest.approx([0, 0])
    assert points[-1] == pytest.approx(last)
    if count > 2:
        assert np.abs(np.diff(points, axis=0)).max() == pytest.approx(STEP_M)


@pytest.mark.parametrize(
    ("length_m", "rest"), [(0.0, LINE), (-1.0, LINE), (0.4, [[0.4, 0], [1, 0], [1, 3]]), (1.0, [[1, 0], [1, 3]])]
)
def test_a_line_is_cut_back_by_a_length(length_m, rest):
    assert cut_back(LINE, length_m) == pytest.approx(np.array(rest, dtype=float))


def test_an_odd_end_turns_a_line():
    assert turned(LINE, 4).tolist() == LINE.tolist()
    assert turned(LINE, 5).tolist() == LINE[::-1].tolist()


@pytest.mark.parametrize("sense", [1, -1])
def test_the_direction_leads_out_of_the_line(sense):
    way = np.array([0.6, 0.8]) * sense
    aside = np.array([-0.8, 0.6])
    points = -np.arange(9.0)[:, None] * way + np.array([0, 1, -1, 0, 0, 0, -1, 1, 0])[:, None] * 0.01 * aside
    tip, outward = tip_and_direction(points)
    assert outward == pytest.approx(way, abs=0.01)
    assert tip == pytest.approx([0, 0], abs=0.01)
