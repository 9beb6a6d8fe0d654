import numpy as np
import pytest
from rail_extract.core.classify.lines import Lines
from rail_extract.core.classify.settings import HEADS
from rail_extract.core.classify.sides import stands_free
from rail_extract.core.classify.tops import Grid, tops_of
from rail_extract.laboratory.scenes.raw_shapes import MIDDLE, flat, with_bar

CELL, WIDTH = 0.04, 0.072


def free(xyz, left=0.0):
    """Whether a line along x through MIDDLE stands free."""
    grid, cell = Grid.around(xyz[:, 0], xyz[:, 1], CELL)
    tops = tops_of(grid, cell, xyz[:, 2].astype(np.float32), xyz[:, 2].astype(np.float32))
    axis = MIDDLE[None] + [[0.0, left]]
    line = Lines(axis, np.array([0.17]), np.zeros(1), np.ones(1), np.ones(1), 1.0)
    return bool(stands_free(tops, HEADS, grid.cells(axis)[0], line)[0])


def test_a_rail_stands_free():
    assert free(with_bar(flat(3.0), WIDTH)[0])


@pytest.mark.parametrize("side", [1, -1])
def test_a_rail_with_a_guard_rail_stands_free(side):
    xyz, _ = with_bar(with_bar(flat(3.0), WIDTH)[0], WIDTH, left_m=side * (WIDTH + 0.045))
    assert free(xyz)


@pytest.mark.parametrize("side", [1, -1])
def test_the_edge_of_something_wide_does_not(side):
    xyz, _ = with_bar(flat(3.0), 0.36, left_m=side * 0.15)
    assert not free(xyz)


def test_the_edge_of_what_is_hidden_behind_does_not():
    xyz, _ = with_bar(flat(3.0), 0.36, left_m=0.15)
    hidden = xyz[xyz[:, 1] < MIDDLE[1] + 0.33]
    assert not free(hidden)


def test_what_is_not_seen_is_not_higher():
    xyz, _ = with_bar(flat(3.0), WIDTH)
    assert free(xyz[np.abs(xyz[:, 1] - MIDDLE[1]) < 0.05])


def test_a_slope_does_not():
    xyz = flat(3.0)
    xyz[:, 2] = np.maximum(0, xyz[:, 1] - MIDDLE[1]) * 2
    assert not free(xyz)
