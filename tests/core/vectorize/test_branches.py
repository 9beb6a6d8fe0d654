"""Branches that are redrawn from where they part."""

import numpy as np
import pytest
from rail_extract.core.lines.bridges import MISFIT_M
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.vectorize.branches import DIRECTION_M, _trunk, free_third_rails, resolve_branches
from rail_extract.core.vectorize.junctions import (
    run_through,
)
from rail_extract.core.vectorize.routes import choose_routes
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


@pytest.mark.parametrize("left_m", [40.0, DIRECTION_M + 0.5, DIRECTION_M - 0.5])
def test_a_stem_is_cut_back_to_where_its_legs_part_if_enough_of_it_remains(left_m):
    """Legs that part on an arc of 300 m and are 0.3 m apart where the stem ends."""
    t, back_m = np.arange(0, 20, 0.1), np.sqrt(2 * 300 * 0.3)
    rails = [np.column_stack([t, np.zeros(len(t))]), np.column_stack([t, (t + back_m) ** 2 / 600])]
    apart_m = back_m - np.sqrt(2 * 300 * MISFIT_M)
    trunk = _trunk(-along_x(0, apart_m + left_m), rails)
    assert (len(trunk) > 0) == (left_m > DIRECTION_M)
    if len(trunk):
        assert np.ptp(trunk[:, 0]) == pytest.approx(left_m, abs=0.3)
        assert trunk[0, 0] == pytest.approx(-apart_m, abs=0.3)
