"""Pieces of a rail become one line with the figures of the whole."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.lines.uniting import united
from rail_extract.core.rails import RailLine


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
