"""Branches that end freely are connected to their stock rails."""

import numpy as np
import pytest
from rail_extract.core.lines.bridges import MISFIT_M
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.vectorize.attaching import attach_branches
from rail_extract.laboratory.curves import Element, trace
from scipy.spatial import cKDTree


def loose(*lines):
    """Lines whose ends are all free."""
    lines = tuple(np.asarray(line, dtype=float) for line in lines)
    nodes = np.concatenate([line[[0, -1]] for line in lines])
    return LineNetwork(lines, nodes, np.arange(2 * len(lines)).reshape(-1, 2))


def along_x(start, end, y=0.0):
    x = np.arange(start, end, 0.1)
    return np.column_stack([x, np.full(len(x), y)])


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("radius", [190, 500, 1200])
def test_a_branch_is_extended_tangentially_to_its_stock_rail(radius, sense):
    stock = along_x(0, 60)[::sense]
    arc = trace([Element(40, 1 / radius, 1 / radius)], (10.0, 0.0)).xy[::5]
    branch = arc[arc[:, 1] > 0.12]
    network = attach_branches(loose(stock, branch), cKDTree(np.concatenate([stock, arc])), 5.0)
    assert sorted(network.degrees()) == [1, 1, 1, 3]
    (node, line, vertex) = network.passes[0]
    np.testing.assert_array_equal(network.lines[line][vertex], network.nodes[node])
    if radius > 190:  # otherwise the stock rail is straightened where it seems drawn aside
        np.testing.assert_array_equal(network.lines[line], stock)
    seen_from_m = 10 + np.sqrt(2 * radius * MISFIT_M)
    assert network.nodes[node][0] == pytest.approx(seen_from_m, abs=0.2)
    assert cKDTree(np.concatenate([stock, arc])).query(network.lines[1])[0].max() < 0.06


def test_a_rail_that_ends_at_a_frog_does_not_branch_off_there():
    straight = trace([Element(20)], (30.0, 0.15), np.arctan(1 / 9)).xy[::5]
    stock = along_x(0, 60)
    network = attach_branches(loose(stock, straight), cKDTree(np.concatenate([stock, straight])), 5.0)
    assert (network.degrees() == 1).all()


def test_a_stock_rail_drawn_aside_by_its_branch_is_straightened_and_keeps_its_nodes():
    stock = along_x(0, 60)
    arc = trace([Element(40, 1 / 300, 1 / 300)], (10.0, 0.0)).xy[::5]
    places = np.concatenate([stock, arc])
    stock[:, 1] = 0.5 * np.interp(stock[:, 0], *arc.T) * (stock[:, 0] < 18)
    side = np.array([[40.0, 0.0], [40.0, -9.0]])
    nodes = np.concatenate([stock[[0, -1]], arc[[0, -1]], stock[[400]], side[1:]])
    branch = arc[arc[:, 0] > 19]
    nodes[2] = branch[0]
    network = LineNetwork((stock, branch, side), nodes, np.array([[0, 1], [2, 3], [4, 5]]), np.array([[4, 0, 400]]))
    network = attach_branches(network, cKDTree(places), 5.0)
    assert np.abs(network.lines[0][:, 1]).max() < 0.02
    assert len(network.passes) == 2
    for node, line, vertex in network.passes:
        np.testing.assert_array_equal(network.lines[line][vertex], network.nodes[node])
