"""Errors of rails that only the gauge of their track shows."""

import numpy as np
import pytest
from rail_extract.core.checks.scatter import doubting_scatter, gauge_scatter
from rail_extract.core.rails import Centerline, RailLine, Support

OWN_M = 0.002


def rail(number):
    t = np.arange(0.125, 80.0, 0.25)
    support = Support(t, np.full(len(t), 10), np.full(len(t), OWN_M))
    xyz = np.column_stack([t, np.zeros((len(t), 2))])
    return RailLine(xyz, number, 10, 800, 20.0, 1000 * OWN_M, 0.0, support=support)


def track(number, left, right, gaugesd_mm, length_m=80.0, gauge_mm=1435.0):
    xyz = np.array([[0.0, 0, 0], [length_m, 0, 0]])
    return Centerline(xyz, number, 10, (left,), (right,), gauge_mm, gaugesd_mm, 0.0, 0.0, 0.0)


def scatter(rails, *tracks, gauges_m=(1.435,)):
    return gauge_scatter(rails, tracks, gauges_m)


def test_stated_errors_of_both_rails_add_up_to_the_scatter_of_their_gauge():
    rails = [rail(1), rail(2)]
    doubted = doubting_scatter(rails, scatter(rails, track(1, 1, 2, 9.0)))
    assert np.hypot(*(one.sigma_mm for one in doubted)) == pytest.approx(9.0)
    assert all(one.support.sigma_m == pytest.approx(0.009 / np.sqrt(2)) for one in doubted)


def test_a_gauge_within_the_stated_errors_and_a_lone_rail_change_nothing():
    rails = [rail(1), rail(2), rail(3)]
    assert doubting_scatter(rails, scatter(rails, track(1, 1, 2, 2.8))) == rails
    assert doubting_scatter(rails, scatter(rails, track(1, 1, 2, 9.0)))[2] is rails[2]


def test_the_larger_scatter_counts_for_a_rail_of_two_tracks():
    rails = [rail(1), rail(2), rail(3)]
    beyond = scatter(rails, track(1, 1, 2, 9.0), track(2, 1, 3, 5.0, gauge_mm=1000.0), gauges_m=(1.435, 1.0))
    assert beyond[1] == beyond[2] == pytest.approx(np.sqrt((81 - 8) / 2) / 1000)
    assert beyond[3] == pytest.approx(np.sqrt((25 - 8) / 2) / 1000)


def test_short_tracks_scatter_as_all_tracks_of_their_gauge_do():
    """Two short tracks of 1440 and 1430 mm and little scatter of their own, and one of another gauge."""
    tracks = track(1, 1, 2, 1.0, 20.0, 1440.0), track(2, 3, 4, 7.0, 20.0, 1430.0), track(3, 5, 6, 2.0, 20.0, 1000.0)
    beyond = scatter([rail(number) for number in range(1, 7)], *tracks, gauges_m=(1.435, 1.0))
    whole_mm2 = (1 + 49) / 2 + 25
    assert beyond[1] == beyond[2] == pytest.approx(np.sqrt(((1 + whole_mm2) / 2 - 8) / 2) / 1000)
    assert beyond[3] == beyond[4] == pytest.approx(np.sqrt(((49 + whole_mm2) / 2 - 8) / 2) / 1000)
    assert beyond[5] == beyond[6] == 0.0


def test_a_long_track_tells_its_own_scatter():
    """And a track that scatters by more than the others is not taken for better than it looks."""
    rails = [rail(number) for number in range(1, 5)]
    beyond = scatter(rails, track(1, 1, 2, 9.0, 3000.0), track(2, 3, 4, 4.0, 3000.0))
    assert beyond[1] == pytest.approx(np.sqrt((81 - 8) / 2) / 1000)
    assert beyond[3] == pytest.approx(np.sqrt((16 - 8) / 2) / 1000, rel=0.02)
