"""Rails measured again with the points of one square at a time."""

import numpy as np
import pytest
from built import cloud_of, rail_of, source_of
from rail_extract.core.run.tasks import Runner
from rail_extract.core.squares.remeasuring import measure_rails

WIDTH = 0.072
LENGTH, TUNNEL = 300.0, (85.0, 215.0)


def rail_and_points():
    """A straight rail as stored in a file, and points on its head except in a tunnel."""
    random = np.random.RandomState(3)
    t = np.sort(random.uniform(0, LENGTH, 30_000))
    t = t[(t < TUNNEL[0]) | (t > TUNNEL[1])]
    xyz = np.column_stack([t, random.uniform(-0.5, 0.5, len(t)) * WIDTH, 0.002 * random.standard_normal(len(t))])
    ends = np.array([[0.0, 0.0, 0.0], [LENGTH, 0.0, 0.0]])
    return rail_of(ends, 7, points=30_000), cloud_of(xyz)


@pytest.mark.parametrize("side", [1000.0, 100.0, 40.0])
def test_a_tunnel_is_a_gap_whichever_squares_it_crosses(side):
    rail, points = rail_and_points()
    (measured,) = measure_rails([rail], [source_of(points.xyz, side_m=side)], WIDTH, Runner())
    np.testing.assert_allclose(measured.gaps, [TUNNEL], atol=0.2)
    support = measured.support
    inside = (support.t > TUNNEL[0] + 1) & (support.t < TUNNEL[1] - 1)
    assert len(support.t) == pytest.approx(LENGTH / 0.25, abs=10)
    assert support.points[inside].sum() == 0
    assert support.points.sum() == pytest.approx(len(points.xyz), rel=0.02)
    assert (support.sigma_m[inside][20:-20] > 0.003).all()
    assert np.median(support.sigma_m[~inside]) < 0.0025
    assert measured.length_m == pytest.approx(LENGTH, abs=0.01)


@pytest.mark.parametrize("side", [1000.0, 100.0, 50.0])
def test_heights_are_interpolated_across_a_tunnel_on_a_gradient(side):
    rail, points = rail_and_points()
    lift = 0.03 * points.xyz[:, :1] * [0, 0, 1]
    (measured,) = measure_rails([rail], [source_of(points.xyz + lift, side_m=side)], WIDTH, Runner())
    x = np.arange(0.0, LENGTH, 0.5)
    height = np.interp(x, measured.xyz[:, 0], measured.xyz[:, 2])
    np.testing.assert_allclose(height, 0.03 * x, atol=0.006)


def test_a_rail_away_from_all_points_is_a_gap_from_end_to_end():
    rail, points = rail_and_points()
    (measured,) = measure_rails([rail], [source_of(points.xyz + [0, 5.0, 0])], WIDTH, Runner())
    np.testing.assert_array_equal(measured.gaps, [[0.0, LENGTH]])
    np.testing.assert_allclose(measured.support.sigma_m, WIDTH / np.sqrt(12))
