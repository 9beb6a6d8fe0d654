"""Stations, windows and search distance that all measurements of heads share."""

import numpy as np
import pytest
from rail_extract.core.heads.edges import BLURRED_BINS, MAX_SHIFT_BINS, RIM_BINS, search_distance, stations_along

WIDTH = 0.072


def test_stations_are_the_centres_of_windows_of_a_quarter_metre():
    assert stations_along(0.9) == pytest.approx([0.125, 0.375, 0.625, 0.875])
    assert np.diff(stations_along(100.0)) == pytest.approx(0.25)


def test_points_are_searched_as_far_as_a_shifted_and_blurred_rim_reaches():
    bins = 18 + MAX_SHIFT_BINS + 2 + BLURRED_BINS + RIM_BINS
    assert search_distance(WIDTH) == pytest.approx(bins * WIDTH / 36)
    assert WIDTH < search_distance(WIDTH) < 2 * WIDTH
