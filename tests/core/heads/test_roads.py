"""Rails in a street, with road in the class."""

import numpy as np
import pytest
from built import cloud_of, network_of
from rail_extract.core.heads.elevation import elevate
from rail_extract.core.heads.head_points import near_lines
from rail_extract.core.heads.roads import bands, onto_heads

WIDTH, SPACING, LENGTH = 0.056, 1.491, 40.0


def street(road_m, sides=(1, -1), seed=0):
    """Points of two rails along the x axis, with road on the outer sides of those at these sides of the track."""
    random, clouds = np.random.RandomState(seed), []
    for side in (1, -1):
        outer = 0.5 * WIDTH + (road_m if side in sides else 0.0)
        count = int(2500 * LENGTH * (outer + 0.5 * WIDTH))
        across = random.uniform(-0.5 * WIDTH, outer, count)
        y = side * (0.5 * SPACING + across)
        clouds.append(np.column_stack([random.uniform(0, LENGTH, count), y, np.zeros(count)]))
    xyz = np.concatenate(clouds)
    return cloud_of(xyz + random.normal(0, 0.003, xyz.shape))


def drawn(*y):
    x = np.arange(0, LENGTH + 0.05, 0.1)
    return [np.column_stack([x, np.full(len(x), at)]) for at in y]


def moved(points, *y):
    return [line[:, 1] for line in onto_heads(drawn(*y), points, np.full(len(y), WIDTH), [SPACING])]


@pytest.mark.parametrize("road_m", [0.03, 0.06, 0.08])
def test_lines_move_onto_the_ends_of_their_bands_that_are_at_gauge(road_m):
    middle_m = 0.5 * (SPACING + road_m)
    left, right = moved(street(road_m), middle_m, -middle_m)
    assert np.abs(left - 0.5 * SPACING).max() < 0.006
    assert np.abs(right + 0.5 * SPACING).max() < 0.006


def test_road_next_to_one_rail_is_told_by_the_other():
    points = street(0.07, sides=(-1,))
    left, right = moved(points, 0.5 * SPACING, -0.5 * (SPACING + 0.07))
    assert (left == 0.5 * SPACING).all()
    assert np.abs(right + 0.5 * SPACING).max() < 0.006


def test_a_band_without_a_partner_stays_and_its_error_is_half_of_the_road():
    points = street(0.07)
    points = points.kept(points.xyz[:, 1] > 0)
    lines = onto_heads(drawn(0.5 * (SPACING + 0.07)), points, np.array([WIDTH]), [SPACING])
    assert np.allclose(lines[0][:, 1], 0.5 * (SPACING + 0.07))
    (rail,) = elevate(network_of(*lines), near_lines(lines, points, WIDTH), 10)
    assert np.median(rail.support.sigma_m) == pytest.approx(0.035, abs=0.004)


def test_a_few_points_beside_a_head_are_no_road():
    """Beams that meet the edge of a head and what is behind it: in world 9591, they hid the outlines of heads."""
    random = np.random.RandomState(1)
    across = np.concatenate([random.uniform(-0.5 * WIDTH, 0.5 * WIDTH, 20000), random.uniform(0.03, 0.07, 1500)])
    cloud = np.column_stack([random.uniform(0, LENGTH, len(across)), across, random.normal(0, 0.003, len(across))])
    (points,) = near_lines(drawn(0.0), cloud_of(cloud), WIDTH)
    right_m, left_m = bands(points)
    assert np.median(left_m - right_m) == pytest.approx(WIDTH, abs=0.006)
