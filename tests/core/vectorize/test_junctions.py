"""Spurs, loops, rungs, links and pairs of lines at junctions."""

import numpy as np
import pytest
from built import check_meeting
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.polyline import length_along
from rail_extract.core.vectorize.junctions import clean_junctions, weld_pairs


@given(st.permutations(range(6)), st.lists(st.booleans(), min_size=6, max_size=6), st.booleans())
@settings(max_examples=30, deadline=None)
def test_welding_restores_a_line_cut_into_pieces(order, turned, closed):
    angle = np.linspace(0, 2 * np.pi if closed else 5.0, 31)
    whole = np.column_stack([np.cos(angle), np.sin(angle)])
    whole[-1] = whole[0] if closed else whole[-1]
    pieces = [whole[5 * number : 5 * number + 6] for number in order]
    ends = [(number, (number + 1) % 6 if closed else number + 1) for number in order]
    lines = tuple(piece[::-1] if back else piece for piece, back in zip(pieces, turned))
    ends = np.array([end[::-1] if back else end for end, back in zip(ends, turned)])
    welded = weld_pairs(LineNetwork(lines, whole[: 30 if closed else 31 : 5], ends))
    check_meeting(welded)
    (line,) = welded.lines
    assert len(line) == 31
    np.testing.assert_allclose(length_along(line)[-1], length_along(whole)[-1])


@pytest.mark.parametrize(("long", "lines"), [(0.25, 1), (1.5, 4)])
def test_a_hole_in_a_rail_is_no_second_rail(long, lines):
    """Lines beside a short hole are one rail, those beside a long one are two."""
    nodes = np.array([[0.0, 0.0], [10.0, 0.0], [10.0 + 2 * long, 0.0], [20.0, 0.0]])
    sides = (np.array([nodes[1], [10.0 + long, up], nodes[2]]) for up in (0.1, -0.1))
    whole = LineNetwork((nodes[:2], *sides, nodes[2:]), nodes, np.array([[0, 1], [1, 2], [1, 2], [2, 3]]))
    clean = clean_junctions(whole, 0.072)
    assert len(clean.lines) == lines
    if lines == 1:
        np.testing.assert_allclose(clean.lines[0][:, 1], 0.0, atol=1e-12)
        np.testing.assert_allclose(clean.lengths(), 20.0)


@pytest.mark.parametrize("tail_m", [0.3, 0.9])
def test_a_rail_with_a_hole_just_before_its_end_is_whole(tail_m):
    nodes = np.array([[0.0, 0.0], [10.0, 0.0], [10.6, 0.0], [10.6 + tail_m, 0.0]])
    sides = (np.array([nodes[1], [10.3, up], nodes[2]]) for up in (0.06, -0.06))
    whole = LineNetwork((nodes[:2], *sides, nodes[2:]), nodes, np.array([[0, 1], [1, 2], [1, 2], [2, 3]]))
    (line,) = clean_junctions(whole, 0.072).lines
    np.testing.assert_allclose(line[:, 1], 0.0, atol=1e-12)
    assert np.ptp(line[:, 0]) == pytest.approx(10.6 + tail_m)


def test_cells_between_two_rails_of_blunt_clouds_are_no_rail():
    """In worlds 9862 and 9926, such a rung was longer than three heads of 67 mm, and a rail began at it."""
    y = 0.21
    nodes = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [0.0, y], [10.05, y], [20.0, y]])
    ends = np.array([[0, 1], [1, 2], [3, 4], [4, 5], [1, 4]])
    clean = clean_junctions(LineNetwork(tuple(nodes[pair] for pair in ends), nodes, ends), 0.067)
    assert sorted(np.round(clean.lengths(), 3)) == [20.0, 20.0]
    assert all(np.ptp(line[:, 1]) == 0 for line in clean.lines)
