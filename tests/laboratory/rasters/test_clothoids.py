"""Combinations of clothoids between oriented points."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.laboratory.curves import trace
from rail_extract.laboratory.rasters.clothoids import SHARES, UNSOLVED, Pose, join, random_joins, table

ANGLES = st.floats(-1.2, 1.2)


@given(ANGLES, ANGLES, st.floats(1.0, 200.0), st.floats(-3.0, 3.0), st.integers(0, len(SHARES) - 1))
def test_a_combination_reaches_its_end_in_its_direction(first, last, chord, direction, share):
    start = Pose(3.0, -2.0, direction + first)
    end = Pose(3.0 + chord * math.cos(direction), -2.0 + chord * math.sin(direction), direction + last)
    elements = join(start, end, share)
    if elements is None:
        # even the largest shares cannot make two equal quarter turns to the same side
        assert share >= 2
        assert abs(first + last) > 1.5
        return
    step = sum(element.length_m for element in elements) / 2000
    curve = trace(elements, (start.x, start.y), start.heading, step)
    assert np.abs(curve.xy[-1] - [end.x, end.y]).max() < 1e-7 * chord
    assert curve.heading[-1] == pytest.approx(direction + last, abs=1e-9)


def test_the_table_is_solved_everywhere():
    known = table()
    assert known.skew.shape == (len(SHARES), 71, 71)
    assert np.isfinite(known.skew).all()
    centre = known.skew.shape[1] // 2
    assert known.energy[:, centre, centre] == pytest.approx(0.0)
    assert (known.energy > -1e-12).all()
    assert (known.energy == UNSOLVED).mean() < 0.01
    # each has a mirror image: the curve from the other end, and the curve to the other side
    assert known.sharpest[1] == pytest.approx(known.sharpest[1].T)
    assert known.sharpest[1] == pytest.approx(known.sharpest[1][::-1, ::-1])


def test_random_joins_start_and_end_at_poses_and_keep_to_the_radius():
    rng = np.random.default_rng(3)
    poses = [Pose(*rng.uniform(-30, 30, size=2), rng.uniform(-3, 3)) for _ in range(20)]
    joins = random_joins(rng, poses, 4, 25.0)
    assert len(joins) == 4
    places = np.array([[pose.x, pose.y] for pose in poses])
    for start, elements in joins:
        assert all(abs(element.end) < 1 / 25 for element in elements)
        length = sum(element.length_m for element in elements)
        end = trace(elements, (start.x, start.y), start.heading, length / 3000).xy[-1]
        assert np.linalg.norm(places - end, axis=1).min() < 1e-4
