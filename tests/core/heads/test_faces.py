"""Heads of which a scanner shows one side."""

import numpy as np
import pytest
from rail_extract.core.heads.axis import Axis
from rail_extract.core.heads.faces import FLANK_SIGMA_M, beside_faces, find_flank
from rail_extract.core.heads.head_points import HeadPoints, stations_along

WIDTH, UNSEEN, NOISE_M = 0.072, 0.04 / np.sqrt(12), 0.002


def along(t, across, up, length_m):
    """Points of a straight line, in order along it."""
    order = np.argsort(t)
    free = np.ones((2, len(stations_along(length_m))), dtype=bool)
    return HeadPoints(t[order], across[order], up[order], WIDTH, np.array([[0.0, 0.0], [length_m, 0.0]]), free)


def seen_from_right(count, length_m, seed, corner=0.5):
    """Points of a head that a far scanner on its right sees: the right face, its corner and a little of the crown."""
    rng = np.random.default_rng(seed)
    below, turn = rng.uniform(0.013, 0.037, count), rng.uniform(0.2, np.pi / 2, count)
    off = np.full(count, WIDTH / 2)
    on_corner, on_crown = rng.random(count) < corner, rng.random(count) < 0.15
    off[on_corner], below[on_corner] = 0.023 + 0.013 * np.sin(turn[on_corner]), 0.014 - 0.013 * np.cos(turn[on_corner])
    off[on_crown], below[on_crown] = rng.uniform(0.005, 0.023, on_crown.sum()), 0.0
    t, noise = rng.uniform(0, length_m, count), rng.normal(0, NOISE_M, (2, count))
    return t, noise[0] - off, noise[1] - below


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("seed", [1, 7, 11])
def test_a_face_with_much_of_its_corner_is_not_taken_for_a_crown(seed, side):
    """The fit of a crown slides onto such a face: where fits agree, the side is certain."""
    rng, count = np.random.default_rng(seed), 150
    below, from_axis, turn = (
        rng.uniform(0.013, 0.04, count),
        np.full(count, WIDTH / 2),
        rng.uniform(0.2, np.pi / 2, count),
    )
    corner = rng.random(count) < 0.6
    from_axis[corner], below[corner] = 0.023 + 0.013 * np.sin(turn[corner]), 0.014 - 0.013 * np.cos(turn[corner])
    t, noise_m = np.sort(rng.uniform(0, 22, count)), 0.002
    across = side * (from_axis - WIDTH / 2 + rng.normal(0, noise_m, count))
    flank = find_flank(along(t, across, -below + rng.normal(0, noise_m, count), 22.0))
    assert flank is not None
    assert abs(flank.left_m + side * WIDTH / 2) < 0.006


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("mirror", [-1, 1])
def test_a_few_points_of_a_far_rail_show_the_side_of_its_axis(seed, mirror):
    """In worlds 8084 and 8120, lines with two points per metre were on the face or on the wrong side of it."""
    length_m = 80.0
    t, across, up = seen_from_right(160, length_m, seed)
    wander_m = 0.036 + 0.02 * np.sin(t / 12)  # the line is on the face, and wanders about it
    points = along(t, mirror * (across + wander_m), up, length_m)
    axis = Axis.of(points, UNSEEN, by_outline=False)
    stations = np.arange(5.0, 75.0)
    off_m = axis.course.at(stations) - mirror * (0.036 + 0.02 * np.sin(stations / 12))
    assert np.sqrt(np.mean(off_m**2)) < 0.012


@pytest.mark.parametrize("seed", [1, 2, 3, 6])
def test_points_of_the_foot_do_not_draw_a_line_off_the_face_of_its_head(seed):
    """One in twenty-five led the line 1 to 2 cm aside, so that the next fit took the face for the other one (15008)."""
    t, across, up = seen_from_right(285, 64.0, seed, corner=0.2)
    rng = np.random.default_rng(seed)
    on_foot = rng.random(len(t)) < 0.04
    across[on_foot] -= rng.uniform(0.02, 0.06, on_foot.sum())
    up[on_foot] = -rng.uniform(0.09, 0.13, on_foot.sum())
    axis = Axis.of(along(t, across + WIDTH / 2, up, 64.0), UNSEEN)
    assert axis.flank is not None
    assert np.abs(axis.course.at(np.arange(3.0, 61.0)) - WIDTH / 2).max() < 0.002


