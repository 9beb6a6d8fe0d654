import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.tracks.dtw import distance_to_segment, match_polylines, squared_distance_integral

COUNT = st.integers(2, 7)
SEEDS = st.integers(0, 2**32 - 1)


def wandering_line(random, count):
    return np.cumsum(np.column_stack([random.uniform(0.1, 0.6, count), random.normal(0, 0.2, count)]), axis=0)


def edge_between(first, second, node, target):
    """Length, penalty and smallest distance of a lattice edge, by sampling the segment."""
    (i, j), (i_next, j_next) = node, target
    point, a, b = (first[i], second[j], second[j_next]) if i == i_next else (second[j], first[i], first[i_next])
    share = (np.arange(4000) + 0.5) / 4000
    squared = ((a + share[:, None] * (b - a) - point) ** 2).sum(axis=1)
    length = np.linalg.norm(b - a)
    ends = min(np.linalg.norm(a - point), np.linalg.norm(b - point))
    return length, squared.mean() * length, min(np.sqrt(squared.min()), ends)


def best_by_exhaustive_search(first, second, tolerance):
    """Length and penalty of the longest of all lattice paths, the cheapest if several are equally long."""
    edges = {}
    for node in itertools.product(range(len(first)), range(len(second))):
        for target in ((node[0], node[1] + 1), (node[0] + 1, node[1])):
            if target[0] < len(first) and target[1] < len(second):
                length, penalty, distance = edge_between(first, second, node, target)
                if distance < tolerance:
                    edges.setdefault(node, []).append((target, length, penalty))
    best = (0.0, 0.0)
    stack = [(node, 0.0, 0.0) for node in edges]
    while stack:
        node, length, penalty = stack.pop()
        if (length - best[0], best[1] - penalty) > (1e-9, 0) or (abs(length - best[0]) <= 1e-9 and penalty < best[1]):
            best = (length, penalty)
        stack.extend((target, length + own, penalty + cost) for target, own, cost in edges.get(node, []))
    return best


@given(SEEDS, COUNT, COUNT, st.floats(0.2, 0.8))
@settings(max_examples=60, deadline=None)
def test_longest_match_equals_exhaustive_search(seed, count_first, count_second, tolerance):
    random = np.random.default_rng(seed)
    first, second = wandering_line(random, count_first), wandering_line(random, count_second)
    length, penalty = best_by_exhaustive_search(first, second, tolerance)
    matches = match_polylines(first, second, tolerance)
    assert bool(matches) == (length > 0)
    if matches:
        assert matches[0].length == pytest.approx(length, abs=1e-9)
        assert matches[0].penalty == pytest.approx(penalty, rel=1e-4)


@given(SEEDS, st.integers(2, 30), st.integers(2, 30))
@settings(deadline=None)
def test_matching_is_symmetric_and_does_not_depend_on_joint_reversal(seed, count_first, count_second):
    random = np.random.default_rng(seed)
    first, second = wandering_line(random, count_first), wandering_line(random, count_second)
    figures = [
        [(match.length, match.penalty) for match in match_polylines(*pair, 0.4)[:1]]
        for pair in ((first, second), (second, first), (first[::-1], second[::-1]))
    ]
    np.testing.assert_allclose(figures[1], figures[0])
    np.testing.assert_allclose(figures[2], figures[0])


@given(SEEDS, st.integers(2, 30), st.integers(2, 30))
@settings(deadline=None)
def test_matches_are_monotone_lattice_paths_with_their_own_sums(seed, count_first, count_second):
    random = np.random.default_rng(seed)
    first, second = wandering_line(random, count_first), wandering_line(random, count_second)
    for match in match_polylines(first, second, 0.4):
        steps = np.column_stack([np.diff(match.first), np.diff(match.second)])
        assert set(map(tuple, steps.tolist())) <= {(0, 1), (1, 0)}
        lengths = [np.linalg.norm(np.diff(line, axis=0), axis=1) for line in (first, second)]
        both = sum(own[nodes[0] : nodes[-1]].sum() for own, nodes in zip(lengths, (match.first, match.second)))
        assert match.length == pytest.approx(both)


def test_two_separate_sections_give_two_matches():
    x = np.arange(0, 10, 0.1)
    straight = np.column_stack([x, np.zeros_like(x)])
    bulging = np.column_stack([x, np.where((x > 4) & (x < 6), 1.0, 0.01)])
    matches = match_polylines(straight, bulging, 0.2)
    assert len(matches) == 2
    assert all(4.0 < match.length / 2 < 4.7 for match in matches)
    assert matches[0].first.max() < matches[1].first.min() or matches[1].first.max() < matches[0].first.min()


def test_lines_beyond_the_tolerance_do_not_match():
    x = np.arange(0, 5, 0.1)
    assert match_polylines(np.column_stack([x, 0 * x]), np.column_stack([x, 0 * x + 0.3]), 0.2) == []


def test_opposite_directions_match_only_where_they_cross():
    x = np.arange(0, 10, 0.025)
    line = np.column_stack([x, np.zeros_like(x)])
    assert match_polylines(line, line[::-1], 0.05)[0].length < 0.2


def test_midpoints_of_concentric_arcs_are_on_the_arc_between():
    radius, spacing = 200.0, 1.507
    arcs = []
    for ring, count in ((radius - spacing / 2, 1301), (radius + spacing / 2, 1307)):
        angle = np.linspace(0, 32 / radius, count)
        arcs.append(ring * np.column_stack([np.cos(angle), np.sin(angle)]))
    inward = [arc / np.linalg.norm(arc, axis=1, keepdims=True) * radius for arc in arcs]
    match = match_polylines(*inward, 0.05)[0]
    assert match.length == pytest.approx(64.0, abs=1e-3)
    middle = (arcs[0][match.first] + arcs[1][match.second]) / 2
    np.testing.assert_allclose(np.linalg.norm(middle, axis=1), radius, atol=1e-4)


def test_penalty_integral_of_known_segments():
    p, q = np.array([[-1.0, 2.0], [0.0, 0.0]]), np.array([[1.0, 2.0], [3.0, 0.0]])
    np.testing.assert_allclose(squared_distance_integral(p, q), [2 * 4 + 2 / 3, 9.0])
    np.testing.assert_allclose(distance_to_segment(p, q), [2.0, 0.0])
