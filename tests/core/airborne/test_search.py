"""Tiles searched without a guide: rails are found with place and direction, furrows and steps are not."""

import numpy as np
import pytest
from rail_extract.core.airborne.ridges import Shape
from rail_extract.core.airborne.search import Finds, search

SPACING_M = 1.507
SHAPE = Shape.expected(SPACING_M, 0.25)


def surface(profile, direction=0.6, left_m=3.0, density=10.0, seed=1):
    """Points in a square of 40 m and its margin, on a slope, with a profile along a line through (20, 20)."""
    rng = np.random.RandomState(seed)
    xy = rng.uniform(-20.0, 60.0, (int(80 * 80 * density), 2))
    across = (xy[:, 1] - 20) * np.cos(direction) - (xy[:, 0] - 20) * np.sin(direction) - left_m
    return np.column_stack([xy, 0.03 * xy[:, 0] + profile(across) + rng.normal(0, 0.03, len(xy))])


def rails(across):
    return SHAPE.height_m * (SHAPE.ridge(across, 1) + SHAPE.ridge(across, -1))


def found(profile, **more):
    return Finds.joined(search(surface(profile, **more), np.zeros(2), 40.0, SHAPE))


@pytest.mark.parametrize("direction", [0.0, 0.6, 1.9, 3.0])
def test_rails_are_found_where_they_are(direction):
    finds = found(rails, direction=direction)
    assert len(finds.xy) >= 2
    step = finds.xy - 20.0
    across = step[:, 1] * np.cos(direction) - step[:, 0] * np.sin(direction) - 3.0
    assert np.abs(across).max() < 0.15
    assert np.abs((finds.direction - direction + np.pi / 2) % np.pi - np.pi / 2).max() < 0.02


@pytest.mark.parametrize(
    "profile",
    [
        pytest.param(lambda across: 0 * across, id="field"),
        pytest.param(lambda across: 0.09 * np.cos(2 * np.pi * across / 0.75), id="furrows"),
        pytest.param(lambda across: 0.12 * (across > 0), id="kerb"),
        pytest.param(lambda across: -0.08 * (np.abs(across) < 0.8), id="sunken path"),
        pytest.param(lambda across: SHAPE.height_m * SHAPE.ridge(across, 1), id="one ridge"),
    ],
)
def test_what_repeats_or_is_half_a_track_is_not_found(profile):
    assert len(found(profile).xy) == 0
