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


def fitted_twice(half_m, count):
    """Lines of a rail beside a guard rail of which few points are seen, and the same fitted again without it."""
    rng = np.random.RandomState(1)
    along, beside = rng.uniform(-half_m, half_m, (2, count)), rng.uniform(-WIDTH / 2, WIDTH / 2, (2, count))
    both = np.column_stack([along.ravel(), (beside + [[0.0], [0.112]]).ravel()])
    found = candidates(both)
    kept = on_lines(found, 1.0, DENSE, SETTINGS)
    rail = kept.of(np.abs(found.places[kept.cell, 1]) < WIDTH / 2)
    return rail.lines, fitted_again(rail, rail.cell, found, DENSE, SETTINGS).lines


def test_lines_are_fitted_again_without_what_is_dropped():
    """A guard rail beside a rail of which few points are seen leads its lines aside; without it they are straight."""
    once, again = fitted_twice(4.0, 120)
    turned = [np.abs(np.sin(lines.theta)).mean() for lines in (once, again)]
    assert turned[1] < 0.5 * turned[0]
    assert (again.cover == once.cover).all() and (again.pure == once.pure).all()


def test_lines_of_pieces_that_may_be_sleepers_are_fitted_once():
    """Those of the edge of a sleeper would be straight as well, and the row of its cells as narrow as a bar."""
    once, again = fitted_twice(1.5, 45)
    assert len(once.axis) > 5
    assert (again.axis == once.axis).all() and (again.theta == once.theta).all()
