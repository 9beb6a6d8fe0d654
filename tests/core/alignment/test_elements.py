"""Design elements: exact curves, drawing, feet."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.alignment.elements import Alignment, VerticalElement, chained
from rail_extract.core.frame import LocalFrame

FRAME = LocalFrame(np.zeros(3))
CHAIN = [(80.0, 0, 0), (60.0, 0.0, 1 / 400), (90.0, 1 / 400, 1 / 400), (70.0, 1 / 400, -1 / 300), (40.0, 0.01, 0.01)]


def alignment(shapes=CHAIN, heading=0.4, vertical=(), cant=()):
    return Alignment(1, FRAME, chained((10.0, 20.0), heading, shapes), tuple(vertical), tuple(cant))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_direction_and_curvature_are_the_derivatives_of_the_places(seed):
    random = np.random.default_rng(seed)
    shapes = [(random.uniform(5, 200), *random.uniform(-0.006, 0.006, 2)) for _ in range(6)]
    design, step = alignment(shapes, random.uniform(-4, 4)), 1e-3
    s = random.uniform(1, design.s_to - 1, 40)
    s = s[[min(abs(x - one.s_to) for one in design.plan) > 2 * step for x in s]]
    moved = (design.places(s + step) - design.places(s - step)) / (2 * step)
    heading = design.headings(s)
    np.testing.assert_allclose(moved, np.column_stack([np.cos(heading), np.sin(heading)]), atol=1e-8)
    turned = (design.headings(s + step) - design.headings(s - step)) / (2 * step)
    np.testing.assert_allclose(turned, design.curvatures(s), atol=1e-9)


def test_heights_and_gradients_follow_grades_and_parabolas():
    design = alignment(vertical=[VerticalElement(0, 100, 5, 0.01, 0.01), VerticalElement(100, 200, 6, 0.01, -0.01)])
    np.testing.assert_allclose(design.heights(np.array([0.0, 50, 100, 200, 300])), [5, 5.5, 6, 6.5, 6])
    np.testing.assert_allclose(design.grades(np.array([0.0, 150, 200, 250])), [0.01, 0.005, 0, -0.005])
    assert design.vertical[1].curvature == pytest.approx(-1 / 10_000)
    assert np.isnan(alignment().heights(np.array([1.0]))).all()


def test_drawn_curves_are_less_than_a_millimetre_off():
    design = alignment(vertical=[VerticalElement(0, 340, 5, 0.02, -0.02)])
    stations = design.stations(30.0, 330.0)
    assert (stations[0], stations[-1]) == (30.0, 330.0)
    for joint in (80.0, 140.0, 230.0, 300.0):
        assert np.abs(stations - joint).min() < 1e-9
    exact = design.xyz(0.5 * (stations[:-1] + stations[1:]))
    drawn = design.drawn(30.0, 330.0)
    off = np.linalg.norm(exact - 0.5 * (drawn[:-1] + drawn[1:]), axis=1)
    assert 0.0005 < off.max() < 0.001


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_the_foot_of_a_point_beside_the_curve_is_where_it_was_set_off(seed):
    random, design = np.random.default_rng(seed), alignment()
    s, across = random.uniform(0, design.s_to, 30), random.uniform(-20, 20, 30)
    heading = design.headings(s)
    xy = design.places(s) + across[:, None] * np.column_stack([-np.sin(heading), np.cos(heading)])
    foot = design.foot(xy)
    np.testing.assert_allclose(foot.s, s, atol=1e-6)
    np.testing.assert_allclose(foot.across_m, across, atol=1e-6)
    assert not foot.past_m.any()


def test_points_past_the_ends_say_how_far():
    design = alignment([(50.0, 0.0, 0.0)], heading=0.0)
    foot = design.foot(np.array([[7.0, 21.0], [30.0, 19.0], [64.0, 20.0]]))
    np.testing.assert_allclose(foot.s, [0, 20, 50])
    np.testing.assert_allclose(foot.across_m, [1, -1, 0], atol=1e-12)
    np.testing.assert_allclose(foot.past_m, [-3, 0, 4])
