"""Axes from M values, from a first kilometre and from posts, and what does not make one."""

import numpy as np
import pytest
from rail_extract.core.kilometres.axes import AxisLine, AxisStart, Post, make_axes
from rail_extract.core.kilometres.line import locate
from rail_extract.core.kilometres.stationing import Jump
from rail_extract.core.kilometres.text import HECTOMETRES


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
