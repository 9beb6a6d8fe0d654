"""Strips: their offsets along a line, the standard error that follows, and their alignment."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.clouds.points import RailPoints
from rail_extract.core.frame import LocalFrame
from rail_extract.core.heads.elevation import ElevationParameters, elevate
from rail_extract.core.heads.head_points import near_lines
from rail_extract.core.heads.refinement import refine
from rail_extract.core.heads.strips import (
    _from_mean,
    _inner,
    _prior,
    _third_differences,
    measure_strips,
    rows_of,
)
from rail_extract.core.lines.network import LineNetwork

HEAD_M = 0.072
LENGTH_M = 50.0


def rail(shifts, seed=0, per_m=150, noise_m=0.003, radius_m=600.0):
    """Points of strips on one head, given (strip, across, up, start, end); a line along its true axis."""
    rng = np.random.RandomState(seed)
    parts, strips = [], []
    for strip, across, up, start, end in shifts:
        count = int(per_m * (end - start))
        t, u = rng.uniform(start, end, count), rng.uniform(-0.5, 0.5, count) * HEAD_M + across
        parts.append(np.column_stack([t, t**2 / 2 / radius_m + u, 0.003 * t + up]))
        strips.append(np.full(count, strip, dtype=np.uint16))
    xyz = np.concatenate(parts) + noise_m * rng.standard_normal((sum(map(len, parts)), 3))
    x = np.arange(0.0, LENGTH_M + 0.1, 0.2)
    line = np.column_stack([x, x**2 / 2 / radius_m])
    return RailPoints(xyz, LocalFrame(np.zeros(3)), 10, np.concatenate(strips)), line


def strips_along(lines, points):
    return [measure_strips(one) for one in near_lines(lines, points.xyz, HEAD_M, points.strips)]


def single(line):
    """Return a network of one line."""
    return LineNetwork((line,), line[[0, -1]], np.array([[0, 1]]), np.empty((0, 3), dtype=int))


@pytest.mark.parametrize("third", [False, True])
def test_strips_over_the_same_place_are_offset_from_their_mean(third):
    shifts = [(3, 0.010, 0.004, 0, LENGTH_M), (8, -0.010, -0.004, 0, LENGTH_M)]
    shifts += [(9, 0.003, 0.0, 0, LENGTH_M)] if third else []
    points, line = rail(shifts)
    (found,) = strips_along([line], points)
    assert found.strips.tolist() == [one[0] for one in shifts]
    for number, values in ((1, found.across), (2, found.up)):
        expected = np.array([one[number] for one in shifts])
        np.testing.assert_allclose(values.mean(axis=1), expected - expected.mean(), atol=0.0007)
        assert np.abs(values - values.mean(axis=1, keepdims=True)).max() < 0.002
    assert (found.count == len(shifts)).all()
    np.testing.assert_allclose(np.mean(found.spread_m), 0.020, atol=0.001)
    of_mean = 0.010 if not third else np.std([0.010, -0.010, 0.003]) / np.sqrt(2)
    np.testing.assert_allclose(found.standard_error(found.across, aligned=True), of_mean, atol=0.0015)


@pytest.mark.parametrize("overlap_m", [0.0, 12.0])
def test_strips_that_follow_each_other_are_compared_where_they_meet(overlap_m):
    middle = LENGTH_M / 2
    shifts = [(1, 0.015, 0.0075, 0, middle + overlap_m / 2), (2, -0.015, -0.0075, middle - overlap_m / 2, LENGTH_M)]
    points, line = rail(shifts)
    (found,) = strips_along([line], points)
    at = int(middle)
    np.testing.assert_allclose(found.across[:, at], [0.015, -0.015], atol=0.002)
    np.testing.assert_allclose(found.up[:, at], [0.0075, -0.0075], atol=0.002)
    assert found.count[at] == 2 and found.count[3] == 1 and np.isnan(found.spread_m[3])
    # One strip alone errs by the distance of the other over the root of two.
    as_they_are = found.standard_error(found.across, aligned=False)
    np.testing.assert_allclose(as_they_are[[3, -3]], 0.030 / np.sqrt(2), atol=0.0035)
    assert as_they_are.min() > 0.012 and found.standard_error(found.across, aligned=True).min() > 0.012


def test_aligned_lines_do_not_step_and_state_what_remains():
    middle = LENGTH_M / 2
    points, line = rail([(1, 0.015, 0.0075, 0, middle), (2, -0.015, -0.0075, middle, LENGTH_M)])
    step = {}
    for align in (False, True):
        network = refine(single(line), points, HEAD_M, align=align)
        near = near_lines(network.lines, points.xyz, HEAD_M, points.strips)
        strips = [measure_strips(one) for one in near]
        (one,) = elevate(network, near, 10, ElevationParameters(align=align), strips=strips)
        true = np.interp(one.xyz[:, 0], line[:, 0], line[:, 1])
        error = np.interp([middle - 3, middle + 3], one.xyz[:, 0], one.xyz[:, 1] - true)
        height = np.interp([middle - 3, middle + 3], one.xyz[:, 0], one.xyz[:, 2] - 0.003 * one.xyz[:, 0])
        step[align] = abs(np.diff(error)[0]), abs(np.diff(height)[0])
        assert one.sigma_mm > 10 and (one.support.sigma_m > 0.01).all()
    assert step[False][0] > 0.027 and step[True][0] < 0.004
    assert step[False][1] > 0.010 and step[True][1] < 0.003


def test_points_of_one_strip_are_left_alone():
    points, line = rail([(1, 0.0, 0.0, 0, LENGTH_M)])
    assert strips_along([line], replace(points, strips=None)) == [None]
    assert strips_along([line], points) == [None]
    assert rows_of([line], [None]).shape == (0, 7)
    network = refine(single(line), replace(points, strips=None), HEAD_M)
    aligned = refine(single(line), replace(points, strips=None), HEAD_M, align=True)
    np.testing.assert_array_equal(network.lines[0], aligned.lines[0])


def test_rows_state_places_and_offsets_in_the_plane():
    points, line = rail([(3, 0.010, 0.0, 0, LENGTH_M), (8, -0.010, 0.0, 0, LENGTH_M)])
    turned = np.array([[0.0, -1.0], [1.0, 0.0]])
    xyz = np.column_stack([points.xyz[:, :2] @ turned.T, points.xyz[:, 2]])
    rows = rows_of([line @ turned.T], strips_along([line @ turned.T], replace(points, xyz=xyz)))
    assert len(rows) == 2 * 51 and set(rows[:, 2]) == {3.0, 8.0}
    # The line now runs north, and its left is in the west.
    np.testing.assert_allclose(rows[rows[:, 2] == 3, 3].mean(), -0.010, atol=0.001)
    np.testing.assert_allclose(rows[rows[:, 2] == 8, 3].mean(), 0.010, atol=0.001)


def test_a_strip_does_not_show_a_rail_in_a_road_flush_with_it():
    """For 24 m one strip sees road to both sides of the head: its offset there is unknown, not 0."""
    points, line = rail([(3, 0.010, 0.0, 0, LENGTH_M), (8, -0.010, 0.0, 0, LENGTH_M)])
    x = np.random.RandomState(1).uniform(18, 42, 12_000)
    road = np.column_stack([x, x**2 / 1200 + np.linspace(-0.15, 0.15, len(x)), 0.003 * x])
    strips = np.append(points.strips, np.full(len(x), 3, dtype=np.uint16))
    (found,) = strips_along([line], replace(points, xyz=np.concatenate([points.xyz, road]), strips=strips))
    assert found.count[[10, 30]].tolist() == [2, 1] and np.isnan(found.spread_m[30])
    np.testing.assert_allclose(found.across[0, 5:40], 0.010, atol=0.002)


def test_the_ends_of_what_a_strip_shows_are_left_out_but_not_those_of_its_holes():
    number = np.arange(50)
    small = (number >= 5) & (number < 40) & ~((number >= 20) & (number < 24))
    np.testing.assert_array_equal(np.flatnonzero(_inner(small)), np.arange(7, 38))
    large = ~((number >= 20) & (number < 25))
    np.testing.assert_array_equal(np.flatnonzero(_inner(large)), np.append(np.arange(18), np.arange(27, 50)))


def test_third_differences_are_those_of_a_cubic_to_the_left():
    x = np.arange(0.0, 30.1, 0.1)
    cubic = np.column_stack([x, 1e-5 * x**3])
    t = np.arange(0.5, 20.0)
    np.testing.assert_allclose(_third_differences(cubic, t), 6e-5, rtol=0.02)
    turned = cubic[:, ::-1] * [-1, 1]
    np.testing.assert_allclose(_third_differences(turned, t), 6e-5, rtol=0.02)
    np.testing.assert_allclose(_third_differences(cubic * [1, -1], t), -6e-5, rtol=0.02)
    assert [len(_third_differences(cubic, t[:count])) for count in (3, 4, 5)] == [0, 1, 2]


@pytest.mark.parametrize("third", [np.empty(0), np.zeros(117)])
def test_the_offset_of_a_strip_drifts_by_two_centimetres_and_forgets_over_fifty_metres(third):
    matrix, target = _prior(2, 120, third)
    information = (matrix.T @ matrix).toarray()
    offsets = np.arange(360).reshape(120, 3)[:, 1]
    covariance = np.linalg.inv(information[np.ix_(offsets, offsets)])
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), 0.02, rtol=0.02)
    away = np.arange(120) / 50.0
    np.testing.assert_allclose(covariance[0] / 0.02**2, (1 + away) * np.exp(-away), atol=0.03)
    assert not information[np.ix_(offsets, offsets + 1)].any() and not target.any()


def test_strips_that_meet_are_off_by_half_of_their_step_whatever_the_line_does():
    """The line wanders by 4 mm, and one station of a strip is 30 mm off."""
    t = np.arange(0.5, 60.0)
    line = np.column_stack([np.append(t - 0.5, 60.0), 0.004 * np.sin(np.append(t - 0.5, 60.0) / 9)])
    rail = -np.interp(t, *line.T)
    shown = np.array([np.where(t < 32, rail + 0.008, np.nan), np.where(t > 28, rail - 0.008, np.nan)])
    shown[0, 10] += 0.03
    found = _from_mean(shown + 0.1, _third_differences(line, t))
    np.testing.assert_allclose(found[:, 25:35], [[0.008], [-0.008]] * np.ones(10), atol=0.0006)
    np.testing.assert_allclose(found[0] + found[1], 0.0, atol=0.002)
    np.testing.assert_allclose(found[0, 8:13], found[0, 20], atol=0.002)


def test_points_at_the_very_end_of_a_line_are_in_its_last_station():
    """Feet may lie a little beyond the end of a line, here one of whole metres."""
    random = np.random.RandomState(0)
    x = np.tile(np.linspace(0, 20.0004, 4000), 2)
    xyz = np.column_stack([x, random.uniform(-0.036, 0.036, 8000), np.zeros(8000)])
    strips = np.repeat([1, 2], 4000).astype(np.uint16)
    line = np.column_stack([np.linspace(0, 20, 201), np.zeros(201)])
    (found,) = strips_along([line], RailPoints(xyz, LocalFrame(np.zeros(3)), 10, strips))
    assert found.points.shape == (2, 20)
    assert found.points[:, 10] == pytest.approx(200, rel=0.05)
