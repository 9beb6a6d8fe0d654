"""Distances to profiles, compared with those of shapely."""

import numpy as np
import pytest
from rail_extract.core.clearance.profiles import named
from rail_extract.core.clearance.settings import Outline
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
