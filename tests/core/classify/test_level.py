"""Passes of the scanner, moved onto one level."""

import numpy as np
import pytest
from rail_extract.core.classify.level import on_one_level

APART_M = 0.025


def two_passes(scatter_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Make a surface of 10 m x 10 m on a slope, half of whose points are of a higher pass: (n, 3) points, passes."""
    rng = np.random.RandomState(4)
    xy, passes = rng.uniform(0.0, 10.0, (20_000, 2)), rng.randint(1, 3, 20_000)
    z = 300.0 + 0.01 * xy[:, 0] + rng.normal(0.0, scatter_m, len(xy)) + APART_M * (passes == 2)
    return np.column_stack([xy, z]), passes


def apart_m(xyz: np.ndarray, passes: np.ndarray) -> float:
    above = xyz[:, 2] - 0.01 * xyz[:, 0]
    return float(above[passes == 2].mean() - above[passes == 1].mean())


def test_passes_of_a_pavement_meet_on_their_mean():
    xyz, passes = two_passes(0.003)
    level = on_one_level(xyz, passes)
    assert apart_m(level, passes) == pytest.approx(0.0, abs=0.0005)
    assert level[:, 2].mean() == pytest.approx(xyz[:, 2].mean(), abs=0.0005)
    assert np.array_equal(level[:, :2], xyz[:, :2])


def test_ballast_and_what_one_pass_shows_stay():
    xyz, passes = two_passes(0.015)
    assert np.array_equal(on_one_level(xyz, passes), xyz)
    smooth, _ = two_passes(0.003)
    assert np.array_equal(on_one_level(smooth, np.ones(len(smooth))), smooth)


def test_passes_that_share_a_strip_only_stay():
    xyz, passes = two_passes(0.003)
    shown = (passes == 1) == (xyz[:, 0] < 5.0)
    shown |= (xyz[:, 0] > 5.0) & (xyz[:, 0] < 5.4)
    xyz, passes = xyz[shown], passes[shown]
    assert np.array_equal(on_one_level(xyz, passes), xyz)
