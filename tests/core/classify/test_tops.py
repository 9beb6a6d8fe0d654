"""Which tops of cells are narrow."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.classify.settings import HEADS
from rail_extract.core.classify.tops import Grid, narrow_tops, tops_of


def cells_of(columns, top_m):
    """Points in the middle of all cells of some columns of a raster of 40 x 40 cells of 4 cm, as high as told."""
    row, column = np.meshgrid(np.arange(40), columns, indexing="ij")
    xy = 0.04 * np.column_stack([column.ravel() + 0.5, -(row.ravel() + 0.5)])
    return xy, np.full(len(xy), top_m)


@pytest.mark.parametrize(
    ("band", "top_m", "narrow"),
    [(HEADS, 0.17, True), (HEADS, 0.08, False), (replace(HEADS, shadows=False), 0.17, False)],
)
def test_two_heads_side_by_side_are_narrow_where_the_ground_may_be_in_their_shadow(band, top_m, narrow):
    """In a switch; stones that are as high as low heads fill as much of what is seen, and from above nothing hides."""
    parts = [cells_of([18, 19, 22, 23], top_m), cells_of([12, 13, 14], 0.0)]
    xy, height = (np.concatenate(part) for part in zip(*parts))
    grid, cell = Grid.around(*xy.T, 0.04)
    found = narrow_tops(tops_of(grid, cell, height, height), band)
    places = grid.middles(found)
    middle = np.abs(places[:, 1] + 0.8) < 0.4
    assert bool(middle.any()) == narrow
