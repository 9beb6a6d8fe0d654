"""Strips: their offsets along a line, the standard error that follows, and their alignment."""

from dataclasses import replace

import numpy as np
import pytest
from built import centerline_of, cloud_of, network_of
from rail_extract.core.heads.elevation import ElevationParameters, elevate
from rail_extract.core.heads.head_points import judged, near_lines
from rail_extract.core.heads.refinement import refine
from rail_extract.core.heads.strips import (
    measure_strips,
    rows_of,
    strip_courses,
)
from rail_extract.laboratory.scenes.scanner import Scanner, scan
from rail_extract.laboratory.scenes.tracks import Railhead

HEAD_M = 0.072
NORTH, EAST = np.array([0.0, 1.0]), np.array([1.0, 0.0])
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
    return cloud_of(xyz, strips=np.concatenate(strips)), line


def scanned(passes):
    """Points of strips on a straight head of new shape, given (across, up, left of the scanner, height, points)."""
    x = np.arange(0.0, LENGTH_M, 0.01)
    line = np.column_stack([x, 0 * x, 0 * x])
    head = Railhead(line, np.tile([0.0, 0.0, 1.0], (len(x), 1)), np.tile([0.0, 1.0, 0.0], (len(x), 1)))
    rng, parts = np.random.RandomState(3), []
    for across, up, left_m, height_m, count in passes:
        seen = Scanner(noise_m=0.002, face_share=1.0, left_m=left_m, height_m=height_m, half_range_m=30.0)
        points = scan(head, HEAD_M, line[::10], seen, rng)
        kept = rng.choice(len(points), min(count, len(points)), replace=False)
        parts.append(points[np.sort(kept)] + [0.0, across, up])
    strips = np.repeat(np.arange(1, len(parts) + 1), [len(part) for part in parts]).astype(np.uint16)
    return cloud_of(*parts, strips=strips), line[::20, :2]


def strips_along(lines, points):
    return [measure_strips(one) for one in near_lines(lines, points, HEAD_M)]


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
    np.testing.assert_allclose(found.standard_error(found.across, align=True), of_mean, atol=0.0015)


@pytest.mark.parametrize(("across_m", "up_m"), [(0.008, 0.006), (0.015, -0.011)])
def test_a_line_is_on_the_mean_of_overlapping_strips_however_dense_they_are(across_m, up_m):
    points, line = scanned([(across_m, up_m, 1.0, 3.0, 9000), (-across_m, -up_m, 0.5, 3.0, 3000)])
    network = refine(network_of(line), points, HEAD_M)
    near = near_lines(network.lines, points, HEAD_M)
    (one,) = elevate(network, near, 10, strips=[measure_strips(near[0])])
    inner = one.xyz[(one.xyz[:, 0] > 3) & (one.xyz[:, 0] < LENGTH_M - 3)]
    assert np.abs(inner[:, 1:].mean(axis=0)).max() < 0.001
    assert np.abs(inner[:, 1:]).max() < 0.002
    assert one.sigma_mm > 7


def test_each_strip_shows_whether_heads_are_blunt():
    points, line = scanned([(-0.020, 0.011, 1.0, 3.0, 9000), (0.020, -0.011, 0.5, 3.0, 9000)])
    assert judged(points, [line], HEAD_M).blunt is False
    assert judged(replace(points, strips=None), [line], HEAD_M).blunt is True


@pytest.mark.parametrize("off_m", [-0.012, 0.0, 0.012])
def test_strips_far_apart_are_gathered_wherever_the_line_is(off_m):
    points, line = scanned([(-0.015, 0.011, 1.0, 3.0, 9000), (0.015, -0.011, 0.5, 3.0, 9000)])
    (found,) = strips_along([line + [0.0, off_m]], points)
    assert found.gathered.all()


def test_points_stay_where_strips_differ_because_each_sees_another_face():
    points, line = scanned([(0.0, 0.0, 9.0, 1.2, 9000), (0.0, 0.0, -9.0, 1.2, 9000)])
    (near,) = near_lines([line], replace(points, blunt=False), HEAD_M)
    found = measure_strips(near)
    assert np.abs(found.across).min() > 0.003
    np.testing.assert_array_equal(found.moved(near).across, near.across)


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
    as_they_are = found.standard_error(found.across, align=False)
    np.testing.assert_allclose(as_they_are[[3, -3]], 0.030 / np.sqrt(2), atol=0.0035)
    assert as_they_are.min() > 0.012 and found.standard_error(found.across, align=True).min() > 0.012


def test_aligned_lines_do_not_step_and_state_what_remains():
    middle = LENGTH_M / 2
    points, line = rail([(1, 0.015, 0.0075, 0, middle), (2, -0.015, -0.0075, middle, LENGTH_M)])
    step = {}
    for align in (False, True):
        network = refine(network_of(line), points, HEAD_M, align=align)
        near = near_lines(network.lines, points, HEAD_M)
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
    network = refine(network_of(line), replace(points, strips=None), HEAD_M)
    aligned = refine(network_of(line), replace(points, strips=None), HEAD_M, align=True)
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


COURSE_M = 20.0
"""Length of tracks that strips cover."""


def centerline(start, way, track_id):
    return centerline_of([[*start, 0.0], [*np.add(start, COURSE_M * way), 0.0]], track_id)


def rows(start, way, strip, left_m, up_m, aside_m):
    """Stations every half metre on a rail beside a track, at which a strip is off by this."""
    left = np.array([-way[1], way[0]])
    places = np.add(start, np.arange(0.25, COURSE_M, 0.5)[:, None] * way + aside_m * left)
    count = len(places)
    values = [np.full(count, strip), *np.tile(left_m * left, (count, 1)).T, np.full(count, up_m), np.full(count, 9)]
    return np.column_stack([places, *values])


def test_each_strip_of_each_track_has_its_offsets_along_it():
    lines = [centerline((0, 0), NORTH, 4), centerline((30, 5), -EAST, 7)]
    found = strip_courses(
        lines,
        np.concatenate(
            [
                rows((0, 0), NORTH, 1, 0.010, -0.004, 0.7),
                rows((0, 0), NORTH, 1, 0.020, -0.006, -0.7),  # the other rail
                rows((0, 0), NORTH, 2, -0.015, 0.005, 0.7),
                rows((30, 5), -EAST, 2, 0.008, 0.001, 0.7),
                rows((100, 0), NORTH, 3, 1.0, 1.0, 0.0),  # no track
                rows((0, 0), NORTH, 3, 1.0, 1.0, 1.2),  # another rail
            ]
        ),
    )
    assert [(one.track_id, one.strip) for one in found] == [(4, 1), (4, 2), (7, 2)]
    for one, across_mm, up_mm in zip(found, (15, -15, 8), (-5, 5, 1)):
        assert one.chainage_m == pytest.approx(np.arange(0.5, COURSE_M))
        assert one.across_mm == pytest.approx(across_mm)
        assert one.up_mm == pytest.approx(up_mm)


def test_no_strips_have_no_courses():
    assert strip_courses([centerline((0, 0), NORTH, 1)], np.empty((0, 7))) == ()
