"""Courses: the best sum of evidence, less turns, and how far above the second best."""

import numpy as np
from rail_extract.core.airborne.corridor import SECTION_M
from rail_extract.core.airborne.course import SLOPES, Evidence, guide_prior, slopes, trace

ACROSS = np.arange(-60, 61) * 0.05


def peaks(across_m, height=10.0, width_m=0.1):
    return height * np.exp(-0.5 * ((ACROSS - np.asarray(across_m)[:, None]) / width_m) ** 2)


def evidence(*scores):
    return Evidence(ACROSS, np.repeat(sum(scores)[:, None, :], SLOPES, axis=1))


def test_a_slanting_course_is_followed():
    true = 0.04 * SECTION_M * np.arange(12) - 1.0
    found = trace(evidence(peaks(true)), guide_prior(ACROSS, 12))
    assert np.abs(found.across - true).max() <= 0.051
    assert (found.margin > 15).all()


def test_a_gap_is_crossed_and_a_lone_peak_is_not_followed():
    true = np.full(12, 0.5)
    score = peaks(true)
    score[5] = 15 * np.exp(-0.5 * ((ACROSS + 2.0) / 0.1) ** 2)
    found = trace(evidence(score), guide_prior(ACROSS, 12))
    assert np.abs(found.across - 0.5).max() <= 0.1


def test_the_guide_decides_between_equal_tracks():
    near, far = np.full(10, 0.6), np.full(10, -2.4)
    found = trace(evidence(peaks(near), peaks(far)), guide_prior(ACROSS, 10))
    assert np.abs(found.across - 0.6).max() <= 0.051
    assert 0 < found.margin.min() < 20


def test_directions_are_symmetric():
    assert np.allclose(slopes(), -slopes()[::-1])
