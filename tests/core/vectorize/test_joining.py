"""Ends that are joined across gaps, and ends that must not be."""

import numpy as np
import pytest
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.vectorize.joining import join_gaps, unseen_m
from rail_extract.core.vectorize.junctions import (
    run_through,
)
from scipy.spatial import cKDTree


def loose(*lines):
    """Lines whose ends are all free."""
    lines = tuple(np.asarray(line, dtype=float) for line in lines)
    nodes = np.concatenate([line[[0, -1]] for line in lines])
    return LineNetwork(lines, nodes, np.arange(2 * len(lines)).reshape(-1, 2))


def along_x(start, end, y=0.0):
    x = np.arange(start, end, 0.1)
    return np.column_stack([x, np.full(len(x), y)])


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


def test_rails_join_across_more_than_a_gap_where_they_share_cells():
    pieces = along_x(0, 20), along_x(28, 50)
    assert len(join_gaps(loose(*pieces), 5.0, 10.0, cKDTree(np.concatenate(pieces))).lines) == 2
    assert len(join_gaps(loose(*pieces), 5.0, 10.0, cKDTree(along_x(0, 50, 0.03))).lines) == 1


def test_overlapping_ends_that_are_bent_aside_are_joined_without_their_hooks():
    rail, wing = along_x(0, 20), along_x(20.2, 40)
    rail[-15:, 1] += 0.1 * np.linspace(0, 1.5, 15)
    (line,) = join_gaps(loose(rail, wing[:-1]), 5.0, 10.0, cKDTree(np.concatenate([rail, wing]))).lines
    assert np.abs(line[:, 1]).max() < 0.05
    beside = along_x(18, 40, 0.3)
    assert len(join_gaps(loose(along_x(0, 20), beside), 5.0, 10.0).lines) == 2


def test_welding_across_a_gap_keeps_the_passes_in_place():
    left = run_through(star((-10.0, 0.0), (10.0, 0.0), (0.0, 8.0)))
    right = np.column_stack([np.linspace(12, 22, 11), np.zeros(11)])
    count = len(left.nodes)
    network = LineNetwork(
        (right[::-1], *left.lines),
        np.concatenate([left.nodes, right[[0, -1]]]),
        np.concatenate([[[count + 1, count]], left.ends]),
        left.passes + [0, 1, 0],
    )
    joined = join_gaps(network, 5.0, 10.0)
    check_invariants(joined)
    assert len(joined.lines) == 2
    assert max(joined.lengths()) == pytest.approx(32)


@pytest.mark.parametrize("second_is_free", [False, True])
def test_at_least_one_of_two_joined_ends_is_free(second_is_free):
    """Two branches that end in nodes of other lines stay apart, although they face each other across a gap."""
    first, second = along_x(-20, 0.05), along_x(3, 23)
    walls = [np.array([[x, -9.0], [x, 0.0], [x, 9.0]]) for x in (first[-1, 0], second[0, 0])]
    network = loose(first, second, *walls).with_end(1, first[-2:-1], 1, at=(2, 1))
    if not second_is_free:
        network = network.with_end(2, second[1:2], 1, at=(3, 1))
    joined = join_gaps(network.tidy(), 5.0, 10.0)
    assert len(joined.lines) == (3 if second_is_free else 4)
    check_invariants(joined)


def test_a_curve_is_unseen_where_cells_are_more_than_ten_centimetres_away():
    seen = cKDTree(np.concatenate([along_x(0, 5, 0.09), along_x(5, 10, 0.11), along_x(10, 15, -0.09)]))
    assert unseen_m(along_x(0, 15), seen) == pytest.approx(5.0, abs=0.11)
    assert unseen_m(np.empty((0, 2)), seen) == 0.0


@pytest.mark.parametrize(("gap_m", "count"), [(4.8, 1), (5.2, 2)])
def test_gaps_are_bridged_up_to_their_limit(gap_m, count):
    assert len(join_gaps(loose(along_x(0, 20), along_x(19.9 + gap_m, 45)), 5.0, 10.0).lines) == count


@pytest.mark.parametrize(("length_m", "count"), [(0.15, 2), (0.35, 1)])
def test_pieces_without_a_direction_are_not_joined(length_m, count):
    piece = np.array([[21.0, 0.0], [21.0 + length_m, 0.0]])
    assert len(join_gaps(loose(along_x(0, 20), piece), 5.0, 10.0).lines) == count
