"""Conversion between coordinates of a cloud, local metres, and the local metres of another frame."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.frame import LocalFrame

FOOT = 0.3048
UNITS = st.sampled_from([1.0, FOOT, 1200 / 3937])
ORIGINS = st.tuples(*[st.floats(-1e7, 1e7)] * 3)
PLACES = st.lists(st.tuples(*[st.floats(-1e4, 1e4)] * 3), min_size=1, max_size=5)


@given(ORIGINS, PLACES, UNITS)
def test_converting_there_and_back_changes_nothing(origin, xyz, unit):
    frame = LocalFrame(np.array(origin), unit, 1.0)
    np.testing.assert_allclose(frame.to_local(frame.to_crs(np.array(xyz))), np.array(xyz), rtol=0, atol=1e-7)


def test_plan_and_height_have_their_own_units():
    frame = LocalFrame(np.array([100.0, 200.0, 50.0]), FOOT, 1.0)
    np.testing.assert_allclose(frame.to_local(np.array([[110.0, 200.0, 53.0]])), [[3.048, 0.0, 3.0]])
    np.testing.assert_allclose(frame.to_crs(np.array([[3.048, 0.0, 3.0]])), [[110.0, 200.0, 53.0]])


@given(ORIGINS, ORIGINS, PLACES, UNITS)
def test_a_shift_leads_to_the_same_place_in_the_other_frame(origin, other, xyz, unit):
    frame, other = LocalFrame(np.array(origin), unit, unit), LocalFrame(np.array(other), unit, unit)
    expected = other.to_local(frame.to_crs(np.array(xyz)))
    np.testing.assert_allclose(np.array(xyz) + frame.shift_to(other), expected, rtol=0, atol=1e-6)


def test_a_shift_between_different_units_of_height_keeps_the_height():
    feet, metres = LocalFrame(np.array([0.0, 0.0, 1000.0]), FOOT, FOOT), LocalFrame(np.zeros(3), FOOT, 1.0)
    np.testing.assert_allclose(feet.shift_to(metres), [0.0, 0.0, 304.8])
    np.testing.assert_allclose(metres.shift_to(feet), [0.0, 0.0, -304.8])


def test_a_frame_with_another_origin_keeps_its_units_and_system():
    frame = LocalFrame(np.array([100.0, 200.0, 50.0]), FOOT, 1.0, "EPSG:2222")
    moved = frame.with_origin(np.array([3.048, -3.048, 2.0]))
    np.testing.assert_allclose(moved.origin, [110.0, 190.0, 52.0])
    assert (moved.horizontal_unit_m, moved.vertical_unit_m, moved.crs_wkt) == (FOOT, 1.0, "EPSG:2222")
