"""The width of what was found, by the points on it."""

import numpy as np
import pytest
from rail_extract.core.classify.labels import Near
from rail_extract.core.classify.lines import Lines

WIDTH = 0.072


def line(length_m=10.0, left_m=0.0):
    """Cells, 8 cm apart, of a line to the east: half of their directions point to the west."""
    along = np.arange(0.0, length_m, 0.08)
    turn = np.where(np.arange(len(along)) % 2, 0.01, np.pi - 0.01)
    ones = np.ones(len(along))
    return Lines(np.column_stack([along, left_m * ones]), 0.15 * ones, turn, ones, ones, 1.0)


def width_of(lines, across, rng):
    along = rng.uniform(0.0, 10.0, len(across))
    beside = Near.find(np.column_stack([along, across]), lines)
    return float(beside.widths(lines, np.zeros(len(lines.axis), dtype=int))[0])


def faces(rng, share=0.45, count=3000):
    """Places on a head that is seen from far on both sides: on the faces, and a point here and there on the crown."""
    side, on_face = rng.choice([-1, 1], count), rng.random_sample(count) < 2 * share
    return np.where(on_face, side * WIDTH / 2, rng.uniform(-WIDTH / 2, WIDTH / 2, count)) + rng.normal(0, 0.002, count)


def test_a_head_of_which_both_faces_are_seen_is_as_wide_as_one_of_which_all_is():
    rng = np.random.RandomState(1)
    even = width_of(line(), rng.uniform(-WIDTH / 2, WIDTH / 2, 3000), rng)
    assert even == pytest.approx(WIDTH, abs=0.004)
    assert width_of(line(), faces(rng), rng) < WIDTH + 0.016  # scatter makes it 48 mm wider


def test_what_the_axis_is_off_does_not_widen_a_head():
    """Where one face is seen, the axis may be beside it: lines have no direction that tells the side."""
    rng = np.random.RandomState(2)
    face = -WIDTH / 2 + np.abs(rng.normal(0, 0.006, 3000))
    assert width_of(line(left_m=-0.01), face, rng) == pytest.approx(width_of(line(left_m=-0.03), face, rng), abs=0.003)


def test_a_kerb_is_wide_also_where_few_points_show_it():
    rng = np.random.RandomState(3)
    for count in (100, 3000):
        assert width_of(line(), rng.uniform(-0.075, 0.075, count), rng) > 0.12
