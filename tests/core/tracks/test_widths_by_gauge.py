"""Which width the head of a rail has, by the gauge at which it runs."""

import numpy as np
import pytest
from rail_extract.core.rails import RailLine
from rail_extract.core.tracks.widths_by_gauge import width_at, widths_by_gauge

GAUGES = ((1.435, 0.072), (1.0, 0.066))
WIDE, NARROW = (sum(one) for one in GAUGES)


def rails_at(*lefts, length_m=20.0):
    lines = [np.column_stack([[0.0, length_m], [left, left], [np.nan, np.nan]]) for left in lefts]
    return [RailLine(line, number, 10, 0, np.nan, np.nan, np.nan) for number, line in enumerate(lines, start=1)]


@pytest.mark.parametrize(
    ("lefts", "widths"),
    [
        ([0.0, WIDE, 8.0, 8.0 + NARROW], [0.072, 0.072, 0.066, 0.066]),
        ([0.0, NARROW, WIDE], [0.072, 0.066, 0.072]),  # the first one is common to both tracks
        ([0.0, 5.0], [0.072, 0.072]),
        ([0.0, NARROW + 0.02, 5.0], [0.066, 0.066, 0.072]),
        ([], []),
    ],
)
def test_each_rail_has_the_width_of_its_track(lefts, widths):
    assert widths_by_gauge(rails_at(*lefts), GAUGES, 0.05).tolist() == widths


def test_one_width_for_all_needs_no_partner():
    assert widths_by_gauge(rails_at(0.0, 1.066), ((1.435, 0.072), (1.0, 0.072)), 0.05).tolist() == [0.072, 0.072]


@pytest.mark.parametrize(("spacing_m", "width_m"), [(WIDE, 0.072), (NARROW, 0.066), (1.25, 0.066), (1.32, 0.072)])
def test_a_distance_has_the_width_of_the_nearest_gauge(spacing_m, width_m):
    assert width_at(spacing_m, GAUGES) == width_m
