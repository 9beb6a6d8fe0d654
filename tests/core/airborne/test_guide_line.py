"""Axes of guides: chords become curves, straight runs stay straight, and points find their feet."""

import numpy as np
import pytest
from built import arc
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.airborne.guide_line import axis_of_guide


def test_the_error_of_chords_is_removed():
    axis = axis_of_guide(arc(300.0, 400.0, 40.0))
    off = np.hypot(*(axis.xy - [0.0, 300.0]).T) - 300.0
    inner = (axis.t > 60) & (axis.t < 340)
    assert np.abs(off[inner]).max() < 0.12  # the sagitta of a chord is 0.67 m


@given(st.floats(-60, 60), st.floats(0, 6.28), st.floats(-2.5, 2.5), st.floats(20, 180))
def test_points_find_their_feet_on_a_moved_line(shift, turn, left, along):
    guide = np.array([[0.0, 0.0], [200.0, 0.0]])
    spin = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    axis = axis_of_guide(guide @ spin + shift)
    place = np.array([[along, left]]) @ spin + shift
    rough = np.clip(np.array([along]) + 0.04 * shift, 0, 199)
    t, across = axis.feet_near(place, rough)
    assert t[0] == pytest.approx(along, abs=1e-6)
    assert across[0] == pytest.approx(left, abs=1e-6)
