"""Parts of rails in a square, and the blend of one into the next."""

import numpy as np
import pytest
from rail_extract.core.frame import LocalFrame
from rail_extract.core.rails import RailLine
from rail_extract.core.squares.grid import HALO_M, Square, unique_keys
from rail_extract.core.squares.pieces import (
    blended,
    extended,
    parts_near,
    smooth_step,
)


def rail(xyz):
    return RailLine(np.asarray(xyz, dtype=float), 1, 10, 10, 1.0, 1.0, 0.0)


def straight(start_m, end_m, y_m=0.0, z_m=0.0, step_m=0.25):
    x = np.arange(start_m, end_m + step_m / 2, step_m)
    return np.column_stack([x, np.full(len(x), y_m), np.full(len(x), z_m)])


def test_parts_near_a_square_reach_one_vertex_beyond_its_surroundings():
    square = Square.on_grid((0, 0), 10.0, LocalFrame(np.zeros(3)))
    line = straight(-20, 30, 5.0, step_m=1.0)
    (part,) = parts_near([rail(line)], square, np.zeros(2), 2.5)
    assert part[:, 0].tolist() == list(range(-3, 14))
    there_and_back = np.array([[5, 5, 0], [30, 5, 0], [30, 6, 0], [5, 6, 0]])
    assert [len(part) for part in parts_near([rail(there_and_back)], square, np.zeros(2), 2.5)] == [2, 2]


@pytest.mark.parametrize("start_m", [10.0, 20.25])
def test_an_end_takes_on_the_place_of_the_line_that_continues_it(start_m):
    """The second one begins a quarter of a metre behind the end, where only its extension shows the offset."""
    line = blended(rail(straight(0, 20)), 1, rail(straight(start_m, 40, 0.02, 0.05)))
    assert line.xyz[-1, 1:] == pytest.approx([0.02, 0.05])
    assert not line.xyz[line.xyz[:, 0] < 20 - 2 * HALO_M, 1:].any()
    assert (np.diff(line.xyz[:, 1]) >= 0).all()
    middle = line.xyz[np.searchsorted(line.xyz[:, 0], 20 - HALO_M), 1:]
    assert middle == pytest.approx([0.01, 0.025])
    other = blended(rail(straight(0, 20)[::-1]), 0, rail(straight(start_m, 40, 0.02, 0.05)))
    assert other.xyz[::-1] == pytest.approx(line.xyz)


def test_a_line_is_extended_with_its_curvature():
    t = np.arange(0, 20.1, 0.25) / 100
    line = extended(100 * np.column_stack([np.sin(t), 1 - np.cos(t)]))
    assert np.abs(np.hypot(line[:, 0], line[:, 1] - 100) - 100).max() < 1e-4
    assert len(line) == len(t) + 6


def test_no_points_lie_in_no_square():
    keys, number = unique_keys(np.empty((0, 3)), 10.0)
    assert keys == []
    assert number.shape == (0,)


def marks(text):
    return np.array([letter == "x" for letter in text])


def test_the_weight_of_a_blend_has_no_bend_at_its_ends():
    assert smooth_step(np.array([0.0, 0.25, 0.5, 1.0])) == pytest.approx([0.0, 0.15625, 0.5, 1.0])
