import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.tracks.dtw import match_polylines

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
