"""Smoothing of lines, profiles and networks."""

import numpy as np
import pytest
from built import check_meeting
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.legendre import leggauss
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.lines.smoothing import (
    END_SHIFT,
    VARIANCE_FACTOR,
    bend_through,
    smooth_line,
    smooth_network,
    smooth_profile,
)
from rail_extract.core.polyline import length_along

SIGMA = 0.8


def random_line(seed, count=30, dimensions=2):
    random = np.random.default_rng(seed)
    steps = random.normal(size=(count - 1, dimensions)) * 0.3
    steps[:, 0] += 0.5
    return np.concatenate([np.zeros((1, dimensions)), np.cumsum(steps, axis=0)])


def fit_by_quadrature(vertices, station, sigma):
    t = length_along(vertices)
    knots = np.union1d(t, [station])
    nodes, weights = leggauss(24)
    middle, half = (knots[1:] + knots[:-1]) / 2, np.diff(knots) / 2
    at = (middle[:, None] + half[:, None] * nodes).ravel()
    weight = (half[:, None] * weights).ravel() * np.exp(-np.abs(at - station) / sigma)
    values = np.column_stack([np.interp(at, t, column) for column in vertices.T])
    powers = np.vander(at - station, 3, increasing=True)
    return np.linalg.solve(powers.T @ (weight[:, None] * powers), powers.T @ (weight[:, None] * values))[0]


def gain(wavelength, sigma):
    x = 2 * np.pi * sigma / wavelength
    return (1 + 3 * x**2 + 1.2 * x**4) / (1 + x**2) ** 3


def circle(radius, count):
    angle = np.linspace(0, 2 * np.pi, count + 1)
    line = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    line[-1] = line[0]
    return line


