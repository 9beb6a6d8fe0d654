"""The other rail of the track."""

import numpy as np
from rail_extract.core.classify.lines import Lines
from rail_extract.core.classify.partner import partner_sides

SPACING_M = 1.507


def test_the_partner_of_each_rail_is_on_the_side_of_the_other_one():
    """A third line, 1.8 m from the track, has none."""
    along_m = np.tile(np.arange(0.0, 6.0, 0.08), 3)
    across_m = np.repeat([0.0, SPACING_M, SPACING_M + 1.8], len(along_m) // 3)
    one = np.ones(len(along_m))
    lines = Lines(np.column_stack([along_m, across_m]), 0.15 * one, 0.0 * one, one, one, 1.0)
    sides = partner_sides(lines, [SPACING_M], 0.05)
    assert [set(sides[across_m == left]) for left in np.unique(across_m)] == [{1}, {-1}, {0}]
