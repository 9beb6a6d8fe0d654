"""Scenes of uneven rails: the truth follows waves and welds, heads have the stated shape, ridges have no edges."""

import numpy as np
import pytest
from rail_extract.core.polyline import project
from rail_extract.laboratory.scenes.scanner import NEW, Scanner, head_outline
from rail_extract.laboratory.scenes.uneven import (
    FLAT,
    WELD_DIP_M,
    WELD_EVERY_M,
    WELD_HALF_M,
    flat,
    plain_track,
    ridge,
    rough,
    uneven,
    worn,
)


def around(scene, rail):
    """Offset to the left and height above a true rail of the points near it."""
    feet = project([scene.rails[rail][:, :2]], scene.xyz[:, :2], 0.08)
    true = scene.rails[rail]
    t = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(true[:, :2], axis=0).T))])
    return feet.across, scene.xyz[feet.point, 2] - np.interp(feet.t, t, true[:, 2]), feet.t


def test_rails_have_waves_and_welds_as_deep_as_stated():
    chainage = np.arange(0, 60, 0.01)
    across, up = uneven(np.random.RandomState(3), chainage).T
    assert 0.0010 < across.std() < 0.0013
    assert across.mean() == pytest.approx(0, abs=0.0002)
    kinks = np.diff(up, 2) / 0.01
    welds = np.flatnonzero(kinks > 0.7 * 2 * WELD_DIP_M / WELD_HALF_M)
    assert kinks[welds] == pytest.approx(2 * WELD_DIP_M / WELD_HALF_M, rel=0.2)
    assert np.diff(welds) * 0.01 == pytest.approx(WELD_EVERY_M)
    assert len(welds) in (3, 4)


def test_the_truth_follows_the_waves_of_the_points():
    scene = plain_track("clean", 103, Scanner(noise_m=0.001), rough=True)
    for rail in range(2):
        across, up, t = around(scene, rail)
        near = np.abs(across) < 0.015
        by_metre = [np.median(up[near & (t >= start) & (t < start + 1)]) for start in range(1, 58)]
        assert np.std(by_metre) < 0.0004
        true_m = scene.rails[rail][:, 2]
        design_m = np.polynomial.Polynomial.fit(np.arange(len(true_m)), true_m, 5)(np.arange(len(true_m)))
        assert np.std(true_m - design_m) > 0.0007


@pytest.mark.parametrize(("build", "fall_m"), [(rough, 0.0010), (worn, 0.0004), (flat, 0.0)])
def test_crowns_fall_as_their_radius_says(build, fall_m):
    across, up, _ = around(build(102), 0)
    slope, level = np.polyfit(across[np.abs(across) < 0.02], up[np.abs(across) < 0.02], 1)
    flat_m = up - slope * across - level
    inner, outer = np.abs(across) < 0.008, (np.abs(across) > 0.019) & (np.abs(across) < 0.025)
    found = np.median(flat_m[inner & (flat_m > -0.02)]) - np.median(flat_m[outer & (flat_m > -0.02)])
    assert found == pytest.approx(0.7 * fall_m, abs=0.0006)


def test_a_flat_head_is_as_wide_as_a_new_one_and_higher_at_its_edges():
    new, without_crown = (head_outline(0.072, shape)[0] for shape in (NEW, FLAT))
    assert np.ptp(without_crown[:, 0]) == pytest.approx(np.ptp(new[:, 0]))
    new_m, flat_m = (line[np.argmin(np.hypot(*(line - [0.033, 0.0]).T)), 1] for line in (new, without_crown))
    assert flat_m > new_m + 0.001


def test_ridges_fall_on_both_sides_and_beyond_the_head():
    across, up, _ = around(ridge(101), 0)
    for side in (1, -1):
        crown = np.median(up[np.abs(across) < 0.01])
        assert crown - np.median(up[(side * across > 0.024) & (side * across < 0.034)]) > 0.006
        assert crown - np.median(up[(side * across > 0.055) & (side * across < 0.065)]) > 0.03
