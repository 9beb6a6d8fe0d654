"""Slips: crossings of two rails with a curve beside them that touches both."""

import numpy as np
import pytest
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.polyline import Polyline
from rail_extract.core.vectorize.cells import RailCells
from rail_extract.core.vectorize.courses import follow_courses
from rail_extract.core.vectorize.slips import add_curves, open_slips
from scipy.spatial import cKDTree

SPACING_M, LENGTH_M = 1.507, 25.0
CELL_M, HALF_HEAD_M = 0.04, 0.036


def lines_beside_a_slip(number=9.0, radius_m=190.0, spacing_m=SPACING_M):
    """Lines of both rails as flangeways leave them: one runs along the upper legs, one along the curve, no node."""
    x = np.arange(-LENGTH_M, LENGTH_M + 0.05, 0.1)
    half_angle = 0.5 * np.arctan(1 / number)
    legs = np.abs(x) * np.tan(half_angle)
    above_m = radius_m * half_angle**2 / 2
    curve = np.where(np.abs(x) < 2 * above_m / half_angle, above_m + (x * half_angle) ** 2 / (4 * above_m), legs)
    return [np.column_stack([x, y + up]) for up in (0.0, spacing_m) for y in (legs, -curve)]


def cells_of(lines):
    """Places of the cells of heads along lines."""
    dense = [Polyline(line).resampled(CELL_M / 2).xy for line in lines]
    heads = [line + [0.0, aside] for line in dense for aside in np.linspace(-1, 1, 9) * HALF_HEAD_M]
    return cKDTree(CELL_M * np.unique(np.round(np.concatenate(heads) / CELL_M), axis=0))


def opened(lines, seen=None, spacing_m=SPACING_M):
    ends = np.arange(2 * len(lines)).reshape(-1, 2)
    nodes = np.concatenate([line[[0, -1]] for line in lines])
    return open_slips(LineNetwork(tuple(lines), nodes, ends), RailCells(seen or cells_of(lines), [spacing_m]))


@pytest.mark.parametrize(("number", "radius_m"), [(9.0, 190.0), (6.6, 117.0)])
def test_a_slip_is_found_where_no_lines_meet(number, radius_m):
    network, slips = opened(lines_beside_a_slip(number, radius_m))
    np.testing.assert_allclose(sorted(slip.cross.place[1] for slip in slips), [0.0, SPACING_M], atol=0.02)
    network = add_curves(
        follow_courses(network, RailCells(cKDTree(np.concatenate(network.lines)), [SPACING_M]), 5.0, 10.0), slips
    )
    assert len(network.lines) == 6
    straight = [line for line in network.lines if abs(line[-1, 1] - line[0, 1]) > 2.0]
    assert len(straight) == 4
    for line in straight:
        along = line[-1] - line[0]
        off = line - line[0]
        assert np.abs(off[:, 0] * along[1] - off[:, 1] * along[0]).max() / np.hypot(*along) < 0.02


def lines_around_a_slip(number=9.0, radius_m=190.0, hidden_m=5.0):
    """Lines that meet in the acute frogs and end `hidden_m` from the middle of a slip, and the curves on one side."""
    half_angle = 0.5 * np.arctan(1 / number)
    slope = np.tan(half_angle)
    frog_m = SPACING_M / (2 * slope)
    frogs = [np.array([side * frog_m, SPACING_M / 2]) for side in (1, -1)]
    lines, nodes, ends = [], list(frogs), []

    def add(x, y, first, last):
        lines.append(np.column_stack([x, y]))
        ends.append([len(nodes) if first is None else first, len(nodes) + (first is None) if last is None else last])
        nodes.extend(lines[-1][at] for at, node in ((0, first), (-1, last)) if node is None)

    for up_m, rise in ((0.0, slope), (0.0, -slope), (SPACING_M, slope), (SPACING_M, -slope)):
        for number_of_frog, side in enumerate((1, -1)):
            inner, outer = (side * np.linspace(*part, 80) for part in ((hidden_m, frog_m), (frog_m, LENGTH_M)))
            meets = (up_m == 0.0) == (side * rise > 0)
            add(inner, up_m + rise * inner, None, number_of_frog if meets else len(nodes) + 1)
            if not meets:
                nodes.append(lines[-1][-1])
            add(outer, up_m + rise * outer, ends[-1][1], None)
        x, above_m = np.linspace(-7.0, 7.0, 140), radius_m * half_angle**2 / 2
        if rise > 0:
            add(x, up_m - above_m - (x * half_angle) ** 2 / (4 * above_m), None, None)
    return LineNetwork(tuple(lines), np.array(nodes), np.array(ends))


def test_a_slip_is_found_by_its_acute_frogs_where_its_middle_is_hidden():
    network = lines_around_a_slip()
    _, slips = open_slips(network, RailCells(cells_of(network.lines), [SPACING_M]))
    np.testing.assert_allclose(sorted(slip.cross.place[1] for slip in slips), [0.0, SPACING_M], atol=0.02)
    assert [len(slip.curves) for slip in slips] == [1, 1]
    heights = [slip.curves[0].height for slip in slips]
    np.testing.assert_allclose(heights, 190.0 * (0.5 * np.arctan(1 / 9)) ** 2 / 2, atol=0.03)


