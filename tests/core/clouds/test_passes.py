"""Passes of the scanner, told apart by source ids and times."""

import numpy as np
import pytest
from rail_extract.core.clouds.passes import marks_of, number_passes, sources_of
from rail_extract.core.clouds.points import ask, read_rail_points
from rail_extract.core.tiles.grid import Square
from rail_extract.core.tiles.store import spool
from rail_extract.laboratory.scenes.las import write_las

SPEED, START = 12.0, 3.2e8
"""Metres per second, and a time of adjusted standard GPS."""


def ride(times, places, source_id=0):
    """Number the passes of a ride whose points have these times and chainages; returns the number of each point."""
    marks = marks_of(np.full(len(times), source_id, np.uint16), 0, START + times)
    found, number = np.unique(marks, return_inverse=True)
    squares = np.column_stack([places // 40, np.zeros(len(places))]).astype(int)
    passes = number_passes(marks, squares)
    return np.array([passes[mark] for mark in found.tolist()])[number.ravel()]


def test_one_ride_is_one_pass_however_long():
    times = np.arange(0.0, 3000.0, 0.5)
    assert set(ride(times, SPEED * times)) == {0}


def test_rides_over_the_same_place_are_passes():
    times = np.arange(0.0, 20.0, 0.05)
    numbers = ride(np.concatenate([times, times + 100.0, times + 86_400]), np.tile(SPEED * times, 3))
    assert numbers.tolist() == np.repeat([1, 2, 3], len(times)).tolist()


def test_a_ride_there_and_back_is_two_passes_without_a_break():
    times = np.arange(0.0, 1200.0, 0.25)
    places = SPEED * np.minimum(times, 1200.0 - times)
    numbers = ride(times, places)
    assert set(numbers) == {1, 2}
    for place in range(0, 6500, 40):
        here = (places >= place) & (places < place + 40)
        assert len(set(numbers[here])) == 2
    assert numbers[0] == 1 and numbers[-1] == 2


def test_a_stop_with_the_scanner_on_is_no_new_pass():
    times = np.arange(0.0, 600.0, 0.25)
    assert set(ride(times, SPEED * np.clip(times - 300, 0.0, None))) == {0}


def test_source_ids_are_the_numbers_where_each_is_one_pass():
    times = np.arange(0.0, 20.0, 0.05)
    ids = np.repeat(np.array([40_000, 7], np.uint16), len(times))
    marks = marks_of(ids, 0, np.concatenate([times, times + 100.0]))
    passes = number_passes(marks, np.zeros((len(marks), 2), int))
    assert {mark >> 16: number for mark, number in passes.items()} == {40_000: 40_000, 7: 7}


@pytest.mark.parametrize(
    "times",
    [
        None,
        np.zeros(50_000),
        np.full(50_000, np.nan),
        np.arange(50_000.0),
        np.arange(50_000) * 1e-6 + START,
        np.arange(50_000) * 1e6,
    ],
)
def test_times_that_are_none_make_no_passes(times):
    marks = marks_of(np.zeros(50_000, np.uint16), 0, times)
    assert len(np.unique(marks)) == 1


@pytest.mark.parametrize("source_id", [0, 5])
def test_files_and_sorted_files_agree_on_passes(tmp_path, source_id):
    random = np.random.RandomState(2)
    count = 3000
    xyz = np.column_stack([500_000 + random.uniform(0, 90, count), random.uniform(0, 2, count), np.zeros(count)])
    second = random.randint(2, size=count)
    times = START + 300.0 * second + (xyz[:, 0] - 500_000) / SPEED
    write_las(tmp_path / "a.laz", xyz, classification=10, point_source_id=source_id, gps_time=times)
    (points,) = read_rail_points(tmp_path / "a.laz", [10])
    np.testing.assert_array_equal(points.strips, 1 + second)
    (source,) = spool(ask(tmp_path / "a.laz", [10]), 41.0, tmp_path)
    near = source.near(Square((0, 0), points.frame, np.inf), 0.0)
    order, other = (np.lexsort(one.xyz.T) for one in (points, near))
    np.testing.assert_array_equal(near.strips[other], points.strips[order])
    assert points.scanned and near.scanned


def test_a_source_is_an_id_at_all_times_and_points_without_times_are_of_another():
    times = np.arange(0.0, 1800.0, 30.0)
    scanned = [sources_of(marks_of(np.full(len(times), one, np.uint16), 0, START + times)) for one in (0, 7)]
    images = [sources_of(marks_of(np.full(3, one, np.uint16), 0, None)) for one in (0, 7)]
    found = [set(one.tolist()) for one in (*scanned, *images)]
    assert [len(one) for one in found] == [1, 1, 1, 1]
    assert len(set.union(*found)) == 4
