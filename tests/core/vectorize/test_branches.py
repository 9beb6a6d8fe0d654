"""Branches: the stem runs on into one rail, and the other is led to it tangentially."""

import numpy as np
import pytest
from built import check_meeting
from rail_extract.core.lines.ends import MISFIT_M
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.vectorize.branches import attach_branches, part_branches
from rail_extract.laboratory.curves import Element, trace
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


def test_the_stem_of_branchings_one_after_another_runs_on_through_both():
    stock = along_x(0, 120)
    arcs = [trace([Element(50, 1 / 300, 1 / 300)], (toe, 0.0)).xy[::5] for toe in (40.0, 50.0)]
    first, second = (np.array([[toe + np.sqrt(2 * 300 * 0.2), 0.1]]) for toe in (40.0, 50.0))
    x, x1, x2 = stock[:, 0], first[0, 0], second[0, 0]
    legs = [rail[rail[:, 0] > fork[0, 0]] for rail, fork in ((arcs[0], first), (arcs[1], second), (stock, second))]
    lines = (
        np.concatenate([stock[x < x1], first]),
        np.concatenate([first, stock[(x > x1) & (x < x2)], second]),
        *(np.concatenate([fork, leg]) for fork, leg in zip((first, second, second), legs)),
    )
    nodes = np.concatenate([first, second, stock[:1], *(leg[-1:] for leg in legs)])
    network = part_branches(LineNetwork(lines, nodes, np.array([[2, 0], [0, 1], [0, 3], [1, 4], [1, 5]])))
    network = attach_branches(network, cKDTree(np.concatenate([stock, *arcs])), 5.0)
    through = max(network.lines, key=len)
    assert np.ptp(through[:, 0]) > 119
    assert np.abs(through[:, 1]).max() < 0.02


@pytest.mark.parametrize(("slope", "radius", "dropped"), [(0.13, np.inf, True), (0.0, 190.0, False)])
def test_rails_that_cross_where_the_cloud_ends_are_not_led_to_each_other(slope, radius, dropped):
    """In worlds 10187 and 10718 the cloud ended 2 m behind the crossing, before the other two legs were seen."""
    x = np.arange(0, 40, 0.1)
    begin = 1.3 if dropped else 2.8 - np.sqrt(2 * radius * 0.2)
    rails = [np.column_stack([x, y]) for y in (0.0 * x, slope * (x - begin) + (x - begin) ** 2 / (2 * radius))]
    fork = np.array([[2.8, 0.1]])
    stem = np.concatenate([((rails[0] + rails[1]) / 2)[x < 2.8], fork])
    lines = (stem, *(np.concatenate([fork, rail[x > 2.9]]) for rail in rails))
    nodes = np.concatenate([fork, stem[:1], *(line[-1:] for line in lines[1:])])
    network = part_branches(LineNetwork(lines, nodes, np.array([[1, 0], [0, 2], [0, 3]])))
    if not dropped:
        assert sorted(network.degrees().tolist()) == [1, 1, 1, 3]
        return
    network = attach_branches(network, cKDTree(np.concatenate([stem, *rails])), 5.0)
    assert network.degrees().tolist() == [1] * 4
    assert len(network.passes) == 0
    for line, rail in zip(network.lines, rails):
        assert cKDTree(rail).query(line)[0].max() < 0.06
        assert line[:, 0].min() < 4.0


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("radius", [190, 500, 1200])
def test_a_branch_that_ends_freely_is_extended_tangentially_to_its_stock_rail(radius, sense):
    stock = along_x(0, 60)[::sense]
    arc = trace([Element(40, 1 / radius, 1 / radius)], (10.0, 0.0)).xy[::5]
    lines = (stock, arc[arc[:, 1] > 0.12])
    loose = LineNetwork(lines, np.concatenate([line[[0, -1]] for line in lines]), np.arange(4).reshape(2, 2))
    network = attach_branches(loose, cKDTree(np.concatenate([stock, arc])), 5.0)
    assert sorted(network.degrees()) == [1, 1, 1, 3]
    check_meeting(network)
    ((node, line, _),) = network.passes
    np.testing.assert_array_equal(network.lines[line], stock)
    assert network.nodes[node][0] == pytest.approx(10 + np.sqrt(2 * radius * MISFIT_M), abs=0.2)
    assert cKDTree(np.concatenate([stock, arc])).query(network.lines[1])[0].max() < 0.06