def test_lines_that_come_close_and_part_again_are_left_as_they_are():
    lines = [line for line in lines_beside_a_slip() if line[0, 1] > line[len(line) // 2, 1]]
    other = [line * [1.0, -1.0] - [0.0, 0.3] for line in lines]
    network, slips = opened(lines + other)
    assert not slips
    assert len(network.lines) == 4


@pytest.mark.parametrize(("number", "radius_m"), [(9.0, 190.0), (9.0, 215.0), (9.0, 230.0), (14.0, 500.0)])
def test_a_slip_curve_passes_the_crossing_as_its_radius_says(number, radius_m):
    _, slips = opened(lines_beside_a_slip(number, radius_m))
    heights = [curve.height for slip in slips for curve in slip.curves]
    expected = radius_m * (0.5 * np.arctan(1 / number)) ** 2 / 2
    np.testing.assert_allclose(heights, [expected] * 2, atol=0.03)


@pytest.mark.parametrize(("number", "spacing_m"), [(5.3, SPACING_M), (7.5, 1.07), (8.25, 1.07)])
def test_legs_of_the_other_crossing_are_not_taken_for_those_of_a_slip(number, spacing_m):
    lines = lines_beside_a_slip(number, 100.0, spacing_m)
    network, slips = opened(lines, spacing_m=spacing_m)
    drawn = add_curves(follow_courses(network, RailCells(cells_of(lines), [spacing_m]), 5.0, 10.0), slips).lines
    assert sorted(round(np.ptp(line[:, 0])) for line in drawn if np.ptp(line[:, 0]) > 20) == [2 * LENGTH_M] * 4


def test_rails_between_the_legs_of_a_slip_stay():
    x = 0.1 * np.arange(60, 101)
    between = np.column_stack([x, 0.0 * x])
    network, slips = opened([*lines_beside_a_slip(9.0, 230.0), between])
    assert [slip.clear_m for slip in slips] == [11.0, 11.0]
    assert any(np.array_equal(line, between) for line in network.lines)


def test_a_leg_is_taken_from_the_border_of_a_slip_however_far_apart_its_vertices_are():
    """A line that turns onto the rails of a frog 1.5 m behind its only vertex outside the slip (world 15369)."""
    first, *others = lines_beside_a_slip()
    first = first[(first[:, 0] < 7.95) | ((first[:, 0] > 12.0) & (first[:, 0] < 14.0))]
    first[first[:, 0] > 13.4, 1] -= 0.4
    seen = cells_of(lines_beside_a_slip())
    network, slips = opened([first, *others], seen)
    assert len(slips) == 2
    drawn = follow_courses(network, RailCells(seen, [SPACING_M]), 5.0, 10.0).lines
    assert sorted(round(np.ptp(line[:, 0])) for line in drawn) == [LENGTH_M + 14, *[2 * LENGTH_M] * 3]


@pytest.mark.parametrize("number", [9.0, 18.0, 24.0])
def test_a_crossing_with_cells_on_its_axis_is_no_slip(number):
    """At such a cell, a curve of no height was as likely as any: flat crossings stopped the run."""
    x = np.arange(-30, 30.05, 0.1)
    slope = np.tan(0.5 * np.arctan(1 / number))
    lines = [np.column_stack([x, side * slope * x + up]) for up in (0.0, SPACING_M) for side in (1, -1)]
    network, slips = opened(lines)
    assert not slips
    assert len(network.lines) == 4


@pytest.mark.parametrize(
    ("first_m", "last_m", "rails", "expected"),
    [(0.0, 3.2, 1, 2), (0.0, 3.2, 2, 2), (0.0, 5.0, 1, 2), (-5.0, 5.0, 2, 0)],
)
def test_a_slip_curve_is_found_if_half_of_it_is_seen(first_m, last_m, rails, expected):
    """A curve of 117 m is apart from the rails that cross for 8 m."""
    lines = lines_beside_a_slip(6.6, 117.0)
    x, y = np.array(cells_of(lines).data).T
    curve_m = np.array([SPACING_M * number - 117.0 * (0.5 * np.arctan(1 / 6.6)) ** 2 / 2 for number in range(rails)])
    hidden = (x > first_m) & (x < last_m) & (np.abs(y[:, None] - curve_m).min(axis=1) < 0.15)
    _, slips = opened(lines, cKDTree(np.column_stack([x, y])[~hidden]))
    assert len(slips) == expected


def test_without_rails_a_gauge_beside_a_crossing_it_is_no_slip():
    network, slips = opened(lines_beside_a_slip()[:2])
    assert not slips
    assert len(network.lines) == 2


@pytest.mark.parametrize(
    ("number", "radius_m", "spacing_m"), [(6.6, 117.0, 0.65), (7.5, 150.0, 0.65), (6.0, 100.0, 0.8)]
)
def test_the_curve_of_the_other_crossing_is_none_of_this_one(number, radius_m, spacing_m):
    """On narrow gauges, it reaches the other side of the crossing beside it."""
    _, slips = opened(lines_beside_a_slip(number, radius_m, spacing_m), spacing_m=spacing_m)
    assert [len(slip.curves) for slip in slips] == [1, 1]


def test_a_curve_beside_one_of_two_crossings_is_no_slip():
    lines = lines_beside_a_slip()
    plain = [
        np.column_stack([line[:, 0], SPACING_M + side * line[:, 0] / 18]) for line, side in zip(lines[2:], (1, -1))
    ]
    _, slips = opened(lines[:2] + plain)
    assert not slips