@pytest.mark.parametrize("sigma", [0.2, 0.8, 5.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_equals_quadrature(seed, sigma):
    line = random_line(seed, dimensions=3)
    stations = np.random.default_rng(seed).uniform(0, length_along(line)[-1], 9)
    smoothed = smooth_line(line, sigma, stations, ends="free")
    np.testing.assert_allclose(smoothed, [fit_by_quadrature(line, s, sigma) for s in stations], atol=1e-11)


@pytest.mark.parametrize("wavelength", [1.86, 4.93, 10.9, 40.0])
def test_waves_are_damped_by_the_transfer_function(wavelength):
    t = np.arange(0, 160, 0.01)
    stations = np.linspace(70, 90, 401)
    wave = np.sin(2 * np.pi * stations / (wavelength * SIGMA))
    smoothed = smooth_profile(t, np.sin(2 * np.pi * t / (wavelength * SIGMA)), SIGMA, stations)
    assert smoothed @ wave / (wave @ wave) == pytest.approx(gain(wavelength * SIGMA, SIGMA), abs=1e-4)


@pytest.mark.parametrize(("radius", "sigma"), [(25, 0.8), (190, 5.0)])
def test_closed_circles_shrink_as_predicted(radius, sigma):
    smoothed = smooth_line(circle(radius, 40_000), sigma, closed=True)
    shrunk = radius - np.hypot(*smoothed.T)
    np.testing.assert_allclose(shrunk, 1.8 * sigma**4 / radius**3, rtol=0.02, atol=2e-6)
    np.testing.assert_allclose(smoothed[0], smoothed[-1], atol=1e-9)


def test_a_closed_line_may_start_anywhere():
    line = circle(3, 60) + 0.05 * np.random.default_rng(0).normal(size=(61, 2))
    line[-1] = line[0]
    shifted = np.concatenate([line[20:], line[1:21]])
    t, shifted_t = length_along(line), length_along(shifted)
    smoothed = smooth_line(line, SIGMA, t, closed=True)
    np.testing.assert_allclose(smooth_line(shifted, SIGMA, shifted_t, closed=True)[:41], smoothed[20:], atol=1e-9)


@given(st.integers(0, 10**6), st.sampled_from(["fixed", "free"]))
@settings(max_examples=25, deadline=None)
def test_a_reversed_line_is_smoothed_alike(seed, ends):
    line = random_line(seed, count=12)
    there = smooth_line(line, SIGMA, length_along(line), ends=ends)
    back = smooth_line(line[::-1], SIGMA, length_along(line[::-1]), ends=ends)
    np.testing.assert_allclose(back[::-1], there, atol=1e-9)


def test_profile_averages_equal_stations_and_takes_any_order():
    t, z = np.array([0.0, 1.0, 1.0, 2.0, 3.0]), np.array([0.0, 0.8, 1.2, 2.0, 3.0])
    stations = np.linspace(0, 3, 7)
    np.testing.assert_allclose(smooth_profile(t, z, 1.0, stations), stations, atol=1e-9)
    np.testing.assert_allclose(smooth_profile(t[::-1], z[::-1], 1.0, stations), stations, atol=1e-9)


def test_profile_is_straight_across_a_long_gap_and_level_beyond_its_ends():
    t = np.concatenate([np.linspace(0, 10, 101), np.linspace(20, 30, 101)])
    z = np.where(t < 15, 1.0, 3.0)
    smoothed = smooth_profile(t, z, 3.0, np.array([-5.0, 5, 10, 15, 20, 25, 40]))
    np.testing.assert_allclose(smoothed, [1, 1, 1, 2, 3, 3, 3], atol=1e-9)


def test_a_profile_does_not_depend_on_density():
    t = np.concatenate([np.arange(0, 20, 0.01), np.arange(20, 40, 0.1)])
    stations = np.linspace(13, 27, 31)
    smoothed = smooth_profile(t, np.sin(t / 4), 1.0, stations)
    np.testing.assert_allclose(smoothed, np.sin(stations / 4) * gain(8 * np.pi, 1.0), atol=1e-4)


def test_noise_is_reduced_by_the_variance_factor():
    """A single displaced vertex shows the weights, whose squares add up to the variance."""
    spacing = 0.1
    t = np.arange(0, 60, spacing)
    line = np.column_stack([t, np.where(np.arange(len(t)) == 300, 1.0, 0.0)])
    weights = smooth_profile(t, line[:, 1], SIGMA, t)
    assert np.sum(weights**2) == pytest.approx(VARIANCE_FACTOR * spacing / SIGMA, rel=0.01)


def test_a_fixed_end_in_an_arc_moves_the_line_by_the_end_shift():
    radius = 190.0
    angle = np.arange(0, 60 / radius, 0.01 / radius)
    arc = radius * np.column_stack([np.sin(angle), 1 - np.cos(angle)])
    smoothed = smooth_line(arc, SIGMA, np.arange(0, 20, 0.02))
    moved = np.abs(np.hypot(smoothed[:, 0], smoothed[:, 1] - radius) - radius).max()
    assert moved == pytest.approx(END_SHIFT * SIGMA**2 / radius, rel=0.03)


def wavy(x, y, seed):
    return np.column_stack([x, y + 0.01 * np.random.default_rng(seed).normal(size=len(x))])


def turnout():
    """A through line whose vertex 200 is the node in which a 1:9 branch begins."""
    x = np.arange(0, 40, 0.1)
    through = wavy(x, 0 * x, 1)
    branch = wavy(x[200:], (x[200:] - x[200]) / 9, 2)
    branch[0] = through[200]
    nodes = np.array([through[0], through[-1], branch[0], branch[-1]])
    return LineNetwork((through, branch), nodes, np.array([[0, 1], [2, 3]]), np.array([[2, 0, 200]]))


def test_lines_of_a_network_still_meet_and_free_ends_stay():
    network = turnout()
    smoothed = smooth_network(network, SIGMA)
    check_meeting(smoothed)
    np.testing.assert_array_equal(smoothed.nodes[[0, 1, 3]], network.nodes[[0, 1, 3]])
    np.testing.assert_array_equal(smoothed.ends, network.ends)


def test_a_loop_in_a_network_is_smoothed_across_its_seam():
    loop = circle(25, 4000)
    smoothed = smooth_network(LineNetwork((loop,), loop[:1], np.array([[0, 0]])), SIGMA)
    np.testing.assert_allclose(np.hypot(*smoothed.lines[0].T), 25, atol=1e-4)
    np.testing.assert_array_equal(smoothed.lines[0][0], smoothed.lines[0][-1])


def test_bending_a_line_equals_one_dense_system():
    rng = np.random.default_rng(5)
    t = np.cumsum(rng.uniform(0.05, 0.2, 4000))
    places = np.sort(rng.choice(len(t), 40, replace=False))
    line, targets = rng.normal(size=(len(t), 2)), rng.normal(size=(40, 2))

    def fading(d):
        return (1 + np.abs(d)) * np.exp(-np.abs(d))

    weights = np.linalg.solve(fading(t[places][:, None] - t[places]), targets - line[places])
    expected = line + fading(t[:, None] - t[places]) @ weights
    bend_through(line, t, places, targets)
    np.testing.assert_allclose(line, expected, atol=1e-9)