def test_a_branch_whose_switch_begins_beyond_the_end_of_the_cloud_is_led_to_its_rail():
    """In world 14417, the law of an arc put the toe of a flat switch 11 m beyond the end of the cloud."""
    radius, begin, drawn = 1100.0, -10.0, 15.0
    stock, branch = along_x(0, 60), along_x(drawn, 60)
    branch[:, 1] = (branch[:, 0] - begin) ** 2 / (2 * radius)
    nodes = np.concatenate([stock[[0, -1]], branch[[0, -1]]])
    network = LineNetwork((stock, branch), nodes, np.array([[0, 1], [2, 3]]))
    network = attach_branches(network, cKDTree(np.concatenate([stock, branch])), 20.0)
    assert len(network.passes) == 1
    led = min(network.lines, key=lambda line: np.hypot(*(line[[0, -1]] - branch[-1]).T).min())
    assert led[:, 0].min() > 0.5
    beyond = led[led[:, 0] > 12.0]
    np.testing.assert_allclose(beyond[:, 1], (beyond[:, 0] - begin) ** 2 / (2 * radius), atol=0.03)


@pytest.mark.parametrize(
    ("radius", "apart_m", "joined"),
    [(np.inf, 0.35, False), (np.inf, 0.5, False)]
    + [(radius, apart_m, True) for radius in (50, 190, 300, 500) for apart_m in (0.35, 0.5, 0.7)],
)
def test_a_straight_leg_of_a_crossing_is_no_branch(apart_m, radius, joined):
    """In worlds 10159 and 10431, flangeways and the end of the cloud hid where such legs crossed the rail."""
    stock, x = along_x(0, 80), np.arange(0, 30, 0.1)
    way = x / 12 + apart_m if radius == np.inf else (x + np.sqrt(2 * radius * apart_m)) ** 2 / (2 * radius)
    leg = np.column_stack([30 + x, 0.04 * np.round(way / 0.04)])
    lines = (stock, leg[leg[:, 1] < 3.0])
    loose = LineNetwork(lines, np.concatenate([line[[0, -1]] for line in lines]), np.arange(4).reshape(2, 2))
    network = attach_branches(loose, cKDTree(np.concatenate(lines)), 20.0)
    assert sorted(network.degrees()) == ([1, 1, 1, 3] if joined else [1] * 4)


@pytest.mark.parametrize(("radius", "joined"), [(np.inf, False), (190, True), (300, True)])
def test_a_leg_of_a_crossing_that_a_check_rail_leads_to_the_rail_is_no_branch(radius, joined):
    """In world 10927, the cloud ends in a crossing of 1:9, and the last 2 m of the leg are on the check rail."""
    stock, x = along_x(0, 80), np.arange(0, 30, 0.1)
    way = x / 9 if radius == np.inf else (x + np.sqrt(2 * radius * 0.15)) ** 2 / (2 * radius) - 0.15
    way = np.maximum(0.15 + way, 0.2)
    leg = np.column_stack([30 + x, 0.04 * np.round(way / 0.04)])
    lines = (stock, leg[leg[:, 1] < 3.0])
    loose = LineNetwork(lines, np.concatenate([line[[0, -1]] for line in lines]), np.arange(4).reshape(2, 2))
    network = attach_branches(loose, cKDTree(np.concatenate(lines)), 20.0)
    assert sorted(network.degrees()) == ([1, 1, 1, 3] if joined else [1] * 4)


def test_a_branch_whose_end_is_drawn_on_a_rail_leaves_that_rail():
    """In world 10880 a join had drawn the rail again, and the branch was led to a rail that it crosses further back."""
    stock, crossed = along_x(0, 60), along_x(0, 60)
    crossed[:, 1] = (crossed[:, 0] - 22.0) / 10
    arc = trace([Element(40, 1 / 190, 1 / 190)], (30.0, 0.0)).xy[::5]
    on_stock = stock[(stock[:, 0] > 25.0) & (stock[:, 0] < 30.0)] + [0.0, 0.01]
    lines = (stock, crossed, np.concatenate([on_stock, arc + [0.0, 0.01]]))
    loose = LineNetwork(lines, np.concatenate([line[[0, -1]] for line in lines]), np.arange(6).reshape(3, 2))
    network = attach_branches(loose, cKDTree(np.concatenate(lines)), 5.0)
    ((node, line, _),) = network.passes
    np.testing.assert_array_equal(network.lines[line], stock)
    assert network.nodes[node][0] == pytest.approx(30 + np.sqrt(2 * 190 * MISFIT_M), abs=1.5)
