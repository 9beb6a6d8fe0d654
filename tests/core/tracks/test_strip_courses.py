"""Offsets of strips along tracks: across the track and upwards, by track and strip."""

import numpy as np
import pytest
from rail_extract.core.rails import Centerline
from rail_extract.core.tracks.strip_courses import strip_courses

LENGTH_M = 20.0
NORTH, EAST = np.array([0.0, 1.0]), np.array([1.0, 0.0])


def centerline(start, way, track_id):
    xy = np.array([start, np.add(start, LENGTH_M * way)])
    return Centerline(np.column_stack([xy, np.zeros(2)]), track_id, 10, (1,), (2,), 1435.0, 1.0, 0.0, 0.0, 0.0)


def rows(start, way, strip, left_m, up_m, aside_m):
    """Stations every half metre on a rail beside a track, at which a strip is off by this."""
    left = np.array([-way[1], way[0]])
    places = np.add(start, np.arange(0.25, LENGTH_M, 0.5)[:, None] * way + aside_m * left)
    count = len(places)
    values = [np.full(count, strip), *np.tile(left_m * left, (count, 1)).T, np.full(count, up_m), np.full(count, 9)]
    return np.column_stack([places, *values])


def test_each_strip_of_each_track_has_its_offsets_along_it():
    lines = [centerline((0, 0), NORTH, 4), centerline((30, 5), -EAST, 7)]
    found = strip_courses(
        lines,
        np.concatenate(
            [
                rows((0, 0), NORTH, 1, 0.010, -0.004, 0.7),
                rows((0, 0), NORTH, 1, 0.020, -0.006, -0.7),  # the other rail
                rows((0, 0), NORTH, 2, -0.015, 0.005, 0.7),
                rows((30, 5), -EAST, 2, 0.008, 0.001, 0.7),
                rows((100, 0), NORTH, 3, 1.0, 1.0, 0.0),  # no track
                rows((0, 0), NORTH, 3, 1.0, 1.0, 1.2),  # another rail
            ]
        ),
    )
    assert [(one.track_id, one.strip) for one in found] == [(4, 1), (4, 2), (7, 2)]
    for one, across_mm, up_mm in zip(found, (15, -15, 8), (-5, 5, 1)):
        assert one.chainage_m == pytest.approx(np.arange(0.5, LENGTH_M))
        assert one.across_mm == pytest.approx(across_mm)
        assert one.up_mm == pytest.approx(up_mm)


def test_no_strips_have_no_courses():
    assert strip_courses([centerline((0, 0), NORTH, 1)], np.empty((0, 7))) == ()
