"""Axes from M values, a first kilometre or posts; places beside them, where circles and straights tell them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.kilometres.axes import AxisLine, AxisStart, KilometreLine, Post, locate, make_axes
from rail_extract.core.kilometres.stationing import Jump, stationing_of
from rail_extract.core.kilometres.text import HECTOMETRES
from rail_extract.core.polyline import length_along

RADIUS_M = 500.0


def line(*x, m=None, name="", y=0.0):
    xy = np.column_stack([x, np.full(len(x), y)]).astype(float)
    return AxisLine(name, xy, np.full(len(x), np.nan) if m is None else np.array(m, float))


def post(x, km, y=3.0):
    return Post(np.array([x, y], float), km)


def kilometres(axes, *x, y=1.0):
    found = locate(axes.axes, np.array([(one, y) for one in x], float), HECTOMETRES)
    return np.round(found.km, 6).tolist(), list(found.side)


@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_m_values_in_kilometres_or_metres(unit):
    axes = make_axes([line(0, 400, 1000, m=np.array([3.0, 3.4, 4.0]) * unit)])
    assert kilometres(axes, 0, 250, 1000) == ([3.0, 3.25, 4.0], ["left"] * 3)


def test_decreasing_m_values_turn_the_axis():
    axes = make_axes([line(0, 1000, m=[4.0, 3.0])])
    assert kilometres(axes, 0, 250) == ([4.0, 3.75], ["right"] * 2)


def test_a_repeated_vertex_with_another_m_value_is_a_jump():
    axes = make_axes([line(0, 500, 500, 1000, m=[3.0, 3.5, 3.7, 4.2])])
    assert kilometres(axes, 499, 501)[0] == [3.499, 3.701]
    assert axes.axes[0].stationing.jumps == [(500.0, Jump(3.5, 3.7))]


def test_a_first_kilometre_with_either_direction():
    assert kilometres(make_axes([line(0, 1000)], AxisStart(7.0)), 100) == ([7.1], ["left"])
    assert kilometres(make_axes([line(0, 1000)], AxisStart(7.0, decreasing=True)), 100) == ([6.9], ["right"])
    assert kilometres(make_axes([line(0, 1000, m=[1.0, 2.0])], AxisStart(7.0)), 100)[0] == [7.1]


def test_lines_of_one_axis_that_follow_each_other_are_joined():
    axes = make_axes([line(400, 1000), line(0, 150), line(150, 400)], AxisStart(7.0))
    assert len(axes.axes) == 1
    assert kilometres(axes, 50, 300, 900)[0] == [7.05, 7.3, 7.9]


def test_posts_on_either_side_and_in_either_direction():
    posts = [post(300, 12.2), post(200, 12.1, -4), post(201, 12.1), post(100, 12.0), post(500, 12.3, 70)]
    axes = make_axes([line(0, 600)], posts=posts)
    assert axes.notices == ("1 of 5 posts are more than 50 m from AXIS: left out.",)
    assert kilometres(axes, 100, 200.5, 300, 400)[0] == [12.0, 12.1, 12.2, 12.3]
    posts = [post(100, 12.2), post(200, 12.1), post(300, 12.0)]
    assert kilometres(make_axes([line(0, 600)], posts=posts), 150, 400) == ([12.15, 11.9], ["right"] * 2)


def test_each_of_two_axes_has_its_own_posts():
    posts = [post(0, 1.0), post(100, 1.1), post(0, 9.1, 500), post(100, 9.0, 500)]
    axes = make_axes([line(0, 200, name="A"), line(0, 200, name="B", y=497.0)], posts=posts)
    assert kilometres(axes, 50)[0] == [1.05]
    assert kilometres(axes, 50, y=498.0) == ([9.05], ["right"])


def axis_of(xy, start_km=0.0, name="A"):
    xy = np.asarray(xy, float)
    return KilometreLine(name, xy, stationing_of(float(length_along(xy)[-1]), [0.0], [start_km]))


def on_circle(angle, left_m=0.0):
    """Places beside a left-hand circle that starts at the origin, eastward."""
    r = RADIUS_M - left_m
    return np.column_stack([r * np.sin(angle), RADIUS_M - r * np.cos(angle)])


def circle(step_m=1.0, turn=1.5):
    return axis_of(on_circle(np.arange(0, turn + 1e-9, step_m / RADIUS_M)))


@pytest.mark.parametrize("left_m", [-80.0, -4.0, 0.0, 4.0, 300.0])
@pytest.mark.parametrize("step_m", [1.0, 10.0])
def test_places_beside_a_circle_have_the_kilometre_of_their_angle(step_m, left_m):
    angle = np.linspace(0.03, 1.47, 200)
    found = locate([circle(step_m)], on_circle(angle, left_m), HECTOMETRES)
    sagitta_m = step_m**2 / 8 / RADIUS_M
    np.testing.assert_allclose(
        1000 * found.km, RADIUS_M * angle, atol=1.5 * RADIUS_M * (step_m / RADIUS_M) ** 2 / 24 + 0.002
    )
    np.testing.assert_allclose(found.offset_m, left_m, atol=sagitta_m + 1e-6)
    assert set(found.side) == (
        {"on", "right", "left"} & set(found.side) if left_m == 0 else {["right", "left"][left_m > 0]}
    )
    assert not found.ambiguous.any()


@given(st.lists(st.floats(-60, 60), min_size=2, max_size=12), st.floats(-30, 30))
def test_feet_move_steadily_along_bends(turns_deg, left_m):
    """Along a parallel line outside the bends the kilometre never stands still, and inside it never turns back."""
    heading = np.radians(np.cumsum(turns_deg) / 4)
    xy = np.vstack([[0, 0], np.cumsum(40 * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)])
    axis = axis_of(xy)
    share = np.linspace(0.02, 0.98, 400) * (len(xy) - 1)
    inner = share.astype(int)
    base = xy[inner] + (share - inner)[:, None] * np.diff(xy, axis=0)[inner]
    normals = (
        axis.line.normals[inner] * (1 - share + inner)[:, None]
        + axis.line.normals[inner + 1] * (share - inner)[:, None]
    )
    feet = axis.feet(base + 0.5 * left_m * normals)
    expected = axis.line.t[inner] + (share - inner) * 40
    np.testing.assert_allclose(feet.s, expected, atol=1e-5)


@pytest.mark.parametrize("beyond_m", [0.5, 1.5])
def test_places_beyond_an_end_have_no_kilometre(beyond_m):
    axis = axis_of([[0, 0], [100, 0]], start_km=7.0)
    found = locate([axis], np.array([[100.0 + beyond_m, 3.0], [-beyond_m, 3.0]]), HECTOMETRES)
    if beyond_m < 1:
        np.testing.assert_allclose(found.km, [7.1, 7.0])
        np.testing.assert_allclose(found.offset_m, 3.0)
    else:
        assert np.isnan(found.km).all()
        assert found.axis.tolist() == found.piece.tolist() == found.side.tolist() == [None, None]


def test_a_place_between_two_arms_of_a_hairpin_is_ambiguous():
    """The arms are 100 m apart."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 60)
    bend = np.column_stack([300 + 50 * np.cos(angle), 50 + 50 * np.sin(angle)])
    axis = axis_of(np.vstack([[[0.0, 0.0]], bend, [[0.0, 100.0]]]))
    found = locate([axis], np.array([[100.0, 48.0], [100.0, 40.0], [100.0, 10.0], [300.0, 50.0]]), HECTOMETRES)
    assert found.ambiguous.tolist() == [True, False, False, True]
    np.testing.assert_allclose(found.km[:3], 0.1, atol=1e-5)


