"""Which points belong to which line."""

import numpy as np
import pytest
from built import cloud_of
from rail_extract.core.heads.head_points import lengths_by_kind, near_lines

WIDTH = 0.072


def test_points_belong_to_the_nearest_line_in_order_along_it():
    lines = [np.array([[0.0, y], [10.0, y]]) for y in (0.0, 0.1)]
    xyz = np.array([[7.0, 0.02, 1.0], [3.0, 0.09, 2.0], [2.0, -0.03, 3.0], [5.0, 1.0, 4.0]])
    one, other = near_lines(lines, cloud_of(xyz, strips=np.array([4, 5, 6, 7])), np.array([WIDTH, 0.06]))
    np.testing.assert_allclose([one.t, one.across, one.z], [[2, 7], [-0.03, 0.02], [3, 1]])
    np.testing.assert_allclose([other.t, other.across, other.z], [[3], [-0.01], [2]])
    assert (one.strips.tolist(), other.strips.tolist()) == ([6, 4], [5])
    assert (one.width_m, other.width_m, one.length_m) == (WIDTH, 0.06, 10.0)
    assert not one.free[1].any() and one.free[0].all() and not other.free[0].any()
    assert one.within(0.3).tolist() == [False, True]
    assert one[one.within(0.3)].strips.tolist() == [4]


@pytest.mark.parametrize("aside_m", [-0.035, 0.0, 0.03])
def test_strips_show_what_they_are_beside_a_line_that_several_show(aside_m):
    """Ridges of images and heads of a scanner, registered apart, along one line of 50 m."""
    rng = np.random.RandomState(5)
    x, y = rng.uniform(0, 50, 4000), rng.uniform(-0.12, 0.12, 4000)
    ridge = np.column_stack([x, y, 0.12 * np.exp(-0.5 * ((y - aside_m) / 0.06) ** 2) + rng.normal(0, 0.006, 4000)])
    head = np.column_stack([x, aside_m + 0.3 * y, rng.normal(0, 0.003, 4000)])
    line = np.array([[0.0, 0.0], [50.0, 0.0]])
    kinds = [lengths_by_kind(near_lines([line], cloud_of(xyz), WIDTH)) for xyz in (head, ridge)]
    np.testing.assert_allclose(kinds, [[50, 0], [0, 50]], atol=0.5)


def test_faces_that_tripods_on_either_side_see_are_no_ridge():
    """From 15 degrees, a face of 25 mm has seven times as many points as the crown; half of the line shows either."""
    rng = np.random.RandomState(2)
    x, y = rng.uniform(0, 50, 4000), rng.uniform(-0.036, 0.036, 4000)
    on_face = rng.random_sample(4000) < 0.8
    y[on_face] = np.where(x[on_face] < 25, 0.035, -0.035) + rng.normal(0, 0.001, on_face.sum())
    z = np.where(on_face, rng.uniform(-0.035, -0.005, 4000), 0.0) + rng.normal(0, 0.003, 4000)
    near = near_lines([np.array([[0.0, 0.0], [50.0, 0.0]])], cloud_of(np.column_stack([x, y, z])), WIDTH)
    assert not near[0].is_blunt


def seen_by_beams(beam_m, length_m, count):
    """Points, (n, 3), on a straight head of 68 mm, 13 cm above its bed: beams blend what they meet beside it."""
    rng = np.random.RandomState(0)
    x, y = rng.uniform(0, length_m, count), rng.uniform(-0.034, 0.034, count)
    beside = (np.abs(y) + rng.uniform(-0.5, 0.5, (100, 1)) * beam_m > 0.034).mean(axis=0)
    return np.column_stack([x, y, -0.13 * beside + rng.normal(0, 0.007, count)])


@pytest.mark.parametrize(("beam_m", "blunt"), [(0.055, True), (0.01, False)])
def test_a_line_that_winds_about_its_head_shows_whether_beams_blend_it(beam_m, blunt):
    """Along the whole line, either side is off the head as often, and heights fall to both; six points per metre."""
    seen = seen_by_beams(beam_m, 100.0, 600)
    seen[:, 1] += 0.018 * np.sin(seen[:, 0] / 4)
    (near,) = near_lines([np.array([[0.0, 0.0], [100.0, 0.0]])], cloud_of(seen), 0.068)
    assert near.is_blunt == blunt


@pytest.mark.parametrize(("beam_m", "blunt"), [(0.06, True), (0.01, False)])
def test_two_points_per_metre_show_whether_beams_blend_a_head(beam_m, blunt):
    """Sections of 8 m would have too few points on the rims."""
    (near,) = near_lines([np.array([[0.0, 0.0], [200.0, 0.0]])], cloud_of(seen_by_beams(beam_m, 200.0, 400)), 0.068)
    assert near.is_blunt == blunt


def test_a_strip_without_points_is_of_no_kind():
    empty = near_lines([np.array([[0.0, 0.0], [50.0, 0.0]])], cloud_of(np.empty((0, 3))), WIDTH)
    assert lengths_by_kind(empty).tolist() == [0, 0]