def test_a_section_that_may_be_on_either_face_follows_the_rest_of_its_line():
    """Points of the face alone, as where a train hides the crown, do not tell one face from the other."""
    face_t, face, below = seen_from_right(70, 40.0, 3)
    rng = np.random.default_rng(3)
    face, below = rng.normal(-WIDTH / 2, NOISE_M, 70), -rng.uniform(0.012, 0.037, 70)
    t, across, up = seen_from_right(140, 40.0, 4)
    wanted = np.ones(len(stations_along(80.0)), dtype=bool)
    alone = beside_faces(along(face_t, face, below, 40.0), wanted[:160])
    assert np.nanmedian(alone.common) == pytest.approx(np.hypot(WIDTH / 2, FLANK_SIGMA_M), rel=1e-4)
    both = along(np.append(face_t, t + 40), np.append(face, across), np.append(below, up), 80.0)
    beside = beside_faces(both, wanted)
    assert np.nanmax(beside.common) < 0.01
    assert abs(np.nanmedian(beside.offset[:150])) < 0.006


def test_few_points_at_the_end_of_a_section_may_be_on_the_other_face():
    """Far rails of tripods in worlds 13245 and 13731: the outline of the section would be 3 cm on the wrong side."""
    (near_t, near, near_up), (far_t, far, far_up) = seen_from_right(3000, 30.0, 1), seen_from_right(60, 10.0, 2)
    off_m = 0.05  # the line there
    points = np.append(near_t, far_t + 30), np.append(-near, far + off_m), np.append(near_up, far_up)
    shown = Axis.of(along(*points, 40.0), UNSEEN).shown
    assert abs(np.median(shown.offset_m[shown.t < 25])) < 0.003
    assert np.median(shown.offset_m[shown.t > 32]) == pytest.approx(off_m, abs=0.006)


@pytest.mark.parametrize("mirror", [-1, 1])
def test_a_line_beside_the_face_that_is_seen_moves_to_the_other_side_of_it(mirror):
    """In world 13880, a fit from the line took the face for noise, and in 13811 for the other face."""
    t, across, up = seen_from_right(3000, 40.0, 1)
    beside_m = 0.05  # the line is right of the right face
    shown = Axis.of(along(t, mirror * (across + beside_m), up, 40.0), UNSEEN).shown
    assert np.median(shown.offset_m) == pytest.approx(mirror * beside_m, abs=0.003)


def corner_seen_from_right(count, length_m, seed):
    """Points of a head of whose right side a class of heads keeps the upper corner alone, and a little of the crown."""
    rng = np.random.default_rng(seed)
    turn = rng.uniform(0.35, np.pi / 4, count)
    off, below = 0.023 + 0.013 * np.sin(turn), 0.014 - 0.013 * np.cos(turn)
    on_crown = rng.random(count) < 0.15
    off[on_crown], below[on_crown] = rng.uniform(0.0, 0.023, on_crown.sum()), 0.0
    t, noise = rng.uniform(0, length_m, count), rng.normal(0, NOISE_M, (2, count))
    return t, noise[0] - off, noise[1] - below


@pytest.mark.parametrize("seed", range(4))
def test_a_class_without_faces_shows_by_the_corner_on_which_side_the_axis_is(seed):
    """In world 10176, one half of a far rail was on its axis and the other not, and a line through both 6 cm off."""
    t, across, up = corner_seen_from_right(150, 80.0, seed)
    points = along(t, across + 0.036, up, 80.0)  # the line is on the edge
    axis = Axis.of(points, UNSEEN, by_outline=False)
    off_m = axis.course.at(np.arange(2.0, 78.0)) - 0.036
    assert np.sqrt(np.mean(off_m**2)) < 0.010


