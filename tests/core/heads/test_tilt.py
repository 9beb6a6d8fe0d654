"""The slope across of tracks, from the heights of the rails beside a line."""

import numpy as np
import pytest
from rail_extract.core.heads.axis import Axis
from rail_extract.core.heads.head_points import near_lines
from rail_extract.core.heads.tilt import tilts

WIDTH, LENGTH_M, APART_M, TILT = 0.072, 30.0, 1.5, 0.06


def stations(count=80):
    """Two lines beside each other in opposite directions, the left one higher, and a lone line far away."""
    x, line = 0.25 * np.arange(count), np.repeat([0, 1, 2], count)
    places = np.concatenate([np.column_stack([way, np.full(count, y)]) for way, y in ((x, 0.0), (x, APART_M), (x, 50))])
    normals = np.repeat([[0.0, 1.0], [0.0, -1.0], [0.0, 1.0]], count, axis=0)
    return line, places, normals, np.repeat([100.0, 100.0 + TILT * APART_M, 100.0], count)


def test_a_track_rises_to_the_left_of_one_rail_and_to_the_right_of_the_other_that_runs_back():
    line, *where, level = stations()
    rise = tilts(line, *where, level, 0.25)
    assert rise[line == 0] == pytest.approx(TILT)
    assert rise[line == 1] == pytest.approx(-TILT)
    assert np.isnan(rise[line == 2]).all()


def test_a_rail_whose_height_is_not_known_tells_nothing():
    line, *where, level = stations()
    rise = tilts(line, *where, np.where(line == 1, np.nan, level), 0.25)
    assert np.isnan(rise).all()


def ridge(y, z, seed):
    """Points of a blurred head on a track with cant, in the plane of the track a parabola."""
    rng = np.random.default_rng(seed)
    u = rng.uniform(-0.056, 0.056, 2400)
    v = -5.0 * u**2
    left, up = u - TILT * v, v + TILT * u + rng.normal(0, 0.01, len(u))
    return np.column_stack([np.sort(rng.uniform(0, LENGTH_M, len(u))), y + left, z + up])


def test_cant_does_not_move_the_axis_of_a_blunt_head():
    lines = [np.array([[0.0, y], [LENGTH_M, y]]) for y in (0.0, APART_M)]
    xyz = np.concatenate([ridge(0.0, 100.0, 1), ridge(APART_M, 100.0 + TILT * APART_M, 2)])
    for head in near_lines(lines, xyz, WIDTH, blunt=True):
        axis = Axis.of(head, 0.01)
        assert np.nanmean(head.tilt) == pytest.approx(TILT, abs=0.002)
        assert abs(axis.course.at(head.stations).mean()) < 0.002  # without the cant, 6 mm
        assert axis.support(marked=False).sigma_m[40] > 0.002
