"""Comparison of lines with the truth, on lines whose errors are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built import geometry_of
from rail_extract.core.rails import Centerline, RailLine
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.ruler.lines import compare_lines, match
from rail_extract.laboratory.ruler.tracks import compare_geometry, compare_tracks


def straight(start=0.0, end=100.0, left=0.0, up=0.0, heading=0.3, count=11):
    """Build a straight line along a heading, shifted to its left and up."""
    along = np.array([np.cos(heading), np.sin(heading)])
    xy = np.linspace(start, end, count)[:, None] * along + left * np.array([-along[1], along[0]])
    return np.column_stack([xy, np.full(count, up)])


def test_the_truth_itself_is_perfect():
    lines = [straight(), straight(left=1.5)]
    result = compare_lines(lines, lines)
    assert (result.completeness, result.correctness) == (1.0, 1.0)
    assert result.length_ratio == pytest.approx(1)
    assert result.lateral_rmse_m < 1e-9
    assert result.height_rmse_m < 1e-9
    assert (result.line_count, result.truth_count) == (2, 2)


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("count", [2, 7, 1001])
def test_a_shift_shows_with_its_sign_whatever_the_direction_and_vertices(turn, count):
    line = straight(left=0.012, up=-0.004, count=count)[::turn]
    result = compare_lines([line], [straight()])
    assert result.lateral_bias_m == pytest.approx(0.012, abs=1e-9)
    assert result.lateral_rmse_m == pytest.approx(0.012, abs=1e-9)
    assert result.lateral_p95_m == pytest.approx(0.012, abs=1e-9)
    assert result.height_bias_m == pytest.approx(-0.004, abs=1e-9)
    assert result.height_rmse_m == pytest.approx(0.004, abs=1e-9)


def test_a_wave_has_the_rms_of_a_sine():
    chainage = np.arange(0, 100, 0.01)
    wave = np.column_stack([chainage, 0.01 * np.sin(2 * np.pi * chainage / 10), np.zeros_like(chainage)])
    result = compare_lines([wave], [straight(heading=0.0)])
    assert result.lateral_rmse_m == pytest.approx(0.01 / np.sqrt(2), rel=1e-2)
    assert abs(result.lateral_bias_m) < 1e-4


def test_missing_and_false_length_count_by_length():
    lines = [straight(0, 60), straight(70, 90), straight(left=3.0, end=20)]
    result = compare_lines(lines, [straight()])
    assert result.completeness == pytest.approx(0.80, abs=0.002)
    assert result.correctness == pytest.approx(0.80, abs=0.002)
    assert result.length_ratio == pytest.approx(1.0)


def test_lines_that_cross_do_not_affect_each_other():
    lines = [straight(-50, 50, left=0.01, heading=0.0), straight(-50, 50, left=0.01, heading=0.1)]
    truth = [straight(-50, 50, heading=0.0), straight(-50, 50, heading=0.1)]
    result = compare_lines(lines, truth)
    assert result.completeness == 1.0
    # Only a few centimetres around the crossing are closer to the other line.
    assert result.lateral_bias_m == pytest.approx(0.01, abs=2e-4)


def test_the_share_within_sigma_uses_the_standard_error_of_each_place():
    found = match([straight(left=0.004), straight(left=2.012, end=50)], [straight(), straight(left=2)])
    assert found.share_within(np.array([0.005, 0.005])[found.line]) == pytest.approx(2 / 3, abs=0.001)
    assert found.share_within(np.array([0.005, 0.015])[found.line]) == 1.0
    assert found.share_within(np.array([0.001, 0.001])[found.line]) == 0.0
    assert found.share_within(np.where(found.t < 25, 0.013, 0.0)) == pytest.approx(1 / 3, abs=0.001)


def test_nothing_that_is_to_be_found_has_no_share():
    found = match([straight(left=0.004)], [straight()])
    none = found.where(np.zeros(len(found.there.distance), dtype=bool), np.zeros(len(found.line), dtype=bool))
    assert np.isnan(none.within(0.05).completeness)


def test_gauge_and_cant_are_measured_along_the_track():
    truth = [straight(left=0.75), straight(left=-0.75)]
    lines = [straight(left=0.753, up=0.004), straight(left=-0.75)]
    rails = [RailLine(line, number, 10, 0, 0.0, 0.0, 0.0) for number, line in enumerate(lines, start=1)]
    middle = straight(left=0.0015, up=0.002)
    track = Centerline(middle, 1, 10, (1,), (2,), 1431.0, 0.0, 0.0, 0.0, 0.0)
    errors = compare_tracks([track], rails, truth, 0.072)
    assert errors.gauge_bias_m == pytest.approx(0.003, abs=1e-4)
    assert errors.cant_bias_m == pytest.approx(0.004, abs=1e-6)
    assert errors.cant_rmse_m == pytest.approx(0.004, abs=1e-6)
    assert np.isnan(compare_tracks([], rails, truth, 0.072).gauge_bias_m)


def test_measured_geometry_is_compared_with_the_truth():
    """A straight of 60 m and an arc of 600 m radius, measured with known errors."""
    curve = trace([Element(60.0), Element(80.0, 1 / 600, 1 / 600)])
    rails = [np.column_stack([curve.offset(left), np.full(len(curve.xy), left / 100)]) for left in (0.75, -0.75)]
    middle = np.column_stack([curve.xy, np.zeros(len(curve.xy))])
    at = np.searchsorted(curve.chainage, np.arange(1.0, 139.0))
    track = geometry_of(
        middle[at],
        curve.chainage[at],
        gauge_mm=np.full(len(at), 1.5e3 - 72 + 2.0),
        cant_mm=np.full(len(at), 15.0 - 1.0),
        radius_m=np.where(curve.chainage[at] > 60, 606.0, np.nan),
    )
    errors = compare_geometry([track], rails, [middle], 0.072)
    assert errors.gauge_m == pytest.approx(0.002, abs=1e-4)
    assert errors.cant_m == pytest.approx(0.001, abs=1e-4)
    assert errors.radius == pytest.approx(0.01, abs=2e-4)
    straight_track = replace(track, xyz=track.xyz[:30], gauge_mm=track.gauge_mm[:30], cant_mm=track.cant_mm[:30])
    straight_track = replace(straight_track, radius_m=track.radius_m[:30])
    assert np.isnan(compare_geometry([straight_track], rails, [middle], 0.072).radius)
    assert np.isnan(compare_geometry([], rails, [middle], 0.072).gauge_m)
