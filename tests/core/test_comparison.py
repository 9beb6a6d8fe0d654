"""Surveys compared on lines whose differences are known."""

import numpy as np
import pytest
from heard import Heard
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.comparison import Survey, SurveyedLine, compare_surveys, cut, find_shift, spacing_and_cant
from rail_extract.core.errors import Cancelled
from rail_extract.core.parameters import ComparisonParameters
from rail_extract.core.rails import RailLine

SPACING_M = 1.507


def curve(left_m=0.0, up_m=0.0, length_m=200.0, radius_m=400.0, bump_m=0.0, bump=(80.0, 120.0)):
    """A left-hand arc, shifted to its left and up; over `bump` it lies further to the left."""
    s = np.arange(0, length_m + 0.25, 0.5)
    r = radius_m - left_m - np.where((s >= bump[0]) & (s <= bump[1]), bump_m, 0.0)
    angle = s / radius_m
    return np.column_stack([r * np.sin(angle), radius_m - r * np.cos(angle), np.full(len(s), 10.0 + up_m)])


def survey(*lines, sigma_mm=np.nan, rails=(), is_rail=True, **more):
    surveyed = [
        SurveyedLine(number, xyz, sigma_mm / 1000, sigma_mm / 1000, is_rail) for number, xyz in enumerate(lines, 1)
    ]
    made = [RailLine(xyz, number, 10, 0, 0.0, sigma_mm, 0.0, sigmaz_mm=sigma_mm) for number, xyz in enumerate(rails, 1)]
    return Survey(surveyed, made, **more)


def compare(reference, other, **settings):
    return compare_surveys(reference, other, ComparisonParameters(**settings))


@pytest.mark.parametrize("turn", [1, -1])
def test_differences_have_the_sign_of_the_reference_whatever_the_direction_of_the_other(turn):
    found = compare(survey(curve()), survey(curve(0.012, -0.004)[::turn], sigma_mm=1.0))
    (line,) = found.lines
    np.testing.assert_allclose(line.across_mm, 12.0, atol=0.1)
    np.testing.assert_allclose(line.height_mm, -4.0, atol=1e-6)
    np.testing.assert_allclose(np.diff(line.chainage_m)[:-1], 1.0)
    assert set(line.state) == {"both"}
    assert set(line.input_id) == {1}


def test_a_movement_is_marked_and_a_constant_shift_is_stated_apart():
    """The later survey lies 20 mm east, 10 mm south and 6 mm up; 40 m of it have moved by 15 mm."""
    shift = np.array([0.020, -0.010, 0.006])
    reference, other = survey(curve(), sigma_mm=1.0), survey(curve(bump_m=0.015) + shift, sigma_mm=2.0)
    found = compare(reference, other)
    np.testing.assert_allclose(found.shift.plan_m, shift[:2], atol=2e-4)
    assert found.shift.up_m == pytest.approx(0.006, abs=1e-9)
    assert found.shift.both
    (line,) = found.lines
    np.testing.assert_allclose(line.sigma_mm, np.hypot(1, 2))
    np.testing.assert_allclose(line.sigmaz_mm, np.hypot(1, 2))
    expected = (line.chainage_m > 81) & (line.chainage_m < 119)
    np.testing.assert_allclose((line.across_mm - line.shift_mm)[expected], 15, atol=0.5)
    beside = (line.chainage_m < 78) | (line.chainage_m > 122)
    np.testing.assert_allclose((line.across_mm - line.shift_mm)[beside], 0, atol=0.3)
    np.testing.assert_allclose(line.across_mm[0], -10, atol=0.3)  # at the start, left is north
    assert line.moved[expected].all()
    assert not line.moved[beside].any()
    assert found.moved_m == pytest.approx(40, abs=2)
    assert np.isnan(found.estimated_m)
    assert compare(reference, other, ignore_shift=False).moved_m == pytest.approx(200, abs=60)


def test_three_standard_errors_are_the_limit():
    for across_m, moved in ((0.0029, False), (0.0031, True)):
        found = compare(survey(curve(), sigma_mm=1.0), survey(curve(across_m), sigma_m=0.0), ignore_shift=False)
        assert found.lines[0].moved.all() == found.lines[0].moved.any() == moved
        assert found.lines[0].shifted.all() == found.lines[0].shifted.any() == moved


def test_without_stated_errors_the_scatter_of_the_differences_counts():
    rng = np.random.default_rng(2)
    noisy = curve(bump_m=0.03)
    noisy[:, 2] += rng.normal(0, 0.004, len(noisy))
    found = compare(survey(curve()), survey(noisy))
    (line,) = found.lines
    assert found.estimated_m == pytest.approx(0.001)
    np.testing.assert_allclose(line.sigmaz_mm, 4.0, rtol=0.2)
    assert found.moved_m == pytest.approx(40, abs=3)


