"""Lines past guard rails, weeds and kinks, branches led back to their stock rails, and rails joined through frogs."""

from __future__ import annotations

import numpy as np
import pytest
from rail_extract.core.synthetic.curves import Element, trace
from rail_extract.core.vectorize.attaching import attach_branches, drop_guards
from rail_extract.core.vectorize.blots import cut_kinks, straighten_blots
from rail_extract.core.vectorize.joining import join_gaps
from rail_extract.core.vectorize.network import LineNetwork
from scipy.spatial import cKDTree

HEAD_M = 0.072


def loose(*lines):
    """Lines whose ends are all free."""
    lines = tuple(np.asarray(line, dtype=float) for line in lines)
    nodes = np.concatenate([line[[0, -1]] for line in lines])
    return LineNetwork(lines, nodes, np.arange(2 * len(lines)).reshape(-1, 2))


def along_x(start, end, y=0.0):
    x = np.arange(start, end, 0.1)
    return np.column_stack([x, np.full(len(x), y)])


def test_a_rail_runs_straight_past_a_guard_rail_that_widens_its_strip():
    line = along_x(0, 30)
    beside = (line[:, 0] > 13) & (line[:, 0] < 17)
    line[beside, 1] = 0.058
    network = straighten_blots(loose(line), line, np.where(beside, 0.22, 0.11), HEAD_M)
    assert np.abs(network.lines[0][:, 1]).max() < 0.002
    np.testing.assert_allclose(network.lengths(), 29.9, atol=0.01)


def test_a_swerve_to_a_guard_rail_and_back_is_undone_without_its_width():
    line = along_x(0, 30)
    line[:, 1] = 0.116 * np.clip(1 - (np.abs(line[:, 0] - 15) - 1.5) / 0.7, 0, 1)
    network = straighten_blots(loose(line), line, np.full(len(line), 0.11), HEAD_M)
    assert np.abs(network.lines[0][:, 1]).max() < 0.002


def test_the_sharpest_tram_curve_is_left_alone():
    line = trace([Element(10), Element(20, 1 / 18, 1 / 18)]).xy[::5]
    network = straighten_blots(loose(line), line, np.full(len(line), 0.11), HEAD_M)
    assert len(cut_kinks(network).lines) == 1
    np.testing.assert_array_equal(network.lines[0], line)


def test_a_line_that_turns_back_is_cut_in_two():
    line = np.concatenate([along_x(0, 10), along_x(0, 10, 0.3)[::-1]])
    network = cut_kinks(loose(line))
    assert len(network.lines) == 2
    assert (network.degrees() == 1).all()
    assert network.lengths() == pytest.approx([9.3, 9.3], abs=0.3)


@pytest.mark.parametrize("radius", [190, 500, 1200])
def test_a_branch_is_led_back_tangentially_to_its_stock_rail(radius):
    stock = along_x(0, 60)
    arc = trace([Element(40, 1 / radius, 1 / radius)], (10.0, 0.0)).xy[::5]
    branch = arc[arc[:, 1] > 0.12]
    network = attach_branches(loose(stock, branch), cKDTree(np.concatenate([stock, arc])), 5.0)
    assert sorted(network.degrees()) == [1, 1, 1, 3]
    (node, line, vertex) = network.passes[0]
    np.testing.assert_array_equal(network.lines[line][vertex], network.nodes[node])
    assert abs(network.nodes[node][0] - 10) < 0.25 * np.sqrt(2 * radius * 0.12)
    assert cKDTree(np.concatenate([stock, arc])).query(network.lines[1])[0].max() < 0.06


def test_a_rail_that_ends_at_a_frog_does_not_branch_off_there():
    straight = trace([Element(20)], (30.0, 0.15), np.arctan(1 / 9)).xy[::5]
    stock = along_x(0, 60)
    network = attach_branches(loose(stock, straight), cKDTree(np.concatenate([stock, straight])), 5.0)
    assert (network.degrees() == 1).all()


def test_rails_join_across_more_than_a_gap_where_cells_show_them_merged():
    pieces = along_x(0, 20), along_x(28, 50)
    assert len(join_gaps(loose(*pieces), 5.0, 10.0, cKDTree(np.concatenate(pieces))).lines) == 2
    assert len(join_gaps(loose(*pieces), 5.0, 10.0, cKDTree(along_x(0, 50, 0.03))).lines) == 1


def test_a_guard_rail_goes_and_a_rail_of_its_own_stays():
    rail, guard, other = along_x(0, 40), along_x(10, 14, 0.116), along_x(20, 24, 0.3)
    network = drop_guards(loose(rail, guard, other), HEAD_M)
    np.testing.assert_allclose(np.sort(network.lengths()), [3.9, 39.9], atol=0.11)
