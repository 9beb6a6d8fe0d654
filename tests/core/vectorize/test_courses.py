"""Rails keep their courses through crossings, past check rails, and at bends of their own."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from rail_extract.core.lines.ends import even_points
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.parameters import Parameters
from rail_extract.core.polyline import Polyline, project
from rail_extract.core.vectorize.cells import RailCells
from rail_extract.core.vectorize.courses import best_pairs, follow_courses
from rail_extract.core.vectorize.junctions import branchings, cut_bends
from scipy.spatial import cKDTree

SLOPE = 1 / 12
"""Of both rails, one upwards and one downwards: they cross at 1:6."""

SPACING_M = 1.507
"""Distance between the axes of the rails of a track."""


def leg(side, slope, first_m, aside_m=0.0, aside_length_m=3.0):
    """Draw a rail outward from near the crossing; wing rails draw it aside next to it."""
    x = np.arange(first_m, 25.0, 0.2)
    bump = np.where(x < aside_length_m, np.sin(np.pi * x / aside_length_m), 0.0)
    return np.column_stack([side * x, slope * side * x + aside_m * bump])


def network(legs, links, nodes):
    """Join legs, each with the node that it begins in, and links between two nodes."""
    lines = [np.concatenate([[nodes[node]], line]) for node, line in legs]
    lines += [np.vstack([nodes[one], middle, nodes[other]]).astype(float) for one, middle, other in links]
    tips = [line[-1] for _, line in legs]
    ends = [(node, len(nodes) + number) for number, (node, _) in enumerate(legs)]
    ends += [(one, other) for one, _, other in links]
    return LineNetwork(tuple(lines), np.array([*nodes, *tips], dtype=float), np.array(ends))


def resolved(drawn, spacings_m=(), seen=None):
    """Follow the courses of lines that cells show, with the longest gap and the angle of the defaults."""
    seen = seen or cKDTree(np.concatenate(drawn.lines))
    return follow_courses(cut_bends(drawn), RailCells(seen, spacings_m), Parameters.max_gap_m, Parameters.gap_angle_deg)


def check_that_two_rails_cross(found):
    whole = [line for line in found.lines if np.ptp(line[:, 0]) > 45]
    assert len(whole) == len(found.lines) == 2
    for line in whole:
        rising = SLOPE * np.sign((line[-1, 1] - line[0, 1]) * (line[-1, 0] - line[0, 0]))
        off = np.abs(line[:, 1] - rising * line[:, 0])
        assert off.max() < 0.07
        assert off[np.abs(line[:, 0]) > 3.5].max() < 0.01


@pytest.mark.parametrize("aside_m", [0.0, 0.1, 0.12, 0.14])
def test_legs_that_wing_rails_draw_aside_continue_straight(aside_m):
    legs = [
        *((0, leg(-1, slope, 0.2)) for slope in (SLOPE, -SLOPE)),
        *((0, leg(1, slope, 0.2, np.sign(slope) * aside_m)) for slope in (SLOPE, -SLOPE)),
    ]
    check_that_two_rails_cross(resolved(network(legs, (), [(0.0, 0.0)])))


@pytest.mark.parametrize("length_m", [7.0, 7.5])
def test_short_legs_that_wing_rails_draw_apart_still_cross(length_m):
    legs = [
        *((0, leg(-1, slope, 0.2)) for slope in (SLOPE, -SLOPE)),
        *((0, leg(1, slope, 0.2, aside_m, 4.0)) for slope, aside_m in ((SLOPE, 0.14), (-SLOPE, -0.1))),
    ]
    legs = [(node, line[np.abs(line[:, 0]) < length_m]) for node, line in legs]
    found = resolved(network(legs, (), [(0.0, 0.0)]))
    assert len(found.lines) == 2
    for line in found.lines:
        assert np.sign(line[0]) @ np.sign(line[-1]) == -2.0


def test_a_frog_of_several_nodes_is_one_crossing():
    nodes = [(-0.6, 0.0), (0.6, 0.05), (1.5, -1.5 * SLOPE)]
    legs = [(0, leg(-1, SLOPE, 0.8)), (0, leg(-1, -SLOPE, 0.8)), (1, leg(1, SLOPE, 0.8)), (2, leg(1, -SLOPE, 1.7))]
    links = [(0, (0.0, 0.12), 1), (0, (0.0, -0.06), 1)]
    check_that_two_rails_cross(resolved(network(legs, links, nodes)))


@pytest.mark.parametrize(("number", "half_m", "aside_m"), [(12, 4.0, 0.08), (20, 4.0, 0.08), (24, 5.0, 0.06)])
def test_two_rails_that_share_a_long_way_with_bends_cross(number, half_m, aside_m):
    slope = 0.5 / number
    nodes = [(-half_m, 0.0), (-half_m / 3, aside_m), (half_m / 3, -aside_m), (half_m, 0.0)]
    legs = [(node, leg(side, way, half_m + 0.2)) for node, side in ((0, -1), (3, 1)) for way in (slope, -slope)]
    links = [
        (one, even_points(np.array([nodes[one], middle, nodes[one + 1]]))[1:-1], one + 1)
        for one, middle in enumerate([(-2 * half_m / 3, aside_m), (0.0, 0.0), (2 * half_m / 3, -aside_m)])
    ]
    found = resolved(network(legs, links, nodes))
    assert len(found.lines) == 2
    for line in found.lines:
        assert np.abs(line[:, 1]).min() < 0.01 < 0.8 * slope * 25 < np.abs(line[[0, -1], 1]).min()
        assert line[0, 1] * line[-1, 1] < 0


def beside(through, first, last):
    """A line through, and two lines whose free ends face each other beside it."""
    lines = [through, first, last]
    ends = np.concatenate([line[[0, -1]] for line in lines])
    return LineNetwork(tuple(lines), ends, np.arange(6).reshape(-1, 2))


def test_a_line_that_changes_from_rail_to_rail_where_flangeways_cut_both_off_is_two_rails_that_cross():
    through = np.concatenate([leg(-1, SLOPE, 0.2)[::-1], leg(1, -SLOPE, 0.2)])
    found = resolved(beside(through, leg(-1, -SLOPE, 1.5)[::-1], leg(1, SLOPE, 1.5)))
    check_that_two_rails_cross(found)


def test_check_rails_that_face_each_other_beside_a_rail_do_not_cross_it():
    x = np.arange(-25.0, 25.0, 0.2)
    apart = beside(
        *(
            np.column_stack([x[own], np.full(own.sum(), y)])
            for own, y in ((np.isfinite(x), 0.0), (x < -1.5, 0.15), (x > 1.5, 0.15))
        )
    )
    found = resolved(apart)
    assert sorted(float(line[0, 1]) for line in found.lines) == [0.0, 0.15]
    assert all(np.ptp(line[:, 1]) < 0.001 for line in found.lines)


@pytest.mark.parametrize("length_m", [6.0, 9.0, 13.0])
def test_the_rail_between_the_toe_and_the_frog_of_a_short_turnout_is_not_the_shared_part_of_a_crossing(length_m):
    x = np.arange(0.2, 25.0, 0.2)
    nodes = [(0.0, 0.0), (length_m, 0.0)]
    legs = [
        (0, np.column_stack([-x, 0 * x])),
        (0, np.column_stack([x, x**2 / 400])),
        (1, np.column_stack([length_m + x, 0 * x])),
        (1, np.column_stack([length_m - x[:-60], (length_m - x[:-60]) ** 2 / 400 - length_m**2 / 400])),
    ]
    turnout = network(legs, [(0, (length_m / 2, 0.0), 1)], nodes)
    found = resolved(turnout)
    on_it = [line for line in found.lines if np.any((np.abs(line[:, 0] - length_m / 2) < 0.5) & (line[:, 1] == 0))]
    assert len(on_it) == 1


def around_holes(holes_m, neck_m=0.3):
    """Draw links around holes between heads that touch in between, and list the nodes where they touch."""
    x = np.cumsum([0.0, *(length for hole_m in holes_m for length in (hole_m, neck_m))])
    sides = [(2 * k, (x[2 * k : 2 * k + 2].mean(), up), 2 * k + 1) for k in range(len(holes_m)) for up in (0.1, -0.1)]
    necks = [(k, (x[k : k + 2].mean(), 0.0), k + 1) for k in range(1, len(x) - 1, 2)]
    return sides + necks, [(place, 0.0) for place in x]


@pytest.mark.parametrize("number", [20, 25, 30])
@pytest.mark.parametrize("spacings_m", [(SPACING_M,), (1.07, SPACING_M)])
def test_rails_that_cross_at_a_small_angle_stay_beside_their_partners(number, spacings_m):
    """Wing rails that draw the legs apart turn their directions by as much as the angle at which the rails cross."""
    slopes = 0.5 / number, -0.5 / number
    ways = [(side, slope) for side in (-1, 1) for slope in slopes]
    legs = [(int(side > 0), leg(side, slope, 2.0, 0.05 * np.sign(side * slope), 6.0)) for side, slope in ways]
    drawn = network(legs, [(0, [(0.0, 0.0)], 1)], [(-1.8, 0.0), (1.8, 0.0)])
    x = np.arange(-25.0, 25.0, 0.1)
    partners = [np.column_stack([x, slope * x + np.sign(slope) * SPACING_M]) for slope in slopes]
    found = resolved(drawn, spacings_m, cKDTree(np.concatenate([*map(even_points, drawn.lines), *partners])))
    whole = [line for line in found.lines if np.ptp(line[:, 0]) > 45]
    assert len(whole) == 2
    assert all(line[0, 1] * line[-1, 1] < 0 for line in whole)


@pytest.mark.parametrize("holes_m", [(0.5,), (1.5,), (0.6, 1.1)])
def test_a_hole_in_a_rail_is_no_second_rail(holes_m):
    links, nodes = around_holes(holes_m)
    x = np.arange(0.2, 25.0, 0.2)
    ends = [(0, np.column_stack([-x, 0 * x])), (len(nodes) - 1, np.column_stack([nodes[-1][0] + x, 0 * x]))]
    (whole,) = resolved(network(ends, links, nodes)).lines
    assert np.abs(whole[:, 1]).max() < 1e-9
    assert np.ptp(whole[:, 0]) > 49


@pytest.mark.parametrize("holes_m", [(0.6,), (1.4,), (0.6, 1.1)])
def test_holes_where_heads_begin_to_part_leave_one_branching(holes_m):
    """In worlds 10393 and 10512, blurred heads that part touched again beyond a hole: the branch began there."""
    links, nodes = around_holes(holes_m)
    x = np.arange(0.2, 25.0, 0.2)
    stem = (0, np.column_stack([-x, 0 * x]))
    part = [(len(nodes) - 1, np.column_stack([nodes[-1][0] + x, 0.1 + 0 * x + side * (0.06 * x)])) for side in (0, 1)]
    found = resolved(network([stem, *part], links, nodes))
    ((node, through, _),) = branchings(found)
    assert len(found.lines) == 3
    assert found.from_end(through)[-1, 0] < 0
    np.testing.assert_allclose(found.nodes[node], nodes[-1])


LENGTH_M, RAMP_M, CHECK_RAIL_M = 60.0, 2.0, 0.13


def rail(radius_m=np.inf, begins_m=0.0, ends_m=LENGTH_M):
    """Points every 0.1 m of a line that is an arc between two chainages, and straight elsewhere, (n, 2)."""
    t = np.arange(0.0, LENGTH_M + 0.05, 0.1)
    heading = (np.clip(t, begins_m, ends_m) - begins_m) / radius_m
    steps = 0.1 * np.column_stack([np.cos(heading), np.sin(heading)])
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps[:-1], axis=0)])


def led_aside(points, start_m, length_m, aside_m=CHECK_RAIL_M):
    """Lead a line aside between two chainages, over ramps at both ends."""
    own = Polyline(points)
    knots = start_m + np.array([0.0, RAMP_M, length_m - RAMP_M, length_m])
    return points + np.interp(own.t, knots, [0.0, aside_m, aside_m, 0.0])[:, None] * own.normals


def followed(line):
    """Cut one line at its bends and follow its course; the cells that show it are as wide as a head."""
    sides = 0.036 * Polyline(line).normals
    network = LineNetwork((line,), line[[0, -1]], np.array([[0, 1]]))
    seen = cKDTree(np.concatenate([line + sides, line - sides]))
    (only,) = resolved(network, seen=seen).lines
    return only


def farthest(line, truth):
    """Largest distance of the vertices of a line from another line, metres."""
    return float(np.abs(project([truth], line, 1.0).across).max())


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from([np.inf, 1500.0, 300.0, -190.0]),
    st.floats(12.0, 35.0),
    st.floats(4.5, 8.0),
    st.sampled_from([CHECK_RAIL_M, -CHECK_RAIL_M]),
    st.integers(0, 1000),
)
@example(np.inf, 22.0, 13.0, CHECK_RAIL_M, 0)
def test_a_line_is_led_past_a_check_rail(radius_m, start_m, length_m, aside_m, seed):
    truth = rail(radius_m)
    drawn = led_aside(truth, start_m, length_m, aside_m)
    drawn = drawn + np.random.default_rng(seed).uniform(-0.005, 0.005, drawn.shape)
    assert farthest(drawn, truth) > 0.12
    assert farthest(followed(drawn), truth) < 0.03


def test_each_of_several_check_rails_is_passed():
    truth = rail()
    drawn = led_aside(led_aside(truth, 8.0, 5.0), 35.0, 6.0, -CHECK_RAIL_M)
    assert farthest(followed(drawn), truth) < 0.01


@pytest.mark.parametrize(("radius_m", "length_m"), [(25, 30), (100, 30), (500, 30), (60, 3), (100, 5)])
def test_curves_of_trams_and_turnouts_stay(radius_m, length_m):
    line = rail(radius_m, LENGTH_M / 2, LENGTH_M / 2 + length_m)
    assert farthest(followed(line), line) < 0.02


@pytest.mark.parametrize(("length_m", "gap_m"), [(0.5, 0.5), (1.0, 1.0), (1.5, 2.0), (2.0, 3.0)])
def test_a_rail_that_is_seen_in_short_pieces_is_one_line(length_m, gap_m):
    starts = np.arange(0.0, LENGTH_M, length_m + gap_m)
    pieces = [np.column_stack([np.linspace(x, x + length_m, 9), np.zeros(9)]) for x in starts]
    ends = np.concatenate([piece[[0, -1]] for piece in pieces])
    found = resolved(LineNetwork(tuple(pieces), ends, np.arange(len(ends)).reshape(-1, 2)))
    (only,) = found.lines
    assert np.ptp(only[:, 0]) == pytest.approx(starts[-1] + length_m)


@pytest.mark.parametrize("turn_deg", [30.0, 45.0, 80.0])
def test_lines_that_meet_in_a_kink_are_two(turn_deg):
    turn = np.radians(turn_deg)
    x = np.arange(0.0, 20.0, 0.2)[:, None]
    line = np.concatenate([x[::-1] * [-1.0, 0.0], x[1:] * [np.cos(turn), np.sin(turn)]])
    assert len(resolved(LineNetwork((line,), line[[0, -1]], np.array([[0, 1]]))).lines) == 2


def test_two_copies_of_a_line_are_not_joined():
    line = rail()[:100]
    found = resolved(LineNetwork((line, line), line[[0, -1, 0, -1]], np.arange(4).reshape(-1, 2)))
    assert len(found.lines) == 2


@pytest.mark.parametrize("seed", range(20))
def test_the_best_pairs_have_about_the_largest_sum(seed):
    random = np.random.default_rng(seed)
    gains = {pair: float(random.uniform(-1, 5)) for pair in combinations(range(6), 2) if random.random() < 0.7}
    chosen = best_pairs(gains)
    assert len({number for pair in chosen for number in pair}) == 2 * len(chosen)

    def best(left):
        if len(left) < 2:
            return 0.0
        first, rest = left[0], left[1:]
        with_first = [gains.get((first, one), -9.0) + best([two for two in rest if two != one]) for one in rest]
        return max(best(rest), *with_first)

    assert sum(gains[pair] for pair in chosen) >= 0.75 * best(list(range(6)))


def test_pairs_of_a_large_tangle_are_found_at_once():
    """Comparing all ways to resolve its rings would take years."""
    gains = {(one, (one + step) % 300): 1.0 for one in range(300) for step in (1, 2, 3)}
    gains = {(min(pair), max(pair)): gain for pair, gain in gains.items()}
    assert len(best_pairs(gains)) > 140


def test_far_from_the_origin_rails_cross_as_near_it():
    legs = [(0, leg(side, slope, 0.2)) for side in (-1, 1) for slope in (SLOPE, -SLOPE)]
    near = network(legs, (), [(0.0, 0.0)])
    far = LineNetwork(tuple(line + [5e5, 3e6] for line in near.lines), near.nodes + [5e5, 3e6], near.ends)
    assert len(resolved(far).lines) == len(resolved(near).lines) == 2
