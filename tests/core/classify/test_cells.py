"""Cells of rails and the lines on which they are."""

import numpy as np
from rail_extract.core.classify.cells import Candidates, fitted_again, on_lines
from rail_extract.core.classify.settings import DENSE, Settings
from rail_extract.core.classify.tops import Grid, means, tops_of

WIDTH = 0.072
SETTINGS = Settings((1.435,), WIDTH)


def candidates(xy, height_m=0.15):
    grid, cell = Grid.around(*xy.T, SETTINGS.cell_m)
    height = np.full(len(xy), height_m, dtype=np.float32)
    cells = np.unique(cell)
    return Candidates(tops_of(grid, cell, height, height), cells, cells, means(np.prod(grid.shape), cell, xy))


def test_lines_are_fitted_again_without_what_is_dropped():
    """A guard rail beside a rail of which few points are seen leads its lines aside; without it they are straight."""
    rng = np.random.RandomState(1)
    along, beside = rng.uniform(-4.0, 4.0, (2, 60)), rng.uniform(-WIDTH / 2, WIDTH / 2, (2, 60))
    both = np.column_stack([along.ravel(), (beside + [[0.0], [0.112]]).ravel()])
    found = candidates(both)
    kept = on_lines(found, 1.0, DENSE, SETTINGS)
    rail = kept.of(np.abs(found.places[kept.cell, 1]) < WIDTH / 2)
    again = fitted_again(rail, rail.cell, found, DENSE, SETTINGS)
    turned = [np.abs(np.sin(one.lines.theta)).mean() for one in (rail, again)]
    assert turned[1] < 0.5 * turned[0]
    assert (again.lines.cover == rail.lines.cover).all() and (again.lines.pure == rail.lines.pure).all()
