import numpy as np
import pytest
from rail_extract.core.classify.figures import Figures, shares_of_length
from rail_extract.core.classify.lines import Marks, find_lines
from rail_extract.core.classify.pieces import links
from rail_extract.core.classify.thin import drawn

CELL = 0.04


def rail(per_m, length=20.0):
    x = np.arange(0, length, 1 / per_m)
    xy = np.column_stack([x, np.zeros(len(x))])
    return find_lines(Marks(xy, np.zeros(len(x))), 2.0, 0.06, 0.065)


def test_a_thin_rail_is_drawn_without_gaps():
    lines = rail(4.0)
    places = drawn(lines, links(lines), lines.axis, 0.056, CELL)
    cells = np.unique(np.floor(places[:, 0] / CELL))
    assert len(cells) == pytest.approx(19.75 / CELL, abs=2)
    assert np.abs(places[:, 1]).max() < 0.01


def test_a_dense_rail_is_not_drawn():
    lines = rail(12.5)
    heads = np.column_stack([np.arange(0, 20, CELL), np.zeros(500)])
    assert not len(drawn(lines, links(lines), heads, 0.056, CELL))


def test_nothing_is_drawn_from_nothing():
    lines = rail(4.0).of(np.zeros(0, dtype=int))
    assert drawn(lines, links(lines), np.empty((0, 2)), 0.056, CELL).shape == (0, 2)


@pytest.mark.parametrize("per_m", [4.0, 12.5])
def test_cells_share_the_length_of_their_rail(per_m):
    lines = rail(per_m)
    assert shares_of_length(lines, 0.072).sum() == pytest.approx(20.0, rel=0.12)


def test_figures_add_up():
    one, other = Figures(10, 1.0, 2.0, 30, 1, 1, 0), Figures(5, 4.0, 3.0, 20, 1, 0, 1)
    assert one + other == Figures(15, 5.0, 5.0, 50, 2, 1, 1)
    assert (one + other).cells_per_m == 5.0
    assert Figures().cells_per_m == 0.0
