"""Ends of tracks beside tracks that go on; holes are tested with the report."""

import numpy as np
import pytest
from built import centerline_of
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.checks.ends import ends_of, find_early_ends, find_holes


def on_arc(track_id, start_m, end_m, left_m=0.0, radius_m=600.0):
    """Return a track `left_m` inside an arc, between two chainages of the arc; it rises by 2 per mille."""
    along = np.linspace(start_m, end_m, round(abs(end_m - start_m)) + 1)
    angle, radius_m = along / radius_m, radius_m - left_m
    xyz = np.column_stack([radius_m * np.sin(angle), -radius_m * np.cos(angle), 0.002 * along])
    return centerline_of(xyz, track_id, (2 * track_id - 1,), (2 * track_id,), 1435.0, 0.5)


def early(*lines):
    ends = list(ends_of(lines))
    return list(find_early_ends(ends, list(find_holes(ends))))


@given(
    st.floats(-7.5, 7.5).filter(lambda left_m: abs(left_m) > 3),
    st.floats(30, 150),
    st.booleans(),
    st.booleans(),
    st.floats(-200, 200),
)
def test_a_track_goes_on_beside_the_next_one(left_m, missing_m, at_start, is_turned, rise_m):
    """The section keeps its distance from the neighbour, and has its height and its length."""
    whole = on_arc(1, *((200, 0) if is_turned else (0, 200)), radius_m=600.0 + rise_m)
    span = (missing_m, 200) if at_start else (0, 200 - missing_m)
    (found,) = early(whole, on_arc(2, *span, left_m, radius_m=600.0 + rise_m))
    assert (found.track_id, found.beside) == (2, 1)
    assert found.length_m == pytest.approx(missing_m, abs=0.01)
    np.testing.assert_allclose(np.hypot(*found.xyz[:, :2].T), 600.0 + rise_m - left_m, atol=0.01)
    ends = sorted(0.002 * along for along in ((0.0, missing_m) if at_start else (200.0 - missing_m, 200.0)))
    np.testing.assert_allclose(sorted(found.xyz[[0, -1], 2]), ends, atol=1e-3)


@pytest.mark.parametrize(
    ("why", "other"),
    [
        ("it ends less than 10 m earlier", on_arc(2, 0, 191, 4.5)),
        ("it is too far aside", on_arc(2, 0, 150, 9.0)),
        ("it ends on the other track", on_arc(2, 0, 150, 0.2)),
    ],
)
def test_no_end_is_early(why, other):
    assert early(on_arc(1, 0, 200), other) == []


def test_a_branch_does_not_end_beside_its_track():
    """It is 4 m aside at its end, where it leaves the track by 1:9."""
    along = np.linspace(0.0, 36.0, 37)
    branch = centerline_of(np.column_stack([along, along / 9, 0 * along]), 2, (3,), (4,), 1435.0, 0.5)
    stock = centerline_of(np.column_stack([np.linspace(-50, 150, 201), np.zeros((201, 2))]), 1, (1,), (2,), 1435.0, 0.5)
    assert early(stock, branch) == []


def test_the_ends_of_a_hole_are_not_early():
    assert early(on_arc(1, 0, 200), on_arc(2, 0, 80, 4.5), on_arc(3, 120, 200, 4.5)) == []


def test_the_nearest_of_several_tracks_tells():
    found = early(on_arc(1, 0, 200), on_arc(2, 0, 150, 4.0), on_arc(3, 0, 120, 7.5))
    assert [(one.track_id, one.beside) for one in found] == [(2, 1), (3, 2)]
    assert [one.length_m for one in found] == pytest.approx([50, 30], abs=0.3)
