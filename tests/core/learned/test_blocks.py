"""What the network is given: thinned points and blocks, the same for the same points in any order."""

import numpy as np
import pytest
from built import raw_track
from rail_extract.core.learned import blocks
from rail_extract.core.learned.blocks import MAX_POINTS, RAIL_VOXEL_M, core_side, cut, thin
from rail_extract.laboratory.scenes.raw_shapes import TOP_M

SIDE = 41.0


@pytest.fixture(scope="module")
def track():
    """Points of 9 m of track, and which are on heads."""
    return raw_track(9.0, 2000)


@pytest.fixture(scope="module")
def thinned(track):
    return thin(track[0])


def test_all_points_on_heads_are_in_the_zone_of_railheads(track, thinned):
    xyz, on = track
    assert np.isin(np.flatnonzero(on), thinned.band).mean() > 0.999
    assert thinned.place[thinned.railhigh, 3].min() >= 0.055
    assert np.median(thinned.place[np.isin(thinned.number, np.flatnonzero(on)), 3]) == pytest.approx(TOP_M, abs=0.02)


def test_one_point_of_each_cube_stays_and_stands_for_the_others(track, thinned):
    xyz, _ = track
    cubes = np.floor(thinned.band_place.astype(float) / RAIL_VOXEL_M)
    assert thinned.railhigh.sum() == len(np.unique(cubes, axis=0))
    assert np.array_equal(np.unique(thinned.stands_for), np.flatnonzero(thinned.railhigh))
    chosen = np.floor(thinned.place[thinned.stands_for, :3].astype(float) / RAIL_VOXEL_M)
    assert np.array_equal(chosen, cubes)


def test_the_order_of_the_points_changes_nothing(track, thinned):
    xyz, _ = track
    order = np.random.RandomState(1).permutation(len(xyz))
    shuffled = thin(xyz[order])
    assert np.array_equal(shuffled.place, thinned.place)
    assert np.array_equal(order[shuffled.number], thinned.number)
    for one, other in zip(cut(shuffled, SIDE), cut(thinned, SIDE)):
        assert np.array_equal(one.number, other.number)


def test_cores_cover_each_point_once_and_blocks_reach_beyond_them(thinned):
    found = cut(thinned, SIDE)
    times = np.bincount(np.concatenate([one.number[one.core] for one in found]), minlength=len(thinned.number))
    assert np.array_equal(times, thinned.railhigh.astype(int))
    core_m = core_side(SIDE)
    for one in found:
        low = thinned.place[one.number, :2] - np.multiply(one.key, core_m)
        assert -0.6 < low.min() < low.max() < core_m + 0.6
        assert low.max() - low.min() <= blocks.BLOCK_M + 1e-4


def test_a_block_with_too_many_points_becomes_several_of_the_same_place(thinned, monkeypatch):
    monkeypatch.setattr(blocks, "MAX_POINTS", 200)
    found = cut(thinned, SIDE)
    assert max(len(one.number) for one in found) <= 200 < MAX_POINTS
    assert len({one.key for one in found}) < len(found)
    times = np.bincount(np.concatenate([one.number[one.core] for one in found]), minlength=len(thinned.number))
    assert np.array_equal(times, thinned.railhigh.astype(int))
