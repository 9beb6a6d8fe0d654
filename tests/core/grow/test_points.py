"""Points around a place."""

import numpy as np
import pytest
from rail_extract.core.grow.points import Buckets


@pytest.mark.parametrize("shift", [0.0, 5_000_000.0])
def test_all_points_within_reach_are_returned_and_none_twice(shift):
    rng = np.random.RandomState(2)
    xyz = rng.uniform(-3, 3, (2000, 3)) + [shift, -shift, 0]
    points = Buckets(xyz)
    assert len(points) == 2000
    for place in (np.array([0.2, 0.3]), np.array([2.9, -2.9]), np.array([9.0, 9.0])):
        place = place + [shift, -shift]
        found = points.around(place, 0.7)
        near = np.abs(xyz[:, :2] - place).max(axis=1) <= 0.7
        assert {tuple(row) for row in xyz[near]} <= {tuple(row) for row in found}
        assert len(np.unique(found, axis=0)) == len(found)
        assert np.abs(found[:, :2] - place).max(initial=0.0) <= 0.7 + 0.5


def test_no_points():
    assert Buckets(np.empty((0, 3))).around(np.zeros(2), 1.0).shape == (0, 3)
