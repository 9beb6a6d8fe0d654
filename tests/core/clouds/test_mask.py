"""Masks: a grid decides most places, the edges the others; the result is that of the edges alone."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.clouds.mask import Mask
from rail_extract.core.clouds.points import ask, read_requested
from rail_extract.core.tiles.store import spool

PLACE = np.array([500_000.0, 3_000_000.0])
SQUARE = np.array([[0, 0], [30, 0], [30, 30], [0, 30], [0, 0]], dtype=float)


def star(corners, seed):
    """A ring whose edges have any length and direction."""
    random = np.random.default_rng(seed)
    angle, radius = np.sort(random.uniform(0, 2 * np.pi, corners)), random.uniform(40, 100, corners)
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    return np.concatenate([ring, ring[:1]])


def winding(ring, xy):
    """Return how often a ring winds around each place, by the sum of the angles of its edges."""
    start, end = ((ring[part][None] - xy[:, None]) @ [1, 1j] for part in (slice(None, -1), slice(1, None)))
    return np.rint(np.angle(end / start).sum(axis=1) / (2 * np.pi)).astype(int)


@given(st.integers(3, 60), st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_places_are_inside_if_the_rings_wind_around_them_an_odd_number_of_times(corners, seed):
    rings = [star(corners, seed), SQUARE / 2 - [7, 9]]
    xy = np.random.default_rng(seed + 1).uniform(-110, 110, (2000, 2))
    expected = sum(winding(ring, xy) for ring in rings) % 2 == 1
    np.testing.assert_array_equal(Mask.of([ring + PLACE for ring in rings]).holds(xy + PLACE), expected)


@pytest.mark.parametrize("outside", [[200.0, 0.0], [0.0, -1e9], [15.0, 30.2]])
def test_places_beyond_the_grid_are_outside(outside):
    assert Mask.of([SQUARE]).holds(np.array([outside, [15.0, 15.0]])).tolist() == [False, True]


def test_points_are_limited_to_a_mask(tiles, tmp_path):
    """In memory and on disk, where points of another mask are not taken for those of this one."""
    request = ask(tiles, [10])
    (whole,) = read_requested(request)
    places = whole.frame.to_crs(whole.xyz)[:, :2]
    (west, south), (east, north) = places.min(axis=0) - 1, places.max(axis=0) + 1
    for share in (0.5, 0.25):
        corner = [[west, south], [west + 2 * share * (east - west), south], [west, north], [west, south]]
        limited = replace(request, mask=Mask.of([np.array(corner)]))
        (points,) = read_requested(limited)
        (spooled,) = spool(limited, 200.0, tmp_path)
        inside = np.count_nonzero(limited.mask.holds(places))
        assert 0 < inside < len(places)
        assert len(points.xyz) == sum(spooled.counts.values()) == inside
