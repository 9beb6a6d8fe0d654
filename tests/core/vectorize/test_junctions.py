"""Spurs, bubbles, rungs, links and pairs of lines at junctions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.polyline import length_along
from rail_extract.core.vectorize.junctions import (
    cut_kinks,
    drop_bubbles,
    drop_rungs,
    drop_spurs,
    run_through,
    weld_pairs,
)


def check_invariants(network):
    for line, (start, end) in zip(network.lines, network.ends):
        np.testing.assert_array_equal(line[[0, -1]], network.nodes[[start, end]])
    for node, line, vertex in network.passes:
        np.testing.assert_array_equal(network.lines[line][vertex], network.nodes[node])
    assert (network.degrees() > 0).all()


def star(*tips):
    """Straight lines from the origin with a vertex every metre."""
    lines = tuple(np.outer(np.linspace(0, 1, max(int(np.hypot(*tip)), 1) + 1), tip) for tip in tips)
    nodes = np.array([(0.0, 0.0), *tips])
    return LineNetwork(lines, nodes, np.column_stack([np.zeros(len(tips), int), np.arange(1, len(tips) + 1)]))


def loose(*lines):
    """Lines whose ends are all free."""
    lines = tuple(np.asarray(line, dtype=float) for line in lines)
    nodes = np.concatenate([line[[0, -1]] for line in lines])
    return LineNetwork(lines, nodes, np.arange(2 * len(lines)).reshape(-1, 2))


def along_x(start, end, y=0.0):
    x = np.arange(start, end, 0.1)
    return np.column_stack([x, np.full(len(x), y)])


def test_spurs_are_dropped_one_at_a_time_so_that_a_rail_keeps_its_end():
    network = drop_spurs(star((-10.0, 0.0), (0.1, 0.05), (0.12, -0.05)), 0.15)
    assert len(network.lines) == 1
    assert network.lengths()[0] == pytest.approx(10.13, abs=0.001)
    check_invariants(network)


def test_through_lines_pass_the_node_and_the_steeper_line_ends_there():
    network = run_through(star((-10.0, 0.0), (10.0, 0.2), (10.0, 1.5), (0.0, 8.0)))
    check_invariants(network)
    assert len(network.lines) == 3
    assert network.passes.shape == (1, 3)
    assert sorted(network.lengths())[-1] == pytest.approx(20, abs=0.01)


def test_a_rung_between_two_rails_is_dropped():
    x = np.array([-5.0, 0.0, 5.0])
    nodes = np.array([(side, y) for y in (0.0, 0.13) for side in x])
    lines = [nodes[[0, 1]], nodes[[1, 2]], nodes[[3, 4]], nodes[[4, 5]], nodes[[1, 4]]]
    network = LineNetwork(tuple(lines), nodes, np.array([[0, 1], [1, 2], [3, 4], [4, 5], [1, 4]]))
    assert len(drop_rungs(network, 0.1).lines) == 5
    rails = weld_pairs(drop_rungs(network, 0.2))
    assert len(rails.lines) == 2
    np.testing.assert_allclose(rails.lengths(), 10)


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
    check_invariants(welded)
    (line,) = welded.lines
    assert len(line) == 31
    np.testing.assert_allclose(length_along(line)[-1], length_along(whole)[-1])


def test_the_legs_of_a_switch_that_lost_its_stem_are_not_one_rail():
    lines = tuple(np.array([[0.0, 0.0], [10.0, y]]) for y in (0.5, -0.5))
    network = weld_pairs(LineNetwork(lines, np.array([[0.0, 0], [10, 0.5], [10, -0.5]]), np.array([[0, 1], [0, 2]])))
    assert len(network.lines) == 2
    assert (network.degrees() == 1).all()


@pytest.mark.parametrize(("length", "apart", "left"), [(0.5, 0.3, 4), (3.0, 0.15, 4), (3.0, 0.3, 5), (12.0, 0.15, 5)])
def test_a_slit_between_rails_that_part_is_not_a_loop_of_two_rails(length, apart, left):
    nodes = np.array([(0, 0), (10, 0), (10 + length, 0), (40, 0), (40, 1)], dtype=float)
    aside = np.linspace(0, np.pi, 50)
    slit = np.column_stack([10 + length * aside / np.pi, apart * np.sin(aside)])
    lines = (nodes[[0, 1]], nodes[[1, 2]], slit, nodes[[2, 3]], nodes[[2, 4]])
    network = LineNetwork(lines, nodes, np.array([[0, 1], [1, 2], [1, 2], [2, 3], [2, 4]]))
    assert len(drop_bubbles(network, 0.2).lines) == left


def test_a_line_that_turns_back_is_cut_in_two():
    line = np.concatenate([along_x(0, 10), along_x(0, 10, 0.3)[::-1]])
    network = cut_kinks(loose(line))
    assert len(network.lines) == 2
    assert (network.degrees() == 1).all()
    assert network.lengths() == pytest.approx([9.3, 9.3], abs=0.3)


@pytest.mark.parametrize(("turn_deg", "count"), [(22, 1), (29, 2)])
def test_lines_are_cut_where_they_turn_by_25_degrees_and_half_a_metre_on_either_side_is_dropped(turn_deg, count):
    before, ways = along_x(0, 10.05), np.arange(0.1, 10, 0.1)
    turn = np.radians(turn_deg)
    line = np.concatenate([before, before[-1] + ways[:, None] * [np.cos(turn), np.sin(turn)]])
    lengths = cut_kinks(loose(line)).lengths()
    assert len(lengths) == count
    assert lengths.sum() == pytest.approx(19.9 if count == 1 else 18.9, abs=0.25)
