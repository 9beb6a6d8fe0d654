"""The division into squares: each station belongs to one, with enough around it, and cells hold what is near."""

import numpy as np
import pytest
from rail_extract.core.airborne.axis import axis_of_guide
from rail_extract.core.airborne.sections import STATION_M
from rail_extract.core.airborne.squares import (
    MARGIN_M,
    SIDE_M,
    areas_along,
    cells_around,
    in_cells,
    pieces_by_square,
)

AXIS = axis_of_guide(np.array([[300.0, 400.0], [2600.0, 1900.0]]))


def test_each_station_belongs_to_one_square_that_holds_it():
    pieces = pieces_by_square([AXIS])
    middles = []
    for key, own in pieces.items():
        for piece in own:
            t = np.arange(piece.first_m + STATION_M / 2, piece.last_m, STATION_M)
            assert (np.floor(AXIS.at(t)[0] / SIDE_M) == key).all()
            assert piece.axis.t[0] % STATION_M == pytest.approx(0)
            assert piece.axis.t[0] <= max(piece.first_m - MARGIN_M, 0)
            assert piece.axis.t[-1] >= min(piece.last_m + MARGIN_M, AXIS.t[-1]) - 1
            middles.append(t)
    found = np.sort(np.concatenate(middles))
    assert found.tolist() == pytest.approx((np.arange(len(found)) + 0.5) * STATION_M)
    assert len(found) == np.ceil(AXIS.t[-1] / STATION_M)


def test_cells_and_areas_hold_what_is_within_reach():
    place, normal = AXIS.at(np.linspace(0, AXIS.t[-1], 400))
    pieces = [piece for some in pieces_by_square([AXIS]).values() for piece in some]
    cells, areas = cells_around([AXIS], 10.0), areas_along(pieces, 10.0)
    for left in (-9.9, 0.0, 9.9):
        xy = place + left * normal
        assert in_cells(xy, cells).all()
        assert ((xy[:, None] >= areas[:, :2]) & (xy[:, None] <= areas[:, 2:])).all(axis=2).any(axis=1).all()
    assert not in_cells(place + 60 * normal, cells).any()
