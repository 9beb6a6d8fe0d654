"""Branches that are redrawn from where they part."""

import numpy as np
import pytest
from rail_extract.core.lines.bridges import MISFIT_M
from rail_extract.core.lines.ends import even_points
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.raster import cell_size, rasterize
from rail_extract.core.vectorize import vectorize
from rail_extract.core.vectorize.branches import choose_routes, free_third_rails, resolve_branches
from rail_extract.core.vectorize.junctions import (
    run_through,
    unsteadiness,
)
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
    network = resolve_branches(LineNetwork(lines, nodes, np.array([[1, 0], [0, 2], [0, 3]])))
    network = choose_routes(run_through(network))
    through, branch = sorted(network.lines, key=len, reverse=True)
    assert np.abs(through[:, 1]).max() < 0.02
    assert branch[0, 0] == pytest.approx(40 + np.sqrt(2 * radius * MISFIT_M), abs=0.7)
    assert cKDTree(trace([Element(80, 1 / radius, 1 / radius)], (40.0, 0.0)).xy).query(branch)[0].max() < 0.02


def test_of_three_rails_that_part_within_metres_the_straight_one_goes_on():
    x = np.arange(-20.0, 30.0, 0.1)
    stem = np.column_stack([x[x <= 0], 0 * x[x <= 0]])[::-1]
    ahead = x[x >= 0]
    left = np.column_stack([ahead, 0.1 + (ahead + 6.0) ** 2 / 380 - 36 / 380])
    straight = np.column_stack([ahead[20:], 0 * ahead[20:]])
    right = np.column_stack([ahead[20:], -((ahead[20:] + 4.5) ** 2) / 380])
    link = np.array([[0.0, 0.0], [1.0, -0.05], [2.0, -0.06]])
    straight[0] = right[0] = link[-1]
    left[0] = stem[0] = link[0]
    lines = (stem, left, link, straight, right)
    nodes = np.array([link[0], link[-1], *(line[-1] for line in (stem, left, straight, right))])
    network = LineNetwork(lines, nodes, np.array([[0, 2], [0, 3], [0, 1], [1, 4], [1, 5]]))
    freed = free_third_rails(network)
    assert len(freed.lines) == 3 and (freed.degrees() == 1).all()
    through = max(freed.lines, key=len)
    assert np.abs(through[:, 1]).max() < 0.02 and np.ptp(through[:, 0]) > 49


def stairs(line):
    """Vertices of a line, rounded to half a cell of 40 mm."""
    return np.round(line / 0.02) * 0.02


def switch(main_curvature, radius, through):
    """A turnout at (0, 0) whose stem continues as the main rail or as the branch."""
    stem, main, branch = (
        stairs(trace([Element(40, curvature, curvature)], heading=heading).xy[::5])
        for heading, curvature in (
            (0.3 + np.pi, -main_curvature),
            (0.3, main_curvature),
            (0.3, main_curvature + 1 / radius),
        )
    )
    legs = (main, branch) if through == "main" else (branch, main)
    lines = (np.concatenate([stem[:0:-1], legs[0]]), legs[1])
    nodes = np.concatenate([lines[0][[0, -1]], legs[1][[0, -1]]])
    return LineNetwork(lines, nodes, np.array([[0, 1], [2, 3]]), np.array([[2, 0, len(stem) - 1]])), stem, main, branch


@pytest.mark.parametrize("radius", [25, -190, 300, -1200, 2500])
@pytest.mark.parametrize("main_curvature", [0.0, 1 / 700, -1 / 2000])
@pytest.mark.parametrize("through", ["main", "branch"])
def test_the_rail_that_keeps_its_curvature_runs_through_a_switch(main_curvature, radius, through):
    network, stem, main, branch = switch(main_curvature, radius, through)
    network = choose_routes(network)
    longer, shorter = sorted(network.lines, key=len, reverse=True)
    np.testing.assert_array_equal(
        longer if (longer[0] == stem[-1]).all() else longer[::-1], np.concatenate([stem[:0:-1], main])
    )
    np.testing.assert_array_equal(shorter, branch)
    ((node, line, vertex),) = network.passes
    np.testing.assert_array_equal(network.lines[line][vertex], network.nodes[node])
    np.testing.assert_array_equal(network.nodes[node], [0.0, 0.0])


def test_parts_too_short_to_judge_keep_their_route():
    lines = np.array([[-5.0, 0], [0, 0], [40, 2.0]]), np.array([[0.0, 0], [40, 0]])
    nodes = np.array([[-5.0, 0], [40, 2], [0, 0], [40, 0]])
    network = LineNetwork(lines, nodes, np.array([[0, 1], [2, 3]]), np.array([[2, 0, 1]]))
    np.testing.assert_array_equal(choose_routes(network).lines[0], lines[0])


def test_lines_parted_at_their_passes_weld_to_what_they_were():
    line = np.column_stack([np.arange(30.0), np.zeros(30)])
    sides = tuple(np.array([[x, 0.0], [x, 9.0]]) for x in (20.0, 10.0))
    nodes = np.array([[0.0, 0], [29, 0], [20, 0], [20, 9], [10, 0], [10, 9]])
    network = LineNetwork((line, *sides), nodes, np.array([[0, 1], [2, 3], [4, 5]]), np.array([[2, 0, 20], [4, 0, 10]]))
    pieces, partner = network.parted()
    np.testing.assert_allclose(pieces.lengths(), [10, 10, 9, 9, 9])
    assert (pieces.degrees() == network.degrees()).all()
    again = pieces.weld(partner)
    for one, other in zip(again.lines, network.lines):
        np.testing.assert_array_equal(one, other)
    for node, number, vertex in again.passes:
        np.testing.assert_array_equal(again.lines[number][vertex], again.nodes[node])
    assert len(again.passes) == 2


@pytest.mark.parametrize("radius", [20, -190, 3000])
def test_a_curve_is_steady_however_tight(radius):
    one, other = (
        trace([Element(15, turn / radius, turn / radius)], heading=heading).xy
        for heading, turn in ((1.0 + np.pi, -1), (1.0, 1))
    )
    assert unsteadiness(one, other, 15.0) < 0.001


def test_a_kink_strays_as_far_as_its_best_parabola():
    along, slope = np.array([1.0, 0.0]), 1 / 26.5
    t = np.arange(0, 20, 0.1)[:, None]
    x = np.linspace(-1, 1, 2001)
    best = np.polyval(np.polyfit(x, np.abs(x), 2), x)
    expected = 12 * slope / 2 * np.sqrt(np.mean((np.abs(x) - best) ** 2))
    assert unsteadiness(-t * along, t * [1.0, slope], 12.0) == pytest.approx(expected, rel=0.1)


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
