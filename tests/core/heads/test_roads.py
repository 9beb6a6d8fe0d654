"""Rails in a street, with road in the class."""

import numpy as np
import pytest
from rail_extract.core.clouds.points import RailPoints
from rail_extract.core.frame import LocalFrame
from rail_extract.core.heads.edges import station_count
from rail_extract.core.heads.elevation import elevate
from rail_extract.core.heads.head_points import HeadPoints, near_lines
from rail_extract.core.heads.refinement import refine
from rail_extract.core.heads.roads import _at_gauge, _Band, hidden_edges, onto_heads
from rail_extract.core.lines.network import LineNetwork

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
    return RailPoints(xyz + random.normal(0, 0.003, xyz.shape), LocalFrame(np.zeros(3)), 10)


def drawn(*y):
    x = np.arange(0, LENGTH + 0.05, 0.1)
    return [np.column_stack([x, np.full(len(x), at)]) for at in y]


def moved(points, *y):
    return [line[:, 1] for line in onto_heads(drawn(*y), points.xyz, np.full(len(y), WIDTH), [SPACING])]


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


@pytest.mark.parametrize("road_m", [0.0, 0.01])
def test_heads_alone_stay(road_m):
    left, right = moved(street(road_m), 0.5 * SPACING, -0.5 * SPACING)
    assert (left == 0.5 * SPACING).all() and (right == -0.5 * SPACING).all()


def test_a_band_without_a_partner_stays_and_its_error_is_half_of_the_road():
    points = street(0.07)
    points = points.kept(points.xyz[:, 1] > 0)
    lines = onto_heads(drawn(0.5 * (SPACING + 0.07)), points.xyz, np.array([WIDTH]), [SPACING])
    assert np.allclose(lines[0][:, 1], 0.5 * (SPACING + 0.07))
    network = LineNetwork(tuple(lines), lines[0][[0, -1]], np.array([[0, 1]]))
    (rail,) = elevate(network, near_lines(lines, points.xyz, WIDTH), 10)
    assert np.median(rail.support.sigma_m) == pytest.approx(0.035, abs=0.004)


def test_the_axis_follows_the_edge_that_is_seen():
    points, lines = street(0.07), drawn(0.5 * SPACING + 0.005, -0.5 * SPACING - 0.005)
    nodes = np.array([line[end] for line in lines for end in (0, -1)])
    network = LineNetwork(tuple(lines), nodes, np.array([[0, 1], [2, 3]]))
    for line, side in zip(refine(network, points, WIDTH).lines, (1, -1)):
        assert np.abs(line[20:-20, 1] - side * 0.5 * SPACING).max() < 0.006


def test_one_edge_is_hidden_on_the_side_of_the_road():
    random = np.random.RandomState(1)
    t = np.sort(random.uniform(0, LENGTH, 6000))
    free = np.ones((2, station_count(LENGTH)), dtype=bool)

    def hidden(right_m, left_m, free):
        across = random.uniform(right_m, left_m, 6000)
        return hidden_edges(HeadPoints(t, across, 0 * t, WIDTH, np.array([[0.0, 0.0], [LENGTH, 0.0]]), free))

    right, left = hidden(-0.5 * WIDTH, 0.5 * WIDTH + 0.05, free)
    assert not right.any() and left.all()
    assert not hidden(-0.5 * WIDTH, 0.5 * WIDTH, free).any()
    assert not hidden(-0.06, 0.06, free).any()
    assert not hidden(-0.5 * WIDTH, 0.5 * WIDTH + 0.05, free & False).any()


@pytest.mark.parametrize(
    ("right_off_m", "left_off_m", "chosen"),
    [(0.014, 0.070, 1), (0.016, 0.070, None), (-0.014, 0.028, 1), (0.010, -0.021, None), (0.040, -0.003, 0)],
)
def test_an_end_of_a_band_is_at_gauge_within_15_mm_and_by_12_mm_more_than_the_other(right_off_m, left_off_m, chosen):
    (line, other) = drawn(0.0, -SPACING)
    ends = [line + [0, left_off_m], line + [0, right_off_m]]
    band = _Band((ends[0], ends[1]), (ends[0][::10], ends[1][::10]))
    found = _at_gauge(line, band, [(other,)], [SPACING, 1.06])
    assert found is (line if chosen is None else ends[chosen])
    half = other[: len(other) // 2 - 5]
    assert _at_gauge(line, band, [(half,)], [SPACING]) is line
    assert _at_gauge(line, None, [(other,)], [SPACING]) is line
