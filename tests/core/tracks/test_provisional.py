"""The provisional course between two sections of different rails."""

import numpy as np
import pytest
from rail_extract.core.rails import RailLine
from rail_extract.core.tracks.pairing import RailPair
from rail_extract.core.tracks.provisional import _between

HALF_M = 0.75


def rail(start_m, end_m, y_m):
    xyz = np.array([[start_m, y_m, 0.0], [end_m, y_m, 0.0]])
    return RailLine(xyz, 1, 10, 9, 1.0, 1.0, 0.0)


def test_rails_are_followed_no_further_than_to_the_next_section():
    """Each rail goes on for 5 m, but the sections are 3 m apart."""
    rails = [rail(100, 155, HALF_M), rail(100, 155, -HALF_M), rail(148, 200, HALF_M), rail(148, 200, -HALF_M)]
    before, after = RailPair(0, 1, (0.0, 50.0), (0.0, 50.0)), RailPair(2, 3, (5.0, 52.0), (5.0, 52.0))
    first, second = _between(rails, before, after, HALF_M, 30.0)
    assert first[[0, -1]] == pytest.approx(np.array([[150, 0], [153, 0]]))
    assert second[[0, -1]] == pytest.approx(np.array([[150, 0], [153, 0]]))
    short, _ = _between(rails, before, after, HALF_M, 2.0)
    assert np.ptp(short[:, 0]) == pytest.approx(2.0)
