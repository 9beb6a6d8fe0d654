"""Pairing, and the matching of two polylines, compared with an exhaustive search on small lattices."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from built import beside, rails_of, tracks
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.parameters import Parameters
from rail_extract.core.tracks.pairing import (
    match_polylines,
    pair_rails,
)
from rail_extract.laboratory.curves import Element, trace, transition_curve

GAUGE, WIDTH = 1.435, 0.072
STANDARD = Parameters(GAUGE, WIDTH)
SPACING = GAUGE + WIDTH


STRAIGHT = trace([Element(60.0)], heading=0.7)
CURVED = trace(transition_curve(30, 40, 60, 1 / 300), heading=2.0)
TRAM = trace([Element(10), Element(40, 1 / 25, 1 / 25), Element(10)])

COUNT = st.integers(2, 7)
SEEDS = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize("curve", [STRAIGHT, CURVED, TRAM])
@pytest.mark.parametrize("turned", [(False, False), (True, False), (False, True), (True, True)])
@pytest.mark.parametrize("order", [1, -1])
def test_two_rails_pair_along_their_whole_length_in_any_direction(curve, turned, order):
    lines = [line[::-1] if turn else line for line, turn in zip(tracks(curve, 0.0), turned)]
    rails = rails_of(*lines[::order])
    (pair,) = pair_rails(rails, STANDARD)
    assert pair.length_m == pytest.approx(curve.length_m, abs=0.1)
    left, right = (rails[number].xyz[:, :2] for number in (pair.left, pair.right))
    start_left, start_right = (
        line[0 if span[0] < span[1] else -1] for line, span in ((left, pair.left_span), (right, pair.right_span))
    )
    end_left = left[-1 if pair.left_span[0] < pair.left_span[1] else 0]
    chord, to_right = end_left - start_left, start_right - start_left
    assert chord[0] * to_right[1] - chord[1] * to_right[0] < 0 or curve is TRAM
    mirrored = pair.reversed()
    assert (mirrored.left, mirrored.right) == (pair.right, pair.left)
    assert mirrored.left_span == pair.right_span[::-1]


@pytest.mark.parametrize("distance", [3.5, 4.5])
def test_rails_of_neighbouring_tracks_never_pair(distance):
    rails = rails_of(*tracks(CURVED, 0.0, distance, 2 * distance))
    pairs = pair_rails(rails, STANDARD)
    assert sorted(tuple(sorted((pair.left, pair.right))) for pair in pairs) == [(0, 1), (2, 3), (4, 5)]


@pytest.mark.parametrize("curve", [STRAIGHT, CURVED, TRAM])
@pytest.mark.parametrize("count", [2, 3, 4, 5])
@pytest.mark.parametrize("off", [-0.03, 0.0, 0.03])
def test_inner_rails_of_neighbouring_tracks_at_gauge_make_no_track(curve, count, off):
    """As with trams in narrow streets, where the inner rails of neighbouring tracks are at gauge as well."""
    rails = rails_of(*tracks(curve, *((2 * SPACING + off) * np.arange(count))))
    pairs = pair_rails(rails, STANDARD)
    found = sorted(tuple(sorted((pair.left, pair.right))) for pair in pairs)
    assert found == [(2 * number, 2 * number + 1) for number in range(count)]


def test_a_rail_shared_by_two_tracks_belongs_to_both():
    rails = rails_of(*beside(STRAIGHT, 0.0, SPACING, 2 * SPACING))
    assert len(pair_rails(rails, STANDARD)) == 2


@pytest.mark.parametrize(("height", "count"), [(0.0, 1), (0.18, 1), (6.5, 0), (np.nan, 1)])
def test_rails_on_two_levels_are_not_a_track(height, count):
    left, right = tracks(STRAIGHT, 0.0)
    assert len(pair_rails(rails_of(left, np.column_stack([right, np.full(len(right), height)])), STANDARD)) == count


@pytest.mark.parametrize(("widening", "count"), [(0.04, 1), (-0.04, 1), (0.06, 0), (-0.06, 0)])
def test_rails_pair_within_the_tolerance_of_the_gauge(widening, count):
    rails = rails_of(*tracks(STRAIGHT, 0.0, spacing=SPACING + widening))
    assert len(pair_rails(rails, STANDARD)) == count


def test_dual_gauge_pairs_by_gauge():
    rails = rails_of(*beside(STRAIGHT, 0.0, -(1.0 + WIDTH), -SPACING))
    assert [(p.left, p.right) for p in pair_rails(rails, STANDARD)] == [(0, 2)]
    assert [(p.left, p.right) for p in pair_rails(rails, Parameters(1.0, WIDTH))] == [(0, 1)]


def test_rails_of_different_classes_do_not_pair():
    rails = rails_of(*tracks(STRAIGHT, 0.0))
    assert pair_rails([rails[0], replace(rails[1], class_code=11)], STANDARD) == ()


def wandering(rng, curve, offset, sigma_m):
    """A line beside a curve that wanders as lids of 1 m do once smoothed."""
    chainage = curve.chainage[::10]
    knots = np.arange(0, chainage[-1] + 2)
    return curve.offset(np.interp(curve.chainage, knots, offset + sigma_m * rng.standard_normal(len(knots))))[::10]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("widening", [0.0, 0.02])
@pytest.mark.parametrize("side", [1, -1])
def test_the_edge_of_a_cable_trough_is_no_partner(seed, widening, side):
    """It is 1475 mm from the rail, within the tolerance, and wanders by 6 mm."""
    rng = np.random.default_rng(seed)
    spacing = SPACING + widening
    edge = wandering(rng, CURVED, side * (spacing / 2 + 1.475), 0.006)
    lines = [*tracks(CURVED, 0.0, spacing=spacing), edge]
    (pair,) = pair_rails(rails_of(*lines), STANDARD)
    assert {pair.left, pair.right} == {0, 1}


@pytest.mark.parametrize("seed", range(3))
def test_wandering_lines_on_both_sides_do_not_make_the_track_between_them_a_ghost(seed):
    rng = np.random.default_rng(seed)
    edges = [
        wandering(rng, CURVED, side * (SPACING / 2 + 1.475), sigma_m) for side, sigma_m in ((1, 0.02), (-1, 0.006))
    ]
    pairs = pair_rails(rails_of(*tracks(CURVED, 0.0), *edges), STANDARD)
    assert {frozenset((pair.left, pair.right)) for pair in pairs} == {frozenset((0, 1))}
    assert sum(pair.length_m for pair in pairs) == pytest.approx(CURVED.length_m, abs=0.5)


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
