import numpy as np
import pytest
from rail_extract.core.classify.lines import Marks, find_lines
from rail_extract.core.classify.pieces import lengths, links, long_enough, pieces_of


def lines_of(*bars):
    xy = np.concatenate(
        [
            np.column_stack([np.arange(0, length, 0.08), np.full(len(np.arange(0, length, 0.08)), y)])
            for length, y in bars
        ]
    )
    return find_lines(Marks(xy, np.zeros(len(xy))), 1.0, 0.035, 0.05)


def test_bars_are_pieces():
    lines = lines_of((5.0, 0.0), (3.0, 0.5))
    piece = pieces_of(len(lines.axis), links(lines))
    assert len(np.unique(piece)) == 2
    np.testing.assert_allclose(lengths(lines.axis, piece), [4.96, 2.96], atol=1e-6)


@pytest.mark.parametrize(
    ("length", "paired", "kept"), [(4.9, 0, 0), (5.12, 0, 1), (1.4, 1, 0), (1.6, 1, 1), (3.0, 0.3, 0), (3.0, 0.5, 1)]
)
def test_short_pieces_go(length, paired, kept):
    lines = lines_of((length, 0.0))
    count = len(lines.axis)
    has = np.arange(count) < paired * count
    found = long_enough(lines, links(lines), has, np.zeros(count, dtype=bool), keep_single=True)
    assert found.tolist() == [bool(kept)] * count


def test_a_piece_that_leaves_the_square_is_long_enough():
    lines = lines_of((3.0, 0.0))
    border = lines.axis[:, 0] > 2.9
    none = np.zeros(len(border), dtype=bool)
    assert long_enough(lines, links(lines), none, border, keep_single=True).all()
    assert not long_enough(lines, links(lines), none, none, keep_single=True).any()


def test_single_rails_can_be_left_out():
    lines = lines_of((9.0, 0.0))
    none = np.zeros(len(lines.axis), dtype=bool)
    assert not long_enough(lines, links(lines), none, none, keep_single=False).any()
    assert long_enough(lines, links(lines), ~none, none, keep_single=False).all()


@pytest.mark.parametrize(("gap_m", "paired", "kept"), [(1.1, 1, 1), (1.5, 1, 0), (1.1, 0, 0)])
def test_a_wheel_does_not_divide_a_rail(gap_m, paired, kept):
    lines = lines_of((7.4 + gap_m, 0.0))
    x = lines.axis[:, 0]
    lines = lines.of((x < 6.0) | (x > 6.0 + gap_m))
    behind, none = lines.axis[:, 0] > 6.0, np.zeros(len(lines.axis), dtype=bool)
    found = long_enough(lines, links(lines), np.full(len(behind), bool(paired)), none, keep_single=True)
    assert found[~behind].all()
    assert (found[behind] == kept).all()
