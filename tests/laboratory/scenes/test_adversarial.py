"""The scenes that mislead contain what their names say."""

import numpy as np
import pytest
from rail_extract.core.polyline import project
from rail_extract.laboratory.scenes.adversarial import ADVERSARIAL
from rail_extract.laboratory.scenes.plain import spacing


def extra_points(scene):
    """Offsets from the axis, heights above it, and places of points further than 0.2 m from any rail in space."""
    xyz = scene.rail_points().xyz
    axis = scene.centerlines[0]
    feet = project([axis[:, :2]], xyz[:, :2], 6.0)
    up = xyz[feet.point, 2] - np.interp(
        feet.t, np.append(0, np.cumsum(np.hypot(*np.diff(axis[:, :2], axis=0).T))), axis[:, 2]
    )
    off = np.abs(np.abs(feet.across) - spacing(scene.standard) / 2) > 0.2
    high = up > 0.3
    return feet.across[off | high], up[off | high]


@pytest.mark.parametrize(
    ("name", "across_m", "up_m"),
    [
        ("trough", -2.23, -0.06),
        ("platform", -1.65, 0.55),
        ("fence", 3.0, 1.2),
        ("contact_wire", 0.0, 5.3),
        ("conductor", 1.16, 0.08),
        ("rack", 0.0, 0.05),
    ],
)
def test_other_things_are_where_they_are_said_to_be(name, across_m, up_m):
    across, up = extra_points(ADVERSARIAL[name]())
    assert len(up) > 5000
    assert np.median(across) == pytest.approx(across_m, abs=0.08)
    assert np.median(up) == pytest.approx(up_m, abs=0.01)


@pytest.mark.parametrize(("name", "gap_m", "count"), [("hole", 80.0, 2), ("gaps", 4.5, 14)])
def test_gaps_are_as_long_as_stated(name, gap_m, count):
    scene = ADVERSARIAL[name]()
    found = []
    for rail in scene.rails:
        t = project([rail[:, :2]], scene.rail_points().xyz[:, :2], 0.1).t
        found += np.diff(np.sort(t))[np.diff(np.sort(t)) > 2.0].tolist()
    assert len(found) == count
    assert np.mean(found) == pytest.approx(gap_m, abs=0.15)


def test_thin_points_have_ten_per_metre():
    scene = ADVERSARIAL["thin_points"]()
    assert len(scene.rail_points().xyz) == pytest.approx(10 * (120 - 15), rel=0.05)


def test_narrow_heads_are_62_mm_wide_and_72_are_stated():
    scene = ADVERSARIAL["narrow_heads"]()
    across = project([scene.rails[0][:, :2]], scene.rail_points().xyz[:, :2], 0.1).across
    assert np.ptp(np.percentile(across, [1, 99])) < 0.066
    assert scene.standard.head_width_m == pytest.approx(0.072)


@pytest.mark.parametrize(
    ("name", "across_mm", "up_mm"),
    [
        ("two_passes", (10, -10), (0, 0)),
        ("strips_meet", (15, -15), (7.5, -7.5)),
        ("strips_overlap", (15, -15), (7.5, -7.5)),
    ],
)
def test_strips_lie_as_far_from_the_truth_as_stated(name, across_mm, up_mm):
    scene = ADVERSARIAL[name]()
    points = scene.rail_points()
    feet = project([rail[:, :2] for rail in scene.rails], points.xyz[:, :2], 0.1)
    assert sorted(set(points.strips.tolist())) == [1, 2]
    for strip, across, up in zip((1, 2), across_mm, up_mm):
        mine = points.strips[feet.point] == strip
        assert 1000 * np.mean(feet.across[mine]) == pytest.approx(across, abs=4)
        rail = scene.rails[0]
        own = mine & (feet.line == 0) & (np.abs(feet.across) < 0.02)
        along = np.append(0, np.cumsum(np.hypot(*np.diff(rail[:, :2], axis=0).T)))
        above = points.xyz[feet.point[own], 2] - np.interp(feet.t[own], along, rail[:, 2])
        assert 1000 * np.median(above) == pytest.approx(up, abs=2)
    with_ids = ADVERSARIAL["unmarked_meet"]()
    assert with_ids.strips is None and with_ids.rail_points().strips is None
