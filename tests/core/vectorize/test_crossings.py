"""Crossings whose wing rails and flangeways disturb the raster."""

import numpy as np
import pytest
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.vectorize.crossings import resolve_crossings

SLOPE = 1 / 12
"""Of both rails, one upwards and one downwards: they cross at 1:6."""


def leg(side, slope, first_m, aside_m=0.0, aside_length_m=3.0):
    """Draw a rail outward from near the crossing; wing rails draw it aside next to it."""
    x = np.arange(first_m, 25.0, 0.2)
    bump = np.where(x < aside_length_m, np.sin(np.pi * x / aside_length_m), 0.0)
    return np.column_stack([side * x, slope * side * x + aside_m * bump])


def network(legs, links, nodes):
    """Join legs, each with the node that it begins in, and links between two nodes."""
    lines = [np.concatenate([[nodes[node]], line]) for node, line in legs]
    lines += [np.array([nodes[one], middle, nodes[other]], dtype=float) for one, middle, other in links]
    tips = [line[-1] for _, line in legs]
    ends = [(node, len(nodes) + number) for number, (node, _) in enumerate(legs)]
    ends += [(one, other) for one, _, other in links]
    return LineNetwork(tuple(lines), np.array([*nodes, *tips], dtype=float), np.array(ends))


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
    check_that_two_rails_cross(resolve_crossings(network(legs, (), [(0.0, 0.0)])))


@pytest.mark.parametrize("length_m", [7.0, 7.5])
def test_short_legs_that_wing_rails_draw_apart_still_cross(length_m):
    legs = [
        *((0, leg(-1, slope, 0.2)) for slope in (SLOPE, -SLOPE)),
        *((0, leg(1, slope, 0.2, aside_m, 4.0)) for slope, aside_m in ((SLOPE, 0.14), (-SLOPE, -0.1))),
    ]
    legs = [(node, line[np.abs(line[:, 0]) < length_m]) for node, line in legs]
    found = resolve_crossings(network(legs, (), [(0.0, 0.0)]))
    assert len(found.lines) == 2
    for line in found.lines:
        assert np.sign(line[0]) @ np.sign(line[-1]) == -2.0


def test_a_frog_of_several_nodes_is_one_crossing():
    nodes = [(-0.6, 0.0), (0.6, 0.05), (1.5, -1.5 * SLOPE)]
    legs = [(0, leg(-1, SLOPE, 0.8)), (0, leg(-1, -SLOPE, 0.8)), (1, leg(1, SLOPE, 0.8)), (2, leg(1, -SLOPE, 1.7))]
    links = [(0, (0.0, 0.12), 1), (0, (0.0, -0.06), 1)]
    check_that_two_rails_cross(resolve_crossings(network(legs, links, nodes)))


def beside(through, first, last):
    """A line through, and two lines whose free ends face each other beside it."""
    lines = [through, first, last]
    ends = np.concatenate([line[[0, -1]] for line in lines])
    return LineNetwork(tuple(lines), ends, np.arange(6).reshape(-1, 2))


def test_a_line_that_changes_from_rail_to_rail_where_flangeways_cut_both_off_is_two_rails_that_cross():
    through = np.concatenate([leg(-1, SLOPE, 0.2)[::-1], leg(1, -SLOPE, 0.2)])
    found = resolve_crossings(beside(through, leg(-1, -SLOPE, 1.5)[::-1], leg(1, SLOPE, 1.5)))
    check_that_two_rails_cross(found)


def test_check_rails_that_face_each_other_beside_a_rail_do_not_cross_it():
    x = np.arange(-25.0, 25.0, 0.2)
    apart = beside(
        *(
            np.column_stack([x[own], np.full(own.sum(), y)])
            for own, y in ((np.isfinite(x), 0.0), (x < -1.5, 0.15), (x > 1.5, 0.15))
        )
    )
    found = resolve_crossings(apart)
    assert sorted(map(len, found.lines)) == sorted(map(len, apart.lines))
    assert all(np.ptp(line[:, 1]) == 0 for line in found.lines)


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
    found = resolve_crossings(turnout)
    on_it = [line for line in found.lines if np.any((np.abs(line[:, 0] - length_m / 2) < 0.5) & (line[:, 1] == 0))]
    assert len(on_it) == 1
