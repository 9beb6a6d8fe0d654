"""Cant of measured tracks from two rails, and deviations from given designs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.alignment.elements import Alignment, VerticalElement, chained
from rail_extract.core.alignment.measured import Track, beside, cant_of_rails, compared_with, deviations_of
from rail_extract.core.frame import LocalFrame
from rail_extract.core.polyline import length_along
from rail_extract.core.progress import SILENT


def moved(design, s, slew, lift):
    """Places beside a design."""
    heading = design.headings(s)
    xyz = design.xyz(s)
    xyz[:, :2] += np.column_stack([-np.sin(heading), np.cos(heading)]) * slew[:, None]
    xyz[:, 2] += lift
    return xyz


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=20, deadline=None)
def test_a_line_beside_a_design_is_measured_in_either_direction(random_design, seed, turned):
    design, random = random_design(seed), np.random.default_rng(seed)
    s = np.sort(random.uniform(10, design.s_to - 10, 200))
    slew, lift = 0.02 * np.sin(s / 30), 0.01 * np.cos(s / 40)
    cant = design.cants(s) + 0.003
    order = slice(None, None, -1 if turned else 1)
    xyz, cant = moved(design, s, slew, lift)[order], (-cant if turned else cant)[order]
    along = length_along(xyz[:, :2])
    found = deviations_of(design, 5, xyz, along, np.column_stack([along, cant]))
    assert found.track_id == 5
    assert found.s[0] == np.ceil(s[0]) and found.s[-1] == np.floor(s[-1])
    np.testing.assert_allclose(found.slew_mm, 1000 * np.interp(found.s, s, slew), atol=1e-3)
    np.testing.assert_allclose(found.lift_mm, 1000 * np.interp(found.s, s, lift), atol=1e-3)
    np.testing.assert_allclose(found.cant_diff_mm, 3.0, atol=1e-3)
    np.testing.assert_allclose(found.xyz, design.xyz(found.s))


def test_a_line_that_goes_on_past_the_design_is_measured_up_to_its_ends():
    plan = chained((0.0, 0.0), 0.0, [(100.0, 0, 0)])
    design = Alignment(1, LocalFrame(np.zeros(3)), plan, (VerticalElement(0, 100, 5, 0.01, 0.01),))
    xyz = np.array([[-200.0, 9, 9], [-30, 0.03, 4.7], [40, 0.03, 5.4], [120, 0.03, 6.2], [400, 9, 9]])
    found = deviations_of(design, 1, xyz, length_along(xyz[:, :2]), np.zeros((0, 2)))
    np.testing.assert_allclose(found.s, np.arange(101))
    np.testing.assert_allclose(found.slew_mm, 30, atol=1e-6)
    np.testing.assert_allclose(found.lift_mm, 0, atol=1e-6)


def test_without_heights_and_cant_their_deviations_are_unknown(random_design):
    design = random_design(3)
    s = np.arange(20.0, 120.0, 5.0)
    xyz = moved(design, s, np.full(len(s), 0.01), np.nan)
    found = deviations_of(design, None, xyz, length_along(xyz[:, :2]), np.zeros((0, 2)))
    assert found.slew_mm == pytest.approx(np.full(len(found.s), 10.0), abs=1e-3)
    assert np.isnan(found.lift_mm).all() and np.isnan(found.cant_diff_mm).all()


def test_a_line_belongs_to_the_design_along_which_it_lies(random_design):
    first, second = random_design(3), random_design(4, track_id=8)
    s = np.arange(20.0, 100.0, 5.0)
    assert beside([first, second], moved(second, s, np.full(len(s), 0.3), 0)[:, :2]) is second
    assert beside([first, second], moved(second, s, np.full(len(s), 3.5), 0)[:, :2]) is None
    before = first.places(np.array([-50.0, -10.0]))
    assert beside([first], before) is None


def test_the_cant_of_a_track_is_compared_with_the_alignment_beside_it(random_design):
    design, s = random_design(3), np.arange(5.0, 150.0)
    cant = np.column_stack([s - 5.0, design.cants(s) - 0.003])
    track = Track(8, design.xyz(s), cant, np.zeros(len(s), dtype=bool))
    ((beside, found),) = compared_with([design], [track], SILENT)
    assert beside is design and found.track_id == 8
    np.testing.assert_allclose(found.cant_diff_mm, -3.0, atol=0.05)


def test_cant_is_left_minus_right_where_both_rails_are_known():
    x = np.arange(0.0, 101.0)
    line = np.column_stack([x, 0 * x, 0 * x])
    left = np.column_stack([x, 0 * x + 0.75, 0.001 * x])[:80]
    right = np.column_stack([x, 0 * x - 0.75, -0.001 * x])
    other = np.column_stack([x, 0 * x + 3.0, 0 * x + 5.0])
    cant = cant_of_rails(line, [left, right, other])
    known = cant[:, 0] <= 79.0
    np.testing.assert_allclose(cant[known, 1], 0.002 * cant[known, 0], atol=1e-9)
    assert 79 <= cant[-1, 0] <= 81
    assert len(cant_of_rails(line, [left])) == len(cant_of_rails(line, [])) == 0