def test_on_a_ring_kilometres_run_once_round_and_either_end_is_meant_where_it_closes():
    angle = np.linspace(0, 2 * np.pi, 2001)
    axis = axis_of(on_circle(angle), 1.0)
    found = locate([axis], on_circle(np.array([0.5 * np.pi, 1.5 * np.pi, 0.001]), 2.0), HECTOMETRES)
    np.testing.assert_allclose(found.km[:2], 1 + axis.line.length_m / 1000 * np.array([0.25, 0.75]), atol=2e-5)
    assert found.ambiguous.tolist() == [False, False, True]


def test_the_nearest_of_two_axes_counts():
    axes = [axis_of([[0, 0], [1000, 0]], 1.0, "north"), axis_of([[1000, -100], [0, -100]], 5.0, "south")]
    found = locate(axes, np.array([[300.0, -20.0], [300.0, -90.0], [300.0, -50.0]]), HECTOMETRES)
    assert found.axis.tolist()[:2] == ["north", "south"]
    np.testing.assert_allclose(found.km[:2], [1.3, 5.7])
    np.testing.assert_allclose(found.offset_m[:2], [-20.0, -10.0])
    assert found.ambiguous.tolist() == [False, False, True]


def test_a_reversed_axis_has_the_other_side():
    xy = on_circle(np.linspace(0, 1, 500))
    place = on_circle(np.array([0.4]), 5.0)
    there, back = (locate([axis_of(line)], place, HECTOMETRES) for line in (xy, xy[::-1]))
    assert there.km[0] + back.km[0] == pytest.approx(length_along(xy)[-1] / 1000, abs=1e-6)
    assert there.offset_m[0] == pytest.approx(-back.offset_m[0], abs=1e-9)
    assert (there.side[0], back.side[0]) == ("left", "right")


NETWORK = st.lists(
    st.tuples(st.floats(-400, 400), st.floats(-400, 400), st.floats(0, 6), st.floats(10, 300)), min_size=1, max_size=9
)


@given(NETWORK, st.integers(0, 2**31))
def test_each_place_belongs_to_the_nearest_of_many_axes(network, seed):
    """The bounding boxes that leave out axes change nothing: the offset is the least of those along single axes."""
    axes = [
        axis_of(
            [(x, y), (x + reach * np.cos(turn), y + reach * np.sin(turn)), (x + reach, y + reach)], name=str(number)
        )
        for number, (x, y, turn, reach) in enumerate(network)
    ]
    places = np.random.default_rng(seed).uniform(-600, 600, (40, 2))
    found = locate(axes, places, HECTOMETRES)
    alone = np.abs([locate([axis], places, HECTOMETRES).offset_m for axis in axes])
    least = np.where(np.isnan(alone).all(axis=0), np.nan, np.nanmin(np.where(np.isnan(alone), np.inf, alone), axis=0))
    np.testing.assert_allclose(np.abs(found.offset_m), least, atol=1e-6)
    for number in {int(name) for name in found.axis if name}:
        mine = np.array(found.axis) == str(number)
        np.testing.assert_allclose(found.km[mine], locate([axes[number]], places[mine], HECTOMETRES).km, atol=1e-9)
