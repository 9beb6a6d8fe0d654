"""Curves of parallel tracks: what one lacks is taken from the other, at its distance, whichever way it runs."""

import numpy as np
import pytest
from rail_extract.core.airborne.ridges import RidgeFit, Sections
from rail_extract.core.airborne.rounds import differences, draw_together, smooth
from rail_extract.core.polyline import Polyline

LENGTH_M, RADIUS_M, APART_M, NOISE_M = 400.0, 450.0, 4.0, 0.06


def arc(left_m, backwards=False):
    t = np.arange(0.0, LENGTH_M)
    radius = RADIUS_M - left_m
    xy = radius * np.column_stack([np.sin(t / RADIUS_M), -np.cos(t / RADIUS_M)])
    return Polyline(xy[::-1] if backwards else xy, t)


def sections(seed, hidden=(), noise_m=NOISE_M):
    count = int(LENGTH_M / 10)
    offset = np.random.RandomState(seed).normal(0, noise_m, count)
    shows = np.ones(count, dtype=bool)
    shows[list(hidden)] = False
    nothing = np.zeros(count)
    return Sections(offset, np.full(count, noise_m), RidgeFit(*[nothing] * 7), nothing, shows)


def errors(line, found, curve):
    t = found.stations_on(line)
    return ((curve.xy - line.at(t)) * line.left_at(t)).sum(axis=1)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("backwards", [False, True])
def test_two_tracks_are_better_than_one(backwards):
    alone, joint, sigma = [], [], []
    for seed in range(20):
        lines = [arc(0.0), arc(APART_M, backwards)]
        found = [sections(seed), sections(seed + 100)]
        for number, curve in enumerate(draw_together(lines, found)):
            joint.append(errors(lines[number], found[number], curve))
            sigma.append(curve.sigma)
            alone.append(errors(lines[number], found[number], draw_together([lines[number]], [found[number]])[0]))
    assert rms(joint) < 0.9 * rms(alone)  # the mean of two has 0.71 times the error, their distance more
    assert rms(np.divide(joint, sigma)) == pytest.approx(1.0, abs=0.25)


def test_a_hidden_part_follows_the_other_track():
    lines, hidden = [arc(0.0), arc(APART_M)], range(12, 28)
    found = [sections(1, hidden, 0.01), sections(2, (), 0.01)]
    curve = draw_together(lines, found)[0]
    assert np.abs(errors(lines[0], found[0], curve)).max() < 0.06
    alone = draw_together(lines[:1], found[:1])[0]
    assert curve.sigma[20] < 0.5 * alone.sigma[20]


def test_tracks_that_part_do_not_pull_each_other():
    t = np.arange(0.0, LENGTH_M)
    leaving = np.maximum(t - 150, 0) ** 2 / (2 * 300.0)
    lines = [Polyline(np.column_stack([t, 0 * t]), t), Polyline(np.column_stack([t, APART_M + leaving]), t)]
    found = [sections(1, (), 0.01), sections(2, (), 0.01)]
    for line, one, curve in zip(lines, found, draw_together(lines, found)):
        assert np.abs(errors(line, one, curve)).max() < 0.04


def test_curve_and_covariance_are_those_of_the_full_matrix():
    rng = np.random.RandomState(1)
    values, weight = rng.normal(size=(150, 2)), rng.uniform(0, 100, 150)
    weight[40:50] = 0
    for order in (2, 3):
        found = smooth(values, weight, differences(150, order), 0.05)
        difference = np.diff(np.eye(150), order, axis=0)
        matrix = np.diag(weight) + difference.T @ difference / 0.05**2
        inverse = np.linalg.inv(matrix)
        assert np.allclose(found.values, inverse @ (weight[:, None] * values), atol=1e-6)
        assert np.allclose(found.variance, np.diag(inverse), rtol=1e-6)
        squares = ((difference @ found.values) ** 2).sum(axis=1)
        assert np.allclose(found.bend - squares, np.diag(difference @ inverse @ difference.T), rtol=1e-5)
