"""Distances to profiles, compared with those of shapely; widening in curves, with the tables of the regulations."""

import numpy as np
import pytest
from rail_extract.core.clearance.profiles import LIMIT, REFERENCE, SPACE, named
from rail_extract.core.clearance.settings import Outline, widening
from rail_extract.core.jobs.clearance_inputs import custom

shapely = pytest.importorskip("shapely")

NOTCHED = [(1.6, 0.4), (1.6, 1.0), (1.2, 1.0), (1.2, 1.6), (1.7, 1.6), (1.7, 3.0), (0.0, 4.0)]
LOPSIDED = [(1.2, 0.3), (1.9, 2.0), (1.0, 4.2), (-0.8, 4.0), (-1.4, 2.5), (-1.3, 0.3)]


def expected(profile, vw, floor_m):
    """Signed distance to the edges that count, by shapely."""
    ring = [*profile.points, profile.points[0]]
    edges = [pair for pair in zip(ring, ring[1:]) if max(pair[0][1], pair[1][1]) > floor_m]
    crossing = [min(a[1], b[1]) if min(a[0], b[0]) <= 0 <= max(a[0], b[0]) else np.inf for a, b in edges]
    foot = edges[int(np.argmin(crossing))]
    lines = shapely.MultiLineString([edge for edge in edges if edge != foot])
    points = shapely.points(vw)
    away = shapely.distance(points, lines)
    return np.where(shapely.contains(shapely.Polygon(ring), points), away, -away)


@pytest.mark.parametrize(
    ("profile", "floor_m"),
    [(named()["EBO_G1"], 0.08), (custom(NOTCHED, "n.csv"), 0.08), (custom(LOPSIDED, "l.csv"), 0.08)],
    ids=["G1", "not convex", "lopsided"],
)
def test_distances_are_those_of_shapely(profile, floor_m):
    vw = np.random.RandomState(1).uniform((-3.0, 0.1), (3.0, 5.5), (100_000, 2))
    found, wanted = Outline(profile, floor_m).distance(vw), expected(profile, vw, floor_m)
    assert np.abs(found - wanted).max() < 1e-9


def test_a_drawn_ring_and_a_half_have_the_same_distances():
    half = custom([(1.6, 0.4), (1.6, 3.0), (0.0, 4.0)], "half.csv")
    ring = custom([(-1.6, 0.4), (1.6, 0.4), (1.6, 3.0), (0.0, 4.0), (-1.6, 3.0), (-1.6, 0.4)], "ring.gpkg")
    vw = np.random.RandomState(2).uniform((-2.0, 0.1), (2.0, 4.5), (5000, 2))
    assert Outline(half, 0.08).distance(vw) == pytest.approx(Outline(ring, 0.08).distance(vw), abs=1e-12)


def test_what_rises_from_the_bed_is_as_deep_as_the_sides_say():
    # The closing edge at the foot is not a boundary: 1 cm above it, the nearest one is 1.62 m aside.
    assert Outline(named()["EBO_G1"], 0.08).distance(np.array([[0.0, 0.41]])) == pytest.approx([1.62], abs=1e-6)


def test_edges_below_the_lowest_height_do_not_count():
    vw = np.array([[2.0, 0.1]])
    assert Outline(named()["EBO_MAIN"], 0.08).distance(vw) == pytest.approx([0.5])
    assert Outline(named()["EBO_MAIN"], -0.2).distance(vw) == pytest.approx([0.1])


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
