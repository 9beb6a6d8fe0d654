"""Lines in plan: chainage, parts, normals and direction, and the feet of points on them."""

import pickle

import numpy as np
import pytest
from built import arc
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.polyline import Chords, Polyline, project

ANGLES = st.floats(0, 2 * np.pi)
SEEDS = st.integers(0, 2**32 - 1)


def winding(seed, columns=2, count=40):
    """A line whose vertices are 0.5 to 3 m apart and that turns by less than 0.1 at each."""
    random = np.random.default_rng(seed)
    heading = np.cumsum(random.uniform(-0.1, 0.1, count))
    steps = random.uniform(0.5, 3, count)[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    return np.column_stack([np.cumsum(steps, axis=0), random.uniform(0, 5, (count, columns - 2))])


@given(SEEDS, st.floats(0.3, 20), st.floats(0.01, 3))
@settings(deadline=None)
def test_resampled_stations_are_even_and_keep_the_ends(seed, length, step):
    random = np.random.default_rng(seed)
    vertices = np.cumsum(random.uniform(0, length, (6, 3)), axis=0)
    line = Polyline(vertices).resampled(step)
    np.testing.assert_allclose(line.xyz[[0, -1]], vertices[[0, -1]])
    assert np.diff(line.t).max() <= step + 1e-9
    assert np.ptp(np.diff(line.t)) < 1e-9


@given(SEEDS, st.floats(0, 1), st.floats(0, 1))
def test_parts_have_their_length_and_lie_on_the_line(seed, one, other):
    line = Polyline(winding(seed, columns=3))
    start, end = sorted([one * line.length_m, other * line.length_m])
    part = line.part(start, end)
    assert part.length_m == pytest.approx(end - start, abs=1e-9)
    t = np.linspace(0, part.length_m, 50)
    np.testing.assert_allclose(part.at(t), line.at(start + t), atol=1e-9)


@given(SEEDS, st.floats(-500, 500), ANGLES)
def test_chainage_and_turned_lines_agree(seed, shift, angle):
    line = Polyline(winding(seed))
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    turned = Polyline(line.xyz @ turn + shift)
    np.testing.assert_allclose(turned.t, line.t, atol=1e-9)
    np.testing.assert_allclose(turned.normals, line.normals @ turn, atol=1e-9)
    np.testing.assert_allclose(Polyline(line.xyz[::-1]).normals, -line.normals[::-1], atol=1e-12)


@given(SEEDS, st.floats(-0.4, 0.4))
def test_places_beside_a_line_have_their_feet_where_they_were_set_off(seed, left):
    line = Polyline(winding(seed))
    t = np.random.default_rng(seed).uniform(2, line.length_m - 2, 20)
    segment = np.searchsorted(line.t, t) - 1
    step = np.diff(line.xyz, axis=0)[segment]
    normal = np.column_stack([-step[:, 1], step[:, 0]]) / np.hypot(*step.T)[:, None]
    inside = np.minimum(t - line.t[segment], line.t[segment + 1] - t) > 0.11  # the bisector is 0.05 from the normal
    places = line.at(t) + left * normal
    feet = line.feet(places, 0.5)
    own = inside[feet.point]
    assert set(np.flatnonzero(inside)) <= set(feet.point.tolist())
    np.testing.assert_allclose(feet.t[own], t[feet.point][own], atol=5e-3)
    near_t, across = line.feet_near(places, t + 0.3)
    np.testing.assert_allclose(near_t[inside], t[inside], atol=1e-9)
    np.testing.assert_allclose(across[inside], left, atol=1e-9)


@given(SEEDS)
def test_chainages_that_are_given_are_those_of_places_and_feet(seed):
    xy = winding(seed)
    plain = Polyline(xy)
    doubled = Polyline(xy, 7 + 2 * plain.t)
    places = plain.at(np.linspace(1, plain.length_m - 1, 30))
    np.testing.assert_allclose(doubled.at(7 + 2 * plain.t), xy)
    np.testing.assert_allclose(doubled.feet(places, 0.1).t, 7 + 2 * plain.feet(places, 0.1).t, atol=1e-6)
    np.testing.assert_allclose(
        doubled.feet_near(places, doubled.t[:30])[0], 7 + 2 * plain.feet_near(places, plain.t[:30])[0]
    )


@given(SEEDS)
@settings(deadline=None)
def test_the_nearest_place_is_no_farther_than_any_other(seed):
    lines = [winding(seed, 3), winding(seed + 1, 3)]
    chords = Chords.of(map(Polyline, lines), 0.25)
    places = np.concatenate(lines)[:, :2] + np.random.default_rng(seed).uniform(-2, 2, (80, 2))
    feet, number = chords.nearest(places)
    dense = np.concatenate([Polyline(line).resampled(0.01).xyz for line in lines])[:, :2]
    least = np.hypot(*(dense[None] - places[:, None]).transpose(2, 0, 1)).min(axis=1)
    np.testing.assert_allclose(np.hypot(*(feet[:, :2] - places).T), least, atol=0.03)  # chords cut corners
    on_chord = np.linalg.norm(feet - chords.start[number], axis=1) <= chords.lengths[number] + 1e-9
    assert on_chord.all()


@given(SEEDS, st.floats(-1.2, 1.2))
def test_rays_meet_a_line_where_they_say(seed, ahead):
    line = Polyline(winding(seed, 3))
    t = np.linspace(2, line.length_m - 2, 25)
    turned = line.left_at(t) @ np.array([[np.cos(ahead), np.sin(ahead)], [-np.sin(ahead), np.cos(ahead)]])
    stations = line.at(t)[:, :2] - 1.5 * turned
    place, xyz, met_t = Chords.of([line], 0.1).meet(stations, turned, 1.5, 0.2)
    np.testing.assert_allclose(met_t, t, atol=0.01)
    np.testing.assert_allclose(xyz[:, :2], line.at(t)[:, :2], atol=0.02)
    _, missed, _ = Chords.of([line], 0.1).meet(stations, turned, 2.5, 0.2)
    assert np.isnan(missed).all()


def test_points_out_of_reach_or_past_an_end_are_left_out():
    line = np.array([[0.0, 0.0], [10.0, 0.0]])
    xy = np.array([[5.0, 0.2], [-0.05, 0.0], [10.05, 0.01], [5.0, 0.09], [1e6, 0.0]])
    assert project([line], xy, 0.1).point.tolist() == [3]


@pytest.mark.parametrize("side", [1, -1])
def test_no_point_on_either_side_of_a_tight_curve_is_lost(side):
    line = arc(25.0, 30.0)
    angle = np.random.default_rng(0).uniform(0.01, 1.19, 3000)
    radius = 25.0 - side * 0.08
    xy = np.column_stack([radius * np.sin(angle), 25.0 - radius * np.cos(angle)])
    feet = project([line], xy, 0.1)
    assert len(feet.t) == len(xy)
    np.testing.assert_allclose(feet.across, side * 0.08, atol=1e-4)
    np.testing.assert_allclose(feet.t, 25.0 * angle[feet.point], atol=1e-3)


def test_points_are_assigned_to_the_nearest_line_and_sorted_along_it():
    lines = [np.array([[0.0, y], [20.0, y]]) for y in (0.0, 0.15, 3.0)]
    random = np.random.default_rng(4)
    xy = np.column_stack([random.uniform(0.1, 19.9, 500), random.uniform(-0.1, 3.1, 500)])
    feet = project(lines, xy, 0.1)
    distance = np.abs(xy[:, 1][:, None] - np.array([0.0, 0.15, 3.0]))
    expected = np.flatnonzero(distance.min(axis=1) <= 0.1)
    assert sorted(feet.point) == expected.tolist()
    # Where two lines are about equally near, either may be chosen.
    clear = np.abs(distance[feet.point, 0] - distance[feet.point, 1]) > 0.02
    np.testing.assert_array_equal(feet.line[clear], distance.argmin(axis=1)[feet.point][clear])
    for number in range(3):
        mine = feet.of(number)
        assert np.all(mine.line == number)
        assert np.all(np.diff(mine.t) >= 0)


def test_normals_point_to_the_left():
    line = Polyline(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]))
    np.testing.assert_allclose(line.normals, [[0, 1]] * 3)
    np.testing.assert_allclose(line.left_at(np.array([0.5])), [[0, 1]])


