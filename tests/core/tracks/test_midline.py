"""The rails that rays from stations meet, up to the ends of a section."""

import numpy as np
import pytest
from rail_extract.core.rails import RailLine
from rail_extract.core.tracks.midline import Side

LENGTH_M, ASIDE_M = 10.0, 0.75


def side(*ends):
    lines = [
        RailLine(np.array([[start, ASIDE_M, 0.1 * start], [end, ASIDE_M, 0.1 * end]], dtype=float), 1, 10, 9, 1, 1, 0)
        for start, end in ends
    ]
    return Side.of(lines, [(number, (0.0, end - start)) for number, (start, end) in enumerate(ends)], 0.0)


def meet(rails, *x):
    count = len(x)
    directions = np.tile([0.0, 1.0], (count, 1))
    return rails.meet(np.column_stack([x, np.zeros(count)]), directions, ASIDE_M)


def test_a_rail_is_met_all_along_and_a_segment_beyond_its_ends():
    places = [-0.15, -0.09, 0.0, 0.04, 5.03, 9.93, 9.99, 10.0, 10.09, 10.15]
    found = meet(side((0.0, LENGTH_M)), *places)
    known = np.isfinite(found.distance_m)
    assert known.tolist() == [False, *[True] * 8, False]
    assert found.distance_m[known] == pytest.approx(ASIDE_M)
    assert found.t[known] == pytest.approx(np.array(places)[known])
    assert found.height_m[known] == pytest.approx(0.1 * np.array(places)[known])


def test_no_ray_meets_the_gap_between_two_rails():
    found = meet(side((0.0, LENGTH_M), (LENGTH_M + 1, 2 * LENGTH_M)), 9.9, 10.5, 11.2)
    assert found.rail[[0, 2]].tolist() == [0, 1]
    assert np.isnan(found.distance_m[1])
