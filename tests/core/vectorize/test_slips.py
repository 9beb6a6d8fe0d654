"""Slips: crossings of two rails with a curve beside them that touches both."""

import numpy as np
import pytest
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.vectorize.courses import follow_courses
from rail_extract.core.vectorize.slips import add_curves, open_slips
from scipy.spatial import cKDTree

SPACING_M, LENGTH_M = 1.507, 25.0


def lines_beside_a_slip(number=9.0, radius_m=190.0):
    """Lines of both rails as flangeways leave them: one runs along the upper legs, one along the curve, no node."""
    x = np.arange(-LENGTH_M, LENGTH_M + 0.05, 0.1)
    half_angle = 0.5 * np.arctan(1 / number)
    legs = np.abs(x) * np.tan(half_angle)
    above_m = radius_m * half_angle**2 / 2
    curve = np.where(np.abs(x) < 2 * above_m / half_angle, above_m + (x * half_angle) ** 2 / (4 * above_m), legs)
    return [np.column_stack([x, y + up]) for up in (0.0, SPACING_M) for y in (legs, -curve)]


def opened(lines):
    ends = np.arange(2 * len(lines)).reshape(-1, 2)
    nodes = np.concatenate([line[[0, -1]] for line in lines])
    seen = cKDTree(np.concatenate(lines))
    return open_slips(LineNetwork(tuple(lines), nodes, ends), seen)


@pytest.mark.parametrize(("number", "radius_m"), [(9.0, 190.0), (6.6, 117.0)])
def test_a_slip_is_found_where_no_lines_meet(number, radius_m):
    network, slips = opened(lines_beside_a_slip(number, radius_m))
    np.testing.assert_allclose(sorted(slip.cross.place[1] for slip in slips), [0.0, SPACING_M], atol=0.02)
    network = add_curves(follow_courses(network, cKDTree(np.concatenate(network.lines)), 5.0, 10.0), slips)
    assert len(network.lines) == 6
    straight = [line for line in network.lines if abs(line[-1, 1] - line[0, 1]) > 2.0]
    assert len(straight) == 4
    for line in straight:
        along = line[-1] - line[0]
        off = line - line[0]
        assert np.abs(off[:, 0] * along[1] - off[:, 1] * along[0]).max() / np.hypot(*along) < 0.02


def test_lines_that_come_close_and_part_again_are_left_as_they_are():
    lines = [line for line in lines_beside_a_slip() if line[0, 1] > line[len(line) // 2, 1]]
    other = [line * [1.0, -1.0] - [0.0, 0.3] for line in lines]
    network, slips = opened(lines + other)
    assert not slips
    assert len(network.lines) == 4


def test_a_rail_that_crosses_a_leg_of_a_slip_stays_whole():
    y = 0.1 * np.arange(-100, 101)
    crossing = np.column_stack([9.0 + 0.0 * y, y])
    network, slips = opened([*lines_beside_a_slip(), crossing])
    assert len(slips) == 2
    legs = [line for line in network.lines if np.ptp(line[:, 0]) > LENGTH_M]
    assert sorted(round(np.ptp(line[:, 0])) for line in legs) == [2 * LENGTH_M] * 4
    seen = cKDTree(np.concatenate([*lines_beside_a_slip(), crossing]))
    drawn = follow_courses(network, seen, 5.0, 10.0).lines
    assert any(np.ptp(line[:, 1]) > 19.9 and np.ptp(line[:, 0]) < 0.1 for line in drawn)