def test_gauge_and_cant_between_rails():
    """The later left rail is 3 mm further left and 5 mm higher."""
    reference = survey(curve(SPACING_M / 2), curve(-SPACING_M / 2))
    other = survey(curve(SPACING_M / 2 + 0.003, 0.005), curve(-SPACING_M / 2)[::-1])
    found = compare(reference, other)
    for line in found.lines:
        np.testing.assert_allclose(line.gauge_mm, 3.0, atol=0.1)
        np.testing.assert_allclose(line.cant_mm, 5.0, atol=1e-6)
    np.testing.assert_allclose(found.lines[0].across_mm, 3.0, atol=0.1)
    np.testing.assert_allclose(found.lines[1].across_mm, 0.0, atol=0.1)


def test_gauge_and_cant_of_centerlines_come_from_their_rails():
    sides = (SPACING_M / 2, -SPACING_M / 2)
    reference = survey(curve(), is_rail=False, rails=[curve(side) for side in sides], sigma_mm=2.0)
    rails = [curve(sides[0] - 0.004, -0.006), curve(sides[1])]
    other = Survey([SurveyedLine(7, curve(-0.002, -0.003), is_rail=False)], survey(rails=rails, sigma_mm=2.0).rails)
    (line,) = compare(reference, other).lines
    np.testing.assert_allclose(line.gauge_mm, -4.0, atol=0.1)
    np.testing.assert_allclose(line.cant_mm, -6.0, atol=1e-6)
    np.testing.assert_allclose(line.sigma_mm, np.hypot(2.0, 2.0 / np.sqrt(2)))  # the rails' error for the second
    np.testing.assert_allclose(line.sigmaz_mm, np.hypot(2.0, 2.0))
    plain = compare(survey(curve(), is_rail=False), survey(curve(), is_rail=False)).lines[0]
    assert np.isnan(plain.gauge_mm).all()


def test_missing_and_extra_lengths():
    """The reference has a branch that the other survey lacks, and the other survey a second track."""
    branch = curve(radius_m=190.0, length_m=100.0)
    reference, other = survey(curve(), branch), survey(curve()[:-80], curve(4.0, length_m=150.0))
    found = compare(reference, other)
    assert found.length_of("missing") == pytest.approx(40 + 99.5, abs=1)
    assert found.length_of("extra") == pytest.approx(150 * 396 / 400, abs=1)
    assert found.length_of("both") == pytest.approx(160, abs=1)
    assert found.moved_m == 0
    extra = found.lines[-1]
    assert extra.line_id == 2
    assert set(extra.state) == {"extra"}
    assert np.isnan(extra.across_mm).all()


def test_lines_without_heights_are_compared_in_plan():
    flat = curve(0.01)
    flat[:, 2] = np.nan
    found = compare(survey(curve()), survey(flat))
    np.testing.assert_allclose(found.lines[0].across_mm, 10, atol=0.1)
    assert np.isnan(found.lines[0].height_mm).all()
    assert np.isnan(found.shift.up_m)
    assert found.moved_m == 0


def test_straight_tracks_show_only_the_shift_across():
    line = np.column_stack([np.arange(0, 101.0), np.zeros(101), np.zeros(101)])
    found = compare(survey(line), survey(line + [0.05, 0.02, 0.0]))
    np.testing.assert_allclose(found.shift.plan_m, [0, 0.02], atol=1e-6)
    assert not found.shift.both


@given(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(0, 0.4), st.integers(0, 2**31))
def test_the_shift_withstands_movements_of_up_to_two_fifths(east_m, north_m, share, seed):
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi, 400)
    left = np.column_stack([np.cos(angle), np.sin(angle)])
    across = left @ [east_m, north_m] + rng.normal(0, 0.0005, 400)
    across[: int(share * 400)] += rng.uniform(0.01, 0.2)
    found = find_shift(across, np.full(400, np.nan), left)
    np.testing.assert_allclose(found.plan_m, [east_m, north_m], atol=6e-4)


def test_nothing_in_common():
    found = compare(survey(curve()), survey(curve(50.0)))
    assert found.length_of("missing") == pytest.approx(200, abs=0.1)
    assert found.length_of("extra") == pytest.approx(200 * 350 / 400, abs=0.1)
    assert len(found.values("across_mm")) == 0


def test_nearest_places_and_cross_sections():
    lines = cut([np.array([[0.0, 0, 1], [10, 0, 1]]), np.array([[0.0, 1.5, 1.02], [10, 1.5, 1.02]])])
    feet, number = lines.nearest(np.array([[3.0, 0.2, 0.0]]))
    np.testing.assert_allclose(feet, [[3.0, 0.0, 1.0]], atol=1e-9)
    assert lines.number[number].tolist() == [0]
    found = spacing_and_cant(np.array([[3.0, 1.45], [3.0, 2.0]]), np.array([[3.0, 0.0], [3.0, 0.0]]), lines)
    np.testing.assert_allclose(found, [[np.hypot(1.5, 0.02), 0.02], [np.nan, np.nan]])


def test_a_long_line_is_compared_in_parts_and_can_be_cancelled():
    long = np.column_stack([np.arange(0, 3001.0, 5), np.zeros((601, 2))])
    found = compare(survey(long), survey(long + [0, 0.01, 0]))
    np.testing.assert_allclose(found.lines[0].across_mm, 10)
    assert len(found.lines[0].state) == 3001
    with pytest.raises(Cancelled):
        compare_surveys(survey(long), survey(long), ComparisonParameters(), Heard(cancel_after=4))