@pytest.mark.parametrize("seed", range(4))
def test_the_web_below_a_far_head_is_not_taken_for_the_rest_of_it(seed):
    """In world 10169, most of the points of a far rail were on its web, 3 cm beside the face, and the line too."""
    rng = np.random.default_rng(seed)
    t, across, up = seen_from_right(200, 60.0, seed)
    web = rng.normal(0, NOISE_M, (2, 200)) + np.array([np.full(200, -0.008), -rng.uniform(0.05, 0.11, 200)])
    points = along(np.append(t, rng.uniform(0, 60, 200)), np.append(across, web[0]) + 0.02, np.append(up, web[1]), 60.0)
    axis = Axis.of(points, UNSEEN, by_outline=False)
    off_m = axis.course.at(np.arange(2.0, 58.0)) - 0.02
    assert np.sqrt(np.mean(off_m**2)) < 0.010


@pytest.mark.parametrize("mirror", [-1, 1])
@pytest.mark.parametrize("seed", [2, 4])
def test_the_web_shows_on_which_side_of_the_face_the_axis_is(seed, mirror):
    """In worlds 10575 and 10731, a face and the upper end of its web were taken for the crown and the other face."""
    rng, count, length_m = np.random.default_rng(seed), 145, 110.0
    t, across, up = seen_from_right(count, length_m, seed, corner=0.2)
    web = np.array([np.full(count, -0.008), -rng.uniform(0.045, 0.11, count)])
    noise = rng.normal(0, 0.004, (2, 2 * count))
    t = np.append(t, rng.uniform(0, length_m, count))
    wander_m = 0.036 + 0.02 * np.sin(t / 12)
    across = np.append(across, web[0]) + noise[0] + wander_m
    axis = Axis.of(along(t, mirror * across, np.append(up, web[1]) + noise[1], length_m), UNSEEN, by_outline=False)
    stations = np.arange(5.0, 105.0)
    off_m = axis.course.at(stations) - mirror * (0.036 + 0.02 * np.sin(stations / 12))
    assert np.sqrt(np.mean(off_m**2)) < 0.010


@pytest.mark.parametrize(("first", "second"), [(300, 300), (400, 150), (800, 80)])
def test_a_far_rail_may_be_seen_from_one_side_and_then_from_the_other(first, second):
    """Two places of a tripod are on either side of a track: each part is drawn from its own face."""
    (t1, across1, up1), (t2, across2, up2) = (seen_from_right(count, count / 2, 3) for count in (first, second))
    length_m = (first + second) / 2
    t, across, up = np.append(t1, t2 + first / 2), np.append(across1, -across2), np.append(up1, up2)
    points = along(t, across, up, length_m)
    found = beside_faces(points, np.ones(len(points.stations), dtype=bool))
    off_m = np.abs(found.offset)
    for part in (points.stations < first / 2, points.stations > first / 2):
        assert np.nanmedian(off_m[part]) < 0.010


def test_scattered_points_show_no_head():
    """In world 8109, 50 points of ballast along a rail that nobody sees were taken for one."""
    rng = np.random.default_rng(0)
    points = along(rng.uniform(0, 90, 50), rng.uniform(-0.09, 0.09, 50), rng.normal(0, 0.01, 50), 90.0)
    beside = beside_faces(points, np.ones(len(points.stations), dtype=bool))
    assert not np.isfinite(beside.offset).any()


@pytest.mark.parametrize("count", [0, 1, 29, 31])
def test_hardly_any_points_stop_nothing(count):
    points = along(*seen_from_right(count, 20.0, 0), 20.0)
    beside = beside_faces(points, np.ones(len(points.stations), dtype=bool))
    assert np.isfinite(beside.offset).any() == (count == 31)
