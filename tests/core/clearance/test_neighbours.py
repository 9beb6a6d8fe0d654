"""Distance of tracks: where they join, nothing is judged, and the fouling point is where that begins."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.clearance.frame import course_of
from rail_extract.core.clearance.neighbours import neighbours
from rail_extract.core.clearance.profiles import named
from rail_extract.core.clearance.settings import Settings
from rail_extract.core.rails import Centerline

SETTINGS = Settings(named()["EBO_G1"])


def course(xyz, number=1, cant_m=0.0):
    line = Centerline(xyz, number, 10, (), (), 1435.0, 0.5, 0.0, 0.0, 0.0)
    made = course_of(line, [])
    return replace(made, cant_m=np.full(len(made.xyz), cant_m))


def straight(length_m=100.0, across_m=0.0, turn=0.0):
    """A straight that leaves the x axis at a small angle."""
    x = np.arange(0.0, length_m + 0.1, 0.5)
    return np.column_stack([x, across_m + turn * x, np.full(len(x), 50.0)])


def arc(radius_m):
    angle = np.arange(0.0, 80.0, 0.5) / 300.0
    return np.column_stack([radius_m * np.sin(angle), -radius_m * np.cos(angle), np.zeros(len(angle))])


def test_tracks_that_join_are_judged_beyond_the_fouling_point_only():
    own, other = course(straight()), course(straight(turn=1 / 19, across_m=0.0), 2)
    left, right = neighbours([own, other], 0, SETTINGS)
    (at,) = left.fouling
    assert left.distance_m[at : at + 2] == pytest.approx([3.5, 3.5], abs=0.03)
    assert own.s[at] == pytest.approx(3.5 * 19, abs=1.0)
    assert not left.judged[: at + 1].any()
    assert left.short[at + 2 : int(4.0 * 19 / own.step_m) - 2].all()
    assert not left.short[int(4.0 * 19 / own.step_m) + 2 :].any()
    assert np.isnan(right.distance_m).all()


def test_the_neighbour_on_the_other_side_is_named_with_its_height():
    own, other = course(straight()), course(straight(across_m=-4.5) + [0.0, 0.0, 0.3], 2)
    left, right = neighbours([own, other], 0, SETTINGS)
    inside = slice(2, -2)
    assert right.distance_m[inside] == pytest.approx(np.full(len(own.s) - 4, 4.5))
    assert right.above_m[inside] == pytest.approx(np.full(len(own.s) - 4, 0.3))
    assert set(right.track[inside]) == {1} and set(left.track) == {-1}


def test_a_crossing_track_is_no_neighbour():
    own, other = course(straight()), course(straight()[:, [1, 0, 2]] + [50.0, -50.0, 0.0], 2)
    assert np.isnan(neighbours([own, other], 0, SETTINGS)[0].distance_m).all()


@pytest.mark.parametrize(("radius_m", "more_mm"), [(300, 0), (225, 55), (200, 120), (150, 305)])
def test_tight_curves_need_more_distance(radius_m, more_mm):
    own, other = course(arc(radius_m)), course(arc(radius_m - 4.0), 2)
    side = neighbours([own, other], 0, SETTINGS)[0]
    assert side.least_m[20:-20] == pytest.approx(np.full(len(own.s) - 40, 4.0 + more_mm / 1000), abs=0.002)


def test_more_cant_on_the_outer_track_needs_more_distance():
    own, other = course(arc(400.0), cant_m=0.10), course(arc(396.0), 2, cant_m=0.05)
    side = neighbours([own, other], 0, SETTINGS)[0]
    assert side.least_m[50] == pytest.approx(4.0 + 3.53 / 1.50 * 0.05)
    assert neighbours([own, other], 1, SETTINGS)[1].least_m[50] == pytest.approx(4.0 + 3.53 / 1.50 * 0.05)


def test_arcs_are_as_far_apart_as_their_radii_say_at_every_station():
    inner, outer = course(arc(300.0)), course(arc(304.0), 2)
    for own, other, side in ((inner, outer, 1), (outer, inner, 0)):
        found = neighbours([own, other], 0, SETTINGS)[side].distance_m[2:-2]
        assert found == pytest.approx(np.full(len(found), 4.0), abs=2.5e-4)
