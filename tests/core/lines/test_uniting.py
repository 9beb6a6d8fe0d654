"""Pieces of a rail become one line with the figures of the whole."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.lines.uniting import united
from rail_extract.core.rails import RailLine, Support


def piece(start_m, end_m, points=100, resid_mm=1.0, gaps=()):
    xyz = np.array([[x, 0.0, 0.1 * x] for x in np.linspace(start_m, end_m, 5)])
    gaps = np.array(gaps, dtype=float).reshape(-1, 2)
    return RailLine(xyz, 3, 10, points, resid_mm, 2.0, float(np.diff(gaps).sum()), gaps)


def test_a_single_piece_keeps_its_line_and_has_whole_points():
    part = piece(0, 10)
    assert united([part]) is part
    some = united([replace(part, points=99.6, sigma_mm=3.5)])
    assert (some.points, some.sigma_mm) == (100, 3.5)
    assert np.array_equal(some.xyz, part.xyz)


def test_vertices_counts_and_gaps_of_two_pieces_are_those_of_the_whole():
    whole = united([piece(0, 10, 100, 1.0, [(8.0, 10.0)]), piece(10, 30, 300, 2.0, [(0.0, 1.0), (5.0, 6.0)])])
    assert np.array_equal(whole.xyz[:, 0], [0, 2.5, 5, 7.5, 10, 15, 20, 25, 30])
    assert whole.points == 400
    assert whole.resid_mm == pytest.approx(np.sqrt((1 * 100 + 4 * 300) / 400))
    assert whole.gaps.tolist() == [[8.0, 11.0], [15.0, 16.0]]
    assert whole.bridged_m == pytest.approx(4.0)
    assert whole.sigma_mm == 2.0


def supported(start_m, end_m, sigma_m, strips=None):
    t = np.arange(0.5, end_m - start_m)
    one = Support(t, np.full(len(t), 7), np.full(len(t), sigma_m), strips and np.full((len(t), 3), strips))
    return replace(piece(start_m, end_m), support=replace(one, sigmaz_m=np.full(len(t), 2 * sigma_m)))


def test_supports_follow_each_other_and_sigma_is_that_of_the_whole():
    whole = united([supported(0, 10, 0.003), supported(10, 40, 0.005)])
    np.testing.assert_allclose(whole.support.t, np.arange(0.5, 40))
    np.testing.assert_allclose(whole.support.sigma_m, [0.003] * 10 + [0.005] * 30)
    assert whole.support.points.sum() == 280 and whole.support.strips is None
    assert whole.sigma_mm == pytest.approx(np.sqrt((9 + 3 * 25) / 4))
    assert whole.sigmaz_mm == pytest.approx(2 * np.sqrt((9 + 3 * 25) / 4))
    marked = united([supported(0, 10, 0.003, 2.0), supported(10, 40, 0.005)])
    assert marked.support.strips[9].tolist() == [2.0] * 3 and marked.support.strips[10, 0] == 1.0
    partly = united([supported(0, 10, 0.003), piece(10, 20)])
    assert partly.support is None and partly.sigma_mm == 2.0
    empty = Support(*np.empty((3, 0)))
    assert united([replace(piece(0, 10), support=empty), replace(piece(10, 20), support=empty)]).sigma_mm == 2.0
