"""Branches: the stem runs on into one rail, and the other is led to it tangentially."""

import numpy as np
import pytest
from rail_extract.core.lines.ends import MISFIT_M, even_points
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.raster import cell_size, rasterize
from rail_extract.core.vectorize import vectorize
from rail_extract.core.vectorize.branches import attach_branches, part_branches
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.scenes.switches import turnout
from scipy.spatial import cKDTree


def along_x(start, end, y=0.0):
    x = np.arange(start, end, 0.1)
    return np.column_stack([x, np.full(len(x), y)])


@pytest.mark.parametrize("radius", [190, 2500, 4800])
def test_a_merged_part_is_resolved_into_two_rails(radius):
    stock = along_x(0, 120)
    arc = trace([Element(80, 1 / radius, 1 / radius)], (40.0, 0.0)).xy[::5]
    apart_m = 40 + np.sqrt(2 * radius * 0.2)
    fork = np.array([[apart_m, 0.1]])
    stem = np.concatenate([stock[stock[:, 0] < apart_m], fork])
    legs = (np.concatenate([fork, rail[rail[:, 0] > apart_m + 0.1]]) for rail in (stock, arc))
    lines = (stem, *legs)
    nodes = np.concatenate([fork, stem[:1], *(line[-1:] for line in lines[1:])])
    network = part_branches(LineNetwork(lines, nodes, np.array([[1, 0], [0, 2], [0, 3]])))
    assert sorted(network.degrees()) == [1] * 4
    network = attach_branches(network, cKDTree(np.concatenate([stock, arc])), 5.0)
    through, branch = sorted(network.lines, key=len, reverse=True)
    assert np.abs(through[:, 1]).max() < 0.02
    assert branch[0, 0] == pytest.approx(40 + np.sqrt(2 * radius * MISFIT_M), abs=0.7)
    assert cKDTree(trace([Element(80, 1 / radius, 1 / radius)], (40.0, 0.0)).xy).query(branch)[0].max() < 0.02


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("radius", [190, 500, 1200])
def test_a_branch_that_ends_freely_is_extended_tangentially_to_its_stock_rail(radius, sense):
    stock = along_x(0, 60)[::sense]
    arc = trace([Element(40, 1 / radius, 1 / radius)], (10.0, 0.0)).xy[::5]
    lines = (stock, arc[arc[:, 1] > 0.12])
    loose = LineNetwork(lines, np.concatenate([line[[0, -1]] for line in lines]), np.arange(4).reshape(2, 2))
    network = attach_branches(loose, cKDTree(np.concatenate([stock, arc])), 5.0)
    assert sorted(network.degrees()) == [1, 1, 1, 3]
    (node, line, vertex) = network.passes[0]
    np.testing.assert_array_equal(network.lines[line][vertex], network.nodes[node])
    np.testing.assert_array_equal(network.lines[line], stock)
    assert network.nodes[node][0] == pytest.approx(10 + np.sqrt(2 * radius * MISFIT_M), abs=0.2)
    assert cKDTree(np.concatenate([stock, arc])).query(network.lines[1])[0].max() < 0.06


def follows(line, rails):
    """Numbers of the rails that a line follows, where no other rail is near it."""
    distance = np.array([rail.query(even_points(line))[0] for rail in rails])
    alone = np.partition(distance, 1, axis=0)[1] > 0.2
    return set(distance[:, alone].argmin(axis=0).tolist())


@pytest.mark.parametrize(
    ("form", "hand", "heading", "seed", "curvature"),
    [("2500-1:26.5", -1, 3.29, 207, 0.0), ("2500-1:26.5", -1, 0.47, 201, 0.0)],
)
def test_every_line_of_a_scanned_turnout_follows_one_rail_alone(form, hand, heading, seed, curvature):
    scene = turnout("turnout", form, hand, heading, seed, curvature)
    head_m = scene.standard.head_width_m
    rails = [cKDTree(even_points(rail[:, :2])) for rail in scene.rails]
    xyz = scene.rail_points().xyz
    seen = np.min([rail.query(xyz[:, :2])[0] for rail in rails], axis=0) < head_m / 2
    network = vectorize(rasterize(xyz[seen], cell_size(scene.standard.gauge_m, head_m)), head_m)
    followed = [follows(line, rails) for line in network.lines]
    assert sorted(followed, key=min) == [{0}, {1}, {2}, {3}]
