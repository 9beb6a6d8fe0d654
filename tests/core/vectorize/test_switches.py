"""Lines past guard rails, weeds and kinks, branches led back to their stock rails, and rails joined through frogs."""

from __future__ import annotations

import numpy as np
import pytest
from rail_extract.core.lines.bridges import MISFIT_M
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.raster import rasterize
from rail_extract.core.vectorize import vectorize
from rail_extract.core.vectorize.attaching import attach_branches
from rail_extract.core.vectorize.branches import resolve_branches
from rail_extract.core.vectorize.crossings import resolve_crossings
from rail_extract.core.vectorize.guards import drop_guards
from rail_extract.core.vectorize.joining import join_gaps
from rail_extract.core.vectorize.junctions import run_through, weld_pairs
from rail_extract.core.vectorize.repairs import cut_kinks, straighten_blots
from rail_extract.core.vectorize.routes import choose_routes
from rail_extract.laboratory.curves import Element, trace
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
    seen_from_m = 10 + np.sqrt(2 * radius * MISFIT_M)
    assert network.nodes[node][0] == pytest.approx(seen_from_m, abs=0.2)
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
    network = drop_guards(loose(rail, guard, other))
    np.testing.assert_allclose(np.sort(network.lengths()), [3.9, 39.9], atol=0.11)


@pytest.mark.parametrize("radius", [190, 2500, 4800])
def test_a_merged_stretch_is_resolved_into_two_rails(radius):
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


@pytest.mark.parametrize("missing_m", [1.0, 3.0])
def test_rails_cross_at_a_frog_whose_flangeway_cuts_one_leg_off(missing_m):
    slope = np.arctan(1 / 9)
    way, other = np.array([1.0, 0.0]), np.array([np.cos(slope), np.sin(slope)])
    near, t = np.arange(0, 25, 0.1)[:, None], np.arange(missing_m, 25, 0.1)[:, None]
    fork = np.zeros((1, 2))
    shared = np.concatenate([fork, (missing_m / 2 + 0.1) * (way + other)[None] / 2, (t[1:] + 0.3) * other])
    lines = (np.concatenate([fork, -near[5:] * way]), np.concatenate([fork, -near[5:] * other]), shared, t * way)
    nodes = np.concatenate([fork, *(line[-1:] for line in lines), lines[3][:1]])
    network = resolve_crossings(LineNetwork(lines, nodes, np.array([[0, 1], [0, 2], [0, 3], [5, 4]])))
    assert len(network.lines) == 2
    for line in network.lines:
        off = [np.abs(line @ [-along[1], along[0]]).max() for along in (way, other)]
        assert min(off) < 0.02


def test_the_legs_of_a_switch_that_lost_its_stem_are_not_one_rail():
    lines = tuple(np.array([[0.0, 0.0], [10.0, y]]) for y in (0.5, -0.5))
    network = weld_pairs(LineNetwork(lines, np.array([[0.0, 0], [10, 0.5], [10, -0.5]]), np.array([[0, 1], [0, 2]])))
    assert len(network.lines) == 2
    assert (network.degrees() == 1).all()


def test_ends_bent_aside_beside_each_other_are_joined_without_their_hooks():
    rail, wing = along_x(0, 20), along_x(20.2, 40)
    rail[-15:, 1] += 0.1 * np.linspace(0, 1.5, 15)
    (line,) = join_gaps(loose(rail, wing[:-1]), 5.0, 10.0, cKDTree(np.concatenate([rail, wing]))).lines
    assert np.abs(line[:, 1]).max() < 0.05
    beside = along_x(18, 40, 0.3)
    assert len(join_gaps(loose(along_x(0, 20), beside), 5.0, 10.0).lines) == 2


def test_a_gentle_swerve_to_a_guard_rail_is_undone():
    line = along_x(0, 30)
    line[:, 1] = 0.09 * np.exp(-(((line[:, 0] - 15) / 0.9) ** 2))
    network = straighten_blots(loose(line), line, np.full(len(line), 0.11), HEAD_M)
    assert np.abs(network.lines[0][:, 1]).max() < 0.03


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


def test_a_stretch_that_the_network_left_out_is_no_gap_where_there_are_points():
    rng = np.random.default_rng(5)
    xy = np.column_stack([rng.uniform(0, 60, 9000), rng.uniform(-HEAD_M / 2, HEAD_M / 2, 9000)])
    lost = (xy[:, 0] > 25) & (xy[:, 0] < 34)
    cleaned, sparse = rasterize(xy[~lost], 0.04), xy[lost][::30]
    assert len(vectorize(cleaned, HEAD_M).lines) == 2
    assert (
        len(vectorize(cleaned, HEAD_M, raw=rasterize(np.concatenate([xy[~lost], sparse + [0.0, 0.5]]), 0.04)).lines)
        == 2
    )
    (line,) = vectorize(cleaned, HEAD_M, raw=rasterize(np.concatenate([xy[~lost], sparse]), 0.04)).lines
    assert np.abs(line[:, 1]).max() < 0.05
