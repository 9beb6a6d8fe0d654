"""Courses: arcs are continued, and smoothing keeps them; and the rail under a seed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from rail_extract.core.grow.heads import DENSE, THIN, GrowSettings
from rail_extract.core.grow.start import find_start, lead, smoothed
from rail_extract.laboratory.ruler.whole_clouds import GrowingCloud
from rail_extract.laboratory.scenes.raw_shapes import MIDDLE, TOP_M, flat, rough, with_bar
from rail_extract.laboratory.scenes.raw_strips import GAUGE_M, SPACING_M, WIDTH_M, strip


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


def started(xyz, seed):
    settings = GrowSettings(GAUGE_M, WIDTH_M)
    return find_start(GrowingCloud(xyz, settings).heads, seed, settings)


@pytest.mark.parametrize(("rail", "off"), [(1, 0.0), (1, 0.12), (-1, -0.12), (-1, 0.2)])
def test_the_nearest_rail_is_found(rail, off):
    track = strip(12.0)
    start = started(track.xyz, track.at(6.0, rail * SPACING_M / 2 + off))
    assert start.xyz[:, 1] == pytest.approx(rail * SPACING_M / 2, abs=0.006)
    assert start.xyz[:, 2] == pytest.approx(TOP_M, abs=0.003)
    assert abs(start.heading[1]) < 0.005
    assert start.side * np.sign(start.heading[0]) == -rail
    assert start.level_m == pytest.approx(0.0, abs=0.005)
    assert start.beam is DENSE


def test_a_sharp_curve_is_found():
    track = strip(12.0, 1 / 25)
    start = started(track.xyz, track.at(6.0, SPACING_M / 2))
    assert np.hypot(*(start.xyz[:, :2] - [0, 25]).T) == pytest.approx(25 - SPACING_M / 2, abs=0.025)


def test_a_thin_cloud_is_known_as_such():
    track = strip(16.0, per_m2=150, noise_m=0.01)
    start = started(track.xyz, track.at(8.0, SPACING_M / 2))
    assert start.beam == THIN
    assert start.xyz[:, 1] == pytest.approx(SPACING_M / 2, abs=0.03)


@pytest.mark.parametrize("left", [0.0, 1.3])
def test_between_the_rails_there_is_none(left):
    track = strip(12.0)
    assert started(track.xyz, track.at(6.0, left)) is None


def test_outside_of_the_cloud_there_is_none():
    assert started(strip(6.0).xyz, np.array([100.0, 0.0])) is None


def test_a_single_rail_has_no_side():
    track = strip(14.0, rails=[lambda s: np.full_like(s, 0.3)])
    start = started(track.xyz, track.at(7.0, 0.3))
    assert start.side == 0


@pytest.mark.parametrize("edge", [1, -1])
def test_the_edge_of_a_trough_is_not_a_rail_though_one_lies_at_the_gauge(edge):
    rng = np.random.RandomState(3)
    xyz, _ = with_bar(flat(12.0, rng=rng, per_m2=2000), WIDTH_M, 0.3, SPACING_M)
    xyz, _ = with_bar(xyz, 0.34, 0.3, -edge * (0.34 - WIDTH_M) / 2)
    xyz = rough(xyz, rng)
    turn = np.array([-np.sin(0.3), np.cos(0.3)])
    assert started(xyz, MIDDLE) is None
    assert started(xyz, MIDDLE + SPACING_M * turn).xyz[2, 2] == pytest.approx(TOP_M, abs=0.01)
