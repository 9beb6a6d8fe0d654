"""Pieces and batches cover the cells that the network may set, once, and few others."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.frpdf.corridor import BLOCK, CONTEXT, GAP, MAX_PIECE_CELLS, corridor, lay_batches
from rail_extract.core.raster import RailRaster, rasterize

CELL_M = 0.04


def raster_of(cells):
    return RailRaster({}, CELL_M, 0.0, 0.0).with_cells(np.asarray(cells))


def double_track(length_m, heading):
    """Cells of four rails, 1.5 m and 2.5 m apart."""
    along = np.arange(0.0, length_m, 0.03)[:, None] * [np.cos(heading), np.sin(heading)]
    across = np.array([-np.sin(heading), np.cos(heading)])
    return rasterize(np.concatenate([along + offset * across for offset in (0.0, 1.5, 4.0, 5.5)]), CELL_M)


places = st.lists(st.tuples(st.integers(-3000, 3000), st.integers(-3000, 3000)), min_size=1, max_size=12)


@settings(max_examples=40)
@given(places)
def test_pieces_hold_the_corridor_and_do_not_overlap(cells):
    raster = raster_of(cells)
    blocks = corridor(raster)
    (batch,) = lay_batches(raster, 1 << 40)
    holders = sum(piece.holds(blocks * BLOCK).astype(int) for piece in batch.pieces)
    assert (holders == 1).all()
    assert batch.inside.holds(blocks * BLOCK).all()
    assert all(piece.height * piece.width <= MAX_PIECE_CELLS for piece in batch.pieces)
    near = np.array(cells)[:, None] + np.array([[-BLOCK, -BLOCK], [0, 0], [BLOCK, BLOCK]])
    assert sum(piece.holds(near.reshape(-1, 2)).astype(int) for piece in batch.pieces).min() == 1


@given(st.floats(2, GAP - np.sqrt(2)), st.floats(0, 2 * np.pi))
def test_gaps_are_computed(length, heading):
    end = np.rint(length * BLOCK * np.array([np.sin(heading), np.cos(heading)])).astype(int)
    between = np.rint(np.linspace(0, 1, 200)[:, None] * end).astype(int)
    blocks = set(map(tuple, corridor(raster_of([[0, 0], end])).tolist()))
    assert set(map(tuple, (between // BLOCK).tolist())) <= blocks


def test_nothing_is_computed_in_longer_gaps():
    far = corridor(raster_of([[0, 0], [0, (GAP + 2) * BLOCK]]))
    assert len(far) == 18


def test_batches_divide_the_corridor_and_have_context():
    raster = double_track(100.0, 0.4)
    blocks = corridor(raster)
    batches = lay_batches(raster, 100_000)
    assert len(batches) > 4
    holders = sum(batch.inside.holds(blocks * BLOCK).astype(int) for batch in batches)
    assert (holders == 1).all()
    for batch in batches:
        corner = np.array([batch.inside.row, batch.inside.column]) - CONTEXT
        end = corner + 2 * CONTEXT + [batch.inside.height, batch.inside.width]
        near = blocks[((blocks * BLOCK >= corner) & (blocks * BLOCK < end)).all(axis=1)]
        assert sum(piece.holds(near * BLOCK).astype(int) for piece in batch.pieces).min() == 1


@pytest.mark.parametrize("heading", [0.0, 0.4, np.pi / 4, np.pi / 2])
def test_pieces_follow_a_track_in_any_direction(heading):
    raster = double_track(300.0, heading)
    (batch,) = lay_batches(raster, 1 << 40)
    cells = sum(piece.height * piece.width for piece in batch.pieces)
    assert cells < 1.4 * BLOCK**2 * len(corridor(raster))


def test_an_empty_raster_has_no_batches():
    assert lay_batches(RailRaster({}, CELL_M, 0.0, 0.0), 1 << 22) == []