@pytest.mark.parametrize(
    ("step", "turned"),
    [
        ((10, 0), False),
        ((-10, 0), True),
        ((10, -9), False),
        ((-0.1, 10), False),
        ((0.1, -10), True),
        ((-0.2, 10), True),
        ((0.2, -10), False),
    ],
)
def test_lines_start_in_the_west_or_in_the_south_if_they_run_north(step, turned):
    assert Polyline(np.array([[5.0, 5.0], np.add([5.0, 5.0], step)])).starts_at_its_end is turned


def test_a_ring_is_closed_and_a_short_line_is_not():
    ring = arc(25.0, 50.0 * np.pi)
    assert Polyline(ring).is_closed and not Polyline(ring[:-1]).is_closed
    assert not Polyline(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]])).is_closed


def test_a_line_is_met_a_chord_past_its_end_and_no_farther():
    chords = Chords.of([Polyline(np.array([[0.0, 0.0], [10.0, 0.0]]))], 0.1)
    stations = np.array([[9.95, -1.5], [10.05, -1.5], [10.15, -1.5]])
    _, xyz, t = chords.meet(stations, np.tile([0.0, 1.0], (3, 1)), 1.5, 0.2)
    np.testing.assert_allclose(t, [9.95, 10.05, np.nan], atol=1e-9)
    assert np.isnan(xyz[2]).all()


def test_only_vertices_and_given_chainages_go_to_other_processes():
    line = Polyline(winding(1), np.arange(40.0))
    before = len(pickle.dumps(line))
    line.feet(line.xy, 0.1)
    assert len(pickle.dumps(line)) == before
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(line)).t, line.t)
