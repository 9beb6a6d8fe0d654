"""The other rail of the track."""

import numpy as np
import pytest
from rail_extract.core.classify.lines import Ground, Lines
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


@pytest.mark.parametrize(
    ("rise_m", "partnered"), [(0.0, True), (0.18, True), (0.215, False), (0.43, False), (6.5, False), (-6.5, False)]
)
def test_what_is_as_high_above_another_bed_is_not_the_partner(rise_m, partnered):
    """A cant of 180 mm is the largest; slabs, berms of a bank and a vault differ by more (15669, 15544, 15415)."""
    along_m = np.tile(np.arange(0.0, 6.0, 0.08), 2)
    other = np.repeat([0.0, 1.0], len(along_m) // 2)
    one = np.ones(len(along_m))
    ground = Ground(0.15 + rise_m * other, np.zeros((len(one), 2)))
    lines = Lines(np.column_stack([along_m, SPACING_M * other]), 0.15 * one, 0.0 * one, one, one, 1.0, ground)
    assert (partner_sides(lines, [SPACING_M], 0.05) != 0).all() == partnered
