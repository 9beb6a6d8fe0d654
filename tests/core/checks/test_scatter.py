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


def track(number, left, right, gaugesd_mm):
    return Centerline(np.zeros((2, 3)), number, 10, (left,), (right,), 1435.0, gaugesd_mm, 0.0, 0.0, 0.0)


def test_stated_errors_of_both_rails_add_up_to_the_scatter_of_their_gauge():
    rails = [rail(1), rail(2)]
    doubted = doubting_scatter(rails, gauge_scatter(rails, [track(1, 1, 2, 9.0)]))
    assert np.hypot(*(one.sigma_mm for one in doubted)) == pytest.approx(9.0)
    assert all(one.support.sigma_m == pytest.approx(0.009 / np.sqrt(2)) for one in doubted)


def test_a_gauge_within_the_stated_errors_and_a_lone_rail_change_nothing():
    rails = [rail(1), rail(2), rail(3)]
    assert doubting_scatter(rails, gauge_scatter(rails, [track(1, 1, 2, 2.8)])) == rails
    assert doubting_scatter(rails, gauge_scatter(rails, [track(1, 1, 2, 9.0)]))[2] is rails[2]


def test_the_larger_scatter_counts_for_a_rail_of_two_tracks():
    rails = [rail(1), rail(2), rail(3)]
    beyond = gauge_scatter(rails, [track(1, 1, 2, 9.0), track(2, 1, 3, 5.0)])
    assert beyond[1] == beyond[2] == pytest.approx(np.sqrt((81 - 8) / 2) / 1000)
    assert beyond[3] == pytest.approx(np.sqrt((25 - 8) / 2) / 1000)
