import numpy as np
import pytest
from rail_extract.core.heads.neighbours import _offset, free_edges

WIDTH = 0.072
RIGHT, LEFT = 0, 1


def line(y, length=40.0):
    x = np.arange(0, length + 0.05, 0.1)
    return np.column_stack([x, y(x)])


def stations(free):
    return (np.arange(free.shape[1]) + 0.5) * 0.25


def test_edges_are_free_of_the_other_head_at_gauge():
    for free in free_edges([line(lambda x: 0 * x), line(lambda x: 0 * x + 1.5)], WIDTH):
        assert free.all()


def test_a_branch_hides_the_inner_edges_until_the_heads_are_apart():
    stock, branch = free_edges([line(lambda x: 0 * x), line(lambda x: x**2 / 600)], WIDTH)
    apart = stations(stock) ** 2 / 600
    np.testing.assert_array_equal(stock[LEFT], apart > 1.5 * WIDTH)
    assert stock[RIGHT].all()
    assert branch[LEFT].all()
    assert np.abs(np.argmin(~branch[RIGHT]) - np.argmin(~stock[LEFT])) <= 1


def test_turned_lines_swap_their_edges():
    _, branch = free_edges([line(lambda x: 0 * x), line(lambda x: x**2 / 600)[::-1]], WIDTH)
    assert branch[RIGHT].all()
    assert not branch[LEFT].all()


def test_crossing_heads_hide_both_edges_where_they_overlap_and_one_edge_next_to_that():
    first, second = free_edges([line(lambda x: 0 * x), line(lambda x: (x - 20) / 9)], WIDTH)
    offset = (stations(first) - 20) / 9
    overlap = np.abs(offset) < 0.5 * WIDTH
    assert not first[:, overlap].any()
    before, after = (offset < -0.5 * WIDTH) & (offset > -1.4 * WIDTH), (offset > 0.5 * WIDTH) & (offset < 1.4 * WIDTH)
    assert first[LEFT, before].all()
    assert not first[RIGHT, before].any()
    assert first[RIGHT, after].all()
    assert not first[LEFT, after].any()
    assert not second[:, overlap].any()


def test_without_lines_there_are_no_edges():
    assert free_edges([], WIDTH) == []


@pytest.mark.parametrize(
    ("angle_deg", "across_m"), [(0, 0.3), (30, 0.3 - 0.1 * np.tan(np.pi / 6)), (59, 0.3 - 0.1 * np.tan(np.radians(59)))]
)
def test_a_line_is_met_abeam_unless_it_is_steep(angle_deg, across_m):
    """The other line is 0.1 m ahead and 0.3 m to the left there."""
    angle = np.radians(angle_deg)
    other_normal = np.array([[-np.sin(angle), np.cos(angle)]])
    step, normal = np.array([[0.1, 0.3]]), np.array([[0.0, 1.0]])
    assert _offset(step, normal, other_normal) == pytest.approx([across_m])
    assert _offset(step, normal, -other_normal) == pytest.approx([across_m])
    steep = np.array([[-np.sin(1.06), np.cos(1.06)]])
    assert _offset(step, normal, steep) == pytest.approx([0.3])
