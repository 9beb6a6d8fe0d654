"""Guard rails are dropped."""

import numpy as np
import pytest
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.vectorize.guards import MAX_LENGTH_M, drop_guards


def loose(*lines):
    """Lines whose ends are all free."""
    lines = tuple(np.asarray(line, dtype=float) for line in lines)
    nodes = np.concatenate([line[[0, -1]] for line in lines])
    return LineNetwork(lines, nodes, np.arange(2 * len(lines)).reshape(-1, 2))


def along_x(start, end, y=0.0):
    x = np.arange(start, end, 0.1)
    return np.column_stack([x, np.full(len(x), y)])


def test_a_guard_rail_is_dropped_and_a_separate_rail_stays():
    rail, guard, other = along_x(0, 40), along_x(10, 14, 0.116), along_x(20, 24, 0.3)
    network = drop_guards(loose(rail, guard, other))
    np.testing.assert_allclose(np.sort(network.lengths()), [3.9, 39.9], atol=0.11)


@pytest.mark.parametrize(("length_m", "left"), [(7.8, 1), (8.2, 2)])
def test_longer_lines_are_rails_of_a_flat_switch(length_m, left):
    assert len(drop_guards(loose(along_x(0, 40), along_x(10, 10 + length_m, 0.116))).lines) == left


def test_a_line_of_just_this_length_is_a_rail():
    line = np.array([[10.0, 0.116], [10.0 + MAX_LENGTH_M, 0.116]])
    assert len(drop_guards(loose(along_x(0, 40), line)).lines) == 2


@pytest.mark.parametrize(("apart_m", "left"), [(0.14, 1), (0.16, 2)])
def test_a_guard_rail_is_a_head_and_a_flangeway_from_its_rail(apart_m, left):
    assert len(drop_guards(loose(along_x(0, 40), along_x(10, 14, apart_m))).lines) == left
