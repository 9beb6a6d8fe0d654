"""Branches that end freely are connected to their stock rails."""

import numpy as np
import pytest
from rail_extract.core.lines.ends import MISFIT_M
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
    np.testing.assert_array_equal(network.lines[line], stock)
    seen_from_m = 10 + np.sqrt(2 * radius * MISFIT_M)
    assert network.nodes[node][0] == pytest.approx(seen_from_m, abs=0.2)
    assert cKDTree(np.concatenate([stock, arc])).query(network.lines[1])[0].max() < 0.06
