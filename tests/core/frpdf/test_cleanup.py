"""Passes over a raster: what each is shown, when they end, and a cancel."""

import numpy as np
import pytest
from heard import Heard
from rail_extract.core.errors import Cancelled
from rail_extract.core.frpdf import cleanup
from rail_extract.core.raster import RailRaster


class Copy:
    """An engine that returns its input and records the states it is given."""

    description, max_cells = "copy", 1 << 22

    def __init__(self):
        self.states = []

    def sweep(self, seen, known, number, pieces, progress):
        assert [(piece.height, piece.width) for piece in pieces] == [one.shape for one in seen]
        self.states += [(number, state) for state in known]
        progress.check()
        return seen


def line_of_cells(length):
    """A raster with one straight diagonal of cells."""
    return RailRaster({}, 0.04, 0.0, 0.0).with_cells(np.column_stack([np.arange(length), 2 * np.arange(length)]))


def test_every_cell_comes_out_once():
    raster = line_of_cells(3000)
    assert set(map(tuple, cleanup.clean(raster, Copy()).cells().tolist())) == set(map(tuple, raster.cells().tolist()))


def test_the_first_pass_starts_undecided_and_later_ones_with_the_cells_found():
    engine, raster = Copy(), line_of_cells(100)
    cleanup.clean(raster, engine, passes=3)
    assert all((state == 0.5).all() for number, state in engine.states if number == 0)
    assert all(set(np.unique(state)) <= {0.0, 1.0} for number, state in engine.states if number > 0)
    assert {number for number, _ in engine.states} == {0, 1, 2}
    assert sum(np.count_nonzero(state) for number, state in engine.states if number == 2) == 100


def test_passes_end_when_nothing_changes():
    engine = Copy()
    cleanup.clean(line_of_cells(100), engine, passes=cleanup.UNTIL_STABLE)
    assert max(number for number, _ in engine.states) == 1


def test_a_cancel_ends_the_pass():
    with pytest.raises(Cancelled):
        cleanup.clean(line_of_cells(100), Copy(), progress=Heard(cancel_after=0))
