"""Courses: arcs are continued, and smoothing keeps them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from rail_extract.core.grow.course import lead, smoothed
from rail_extract.core.grow.settings import DENSE


def arc(radius, places):
    angle = places / radius
    return np.column_stack([radius * np.sin(angle), radius * (1 - np.cos(angle)), 0.02 * places])


@given(turn=some.floats(0, 6.28), radius=some.sampled_from([-1e6, -300.0, 25.0, 20.0]))
@settings(max_examples=20, deadline=None)
def test_an_arc_is_continued_in_any_direction(turn, radius):
    places = np.arange(0.0, 5.1, 0.5)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    xyz = arc(radius, places)
    xyz[:, :2] = xyz[:, :2] @ rotation.T
    end = rotation @ [np.cos(4.5 / radius), np.sin(4.5 / radius)]
    ahead = lead(xyz, 0.5, end, DENSE)
    true = arc(radius, np.array([5.5]))[0]
    assert np.hypot(*(ahead.xy - rotation @ true[:2])) < 0.004
    assert ahead.z == pytest.approx(true[2], abs=1e-4)
    assert ahead.curvature == pytest.approx(1 / radius, abs=2e-3)
    assert ahead.heading @ (rotation @ [np.cos(5.5 / radius), np.sin(5.5 / radius)]) > 0.9999


def test_smoothing_averages_noise_and_keeps_arcs():
    along = np.arange(0.0, 20.0, 0.5)
    true = arc(30.0, along)
    rng = np.random.RandomState(1)
    noisy = true + rng.normal(0, 0.003, true.shape)
    seen = np.ones(len(along), bool)
    assert smoothed(true, along, 1.5, seen) == pytest.approx(true, abs=5e-4)
    inner = slice(4, -4)
    assert np.std((smoothed(noisy, along, 1.5, seen) - true)[inner]) < 0.7 * np.std((noisy - true)[inner])
