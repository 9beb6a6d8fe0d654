"""The frame of a track: places go there and back, on curves, with cant and on a gradient."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.clearance.frame import course_of
from rail_extract.laboratory.curves import Element
from rail_extract.laboratory.scenes import clearance as scenes
from rail_extract.laboratory.scenes.clearance import SHORT, courses_of


@pytest.fixture(scope="module")
def track():
    scene = scenes.double_track(1, elements=SHORT, grade=0.020, apart_m=0)
    return courses_of(scene)[0], scene.ways[0]


def test_places_come_back_within_a_fifth_of_a_millimetre(track):
    # Half of it is the chord of half a metre between the vertices of the line.
    course, way = track
    rng = np.random.RandomState(3)
    s, v, w = rng.uniform(1, 89, 5000), rng.uniform(-3.2, 3.2, 5000), rng.uniform(0, 7, 5000)
    for found, true, limit in zip(
        course.located(way.place(s, v, w), course.station(s)), (s, v, w), (1e-3, 2.1e-4, 2e-4)
    ):
        assert np.abs(found - true).max() < limit


@settings(max_examples=60, deadline=None)
@given(st.floats(2.0, 88.0), st.floats(-3.2, 3.2), st.floats(0.0, 7.0))
def test_places_and_located_are_inverse(s, v, w):
    scene = scenes.double_track(1, elements=SHORT, grade=0.020, apart_m=0)
    course = COURSE or courses_of(scene)[0]
    place = course.places(np.array([s]), np.array([v]), np.array([w]))
    found = course.located(place, course.station(np.array([s])))
    assert np.concatenate(found) == pytest.approx([s, v, w], abs=3e-4)


COURSE = courses_of(scenes.double_track(1, elements=SHORT, grade=0.020, apart_m=0))[0]


def test_a_reversed_line_swaps_the_sides(track):
    course, way = track
    back = courses_of(scenes.Scene([way.reversed()], 100.0, 0.0, np.random.RandomState(0)))[0]
    rng = np.random.RandomState(3)
    s, v, w = rng.uniform(1, 89, 500), rng.uniform(-3, 3, 500), rng.uniform(0, 5, 500)
    xyz = way.place(s, v, w)
    there, again = course.located(xyz, course.station(s)), back.located(xyz, back.station(way.curve.length_m - s))
    assert again[1] == pytest.approx(-there[1], abs=4e-4)
    assert again[2] == pytest.approx(there[2], abs=4e-4)


def test_there_is_no_step_where_the_curvature_vanishes():
    course = courses_of(scenes.double_track(1, elements=[Element(40.0)], cant_m=0.0, grade=0.0, apart_m=0))[0]
    places = course.places(np.full(7, 20.2), np.full(7, 2.5), np.full(7, 1.0))
    found = []
    for curvature in (-1e-6, -1e-12, 0.0, 1e-15, 1e-12, 1e-9, 1e-6):
        bent = replace(course, curvature=np.full(len(course.xyz), curvature))
        found.append(bent.located(places[:1], bent.station(np.array([20.2])))[1][0])
    assert np.ptp(found) < 1e-6


def test_points_beyond_the_ends_are_none_of_the_track(track):
    course, way = track
    s, _, _ = course.located(np.array([way.place(0.0, 0.0, 1.0)[0] - [1.0, 0.3, 0.0]]), np.array([0]))
    assert np.isnan(s).all()


def test_cant_is_that_of_the_rails(track):
    course, way = track
    assert course.cant_m == pytest.approx(way.cant_m(course.s), abs=2e-4)
    assert not course.bridged.any()


def test_rails_in_pieces_give_the_same_cant(track):
    scene = scenes.double_track(1, elements=SHORT, grade=0.020, apart_m=0)
    (line,), rails = scenes.lines_of(scene)
    pieces = [part for rail in rails for part in (rail.part(0, 41.0), rail.part(41.0, rail.line.length_m))]
    assert course_of(line, pieces).cant_m == pytest.approx(track[0].cant_m, abs=1e-4)


def test_where_a_rail_is_missing_the_cant_is_interpolated(track):
    scene = scenes.double_track(1, elements=SHORT, grade=0.020, apart_m=0)
    (line,), (left, right) = scenes.lines_of(scene)
    course = course_of(line, [left, right.part(0, 20.0), right.part(26.0, right.line.length_m)])
    inside = (course.s > 21.0) & (course.s < 25.0)
    assert course.bridged[inside].all()
    assert course.cant_m[inside] == pytest.approx(0.0, abs=1e-4)


def test_without_rails_the_error_holds_all_of_the_cant():
    scene = scenes.double_track(1, elements=SHORT, apart_m=0)
    course = courses_of(scene, with_rails=False)[0]
    assert not course.has_cant
    assert course.sigma_at(np.array([4.3]), np.array([40.0])) == pytest.approx(4.3 * 0.12 / 1.505, rel=0.01)
