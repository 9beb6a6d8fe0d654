"""Widening in curves, compared with the tables of the regulations."""

import numpy as np
import pytest
from rail_extract.core.clearance.profiles import LIMIT, REFERENCE, SPACE
from rail_extract.core.clearance.widening import widening


def at(radius_m, gauge_m, rule):
    """Inside and outside of a long curve to the left, millimetres."""
    curvature = np.full(5, 0.0 if np.isinf(radius_m) else 1.0 / radius_m)
    return 1000 * widening(curvature, gauge_m, rule, 0.5)[2]


@pytest.mark.parametrize(
    ("radius_m", "tight", "loose"),
    [(250, 20, 33), (300, 18, 30), (400, 14, 27), (500, 13, 25), (600, 11, 24), (1000, 9, 21), (np.inf, 5, 18)],
)
def test_wide_curves_follow_the_table_of_annex_2(radius_m, tight, loose):
    assert at(radius_m, 1.435, REFERENCE) == pytest.approx([tight, tight], abs=0.6)
    assert at(radius_m, 1.470, REFERENCE) == pytest.approx([loose, loose], abs=0.6)


@pytest.mark.parametrize(
    ("radius_m", "inside", "outside"), [(225, 55, 60), (190, 95, 110), (150, 165, 195), (100, 560, 600)]
)
def test_tight_curves_follow_the_table(radius_m, inside, outside):
    assert at(radius_m, 1.435, REFERENCE) == pytest.approx([inside, outside])
    assert at(radius_m, 1.435, LIMIT) == pytest.approx([inside - 33, outside - 33])


@pytest.mark.parametrize(
    ("radius_m", "inside", "outside"), [(300, 0, 0), (225, 25, 30), (180, 80, 100), (120, 335, 365)]
)
def test_structure_gauges_follow_table_2(radius_m, inside, outside):
    assert at(radius_m, 1.435, SPACE) == pytest.approx([inside, outside])


def test_a_curve_to_the_right_swaps_the_sides():
    left = widening(np.full(5, 1 / 200), 1.435, REFERENCE, 0.5)
    right = widening(np.full(5, -1 / 200), 1.435, REFERENCE, 0.5)
    assert right == pytest.approx(left[:, ::-1])


def test_the_widening_counts_within_a_vehicles_length_of_the_curve():
    curvature = np.where(np.arange(200) < 100, 0.0, 1 / 200)
    found = widening(curvature, 1.435, SPACE, 0.5)[:, 0]
    assert found[100 - 40] == pytest.approx(0.050)
    assert found[100 - 42] == 0.0
