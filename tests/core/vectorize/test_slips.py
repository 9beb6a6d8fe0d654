"""Slips: two rails that cross, and the curves that connect them on either side."""

import numpy as np
import pytest
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.lines.network_smoothing import smooth_network
from rail_extract.core.raster import rasterize
from rail_extract.core.vectorize import vectorize
from rail_extract.core.vectorize.junctions import DIRECTION_M
from rail_extract.core.vectorize.slips import SIDE_M, Slip, _continue, _Cross, _Parts, open_slips
from scipy.spatial import cKDTree

HEAD_M, CELL_M = 0.072, 0.04
LEG_M = 30.0


def rails(number, radius_m, sides, heading):
    """Axes of two straight rails that cross at 1:`number`, and of slip curves on some sides of the crossing."""
    half = np.arctan(1 / number) / 2
    t = np.arange(-LEG_M, LEG_M, 0.05)
    lines = [np.column_stack([t * np.cos(half), side * t * np.sin(half)]) for side in (1, -1)]
    turn = np.linspace(-half, half, 400)
    middle = radius_m / np.cos(half)
    for side in sides:
        lines.append(np.column_stack([radius_m * np.sin(turn), side * (middle - radius_m * np.cos(turn))]))
    axes = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    return [line @ axes for line in lines]


def raster_of(lines, rng, per_m=400):
    """Cells of heads of even density on these axes."""
    clouds = []
    for line in lines:
        at = rng.uniform(0, len(line) - 1, int(per_m * 0.05 * len(line)))
        place = np.column_stack([np.interp(at, np.arange(len(line)), column) for column in line.T])
        along = np.gradient(line, axis=0)[at.astype(int)]
        normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
        clouds.append(place + rng.uniform(-0.5, 0.5, len(at))[:, None] * HEAD_M * normal)
    return rasterize(np.concatenate(clouds), CELL_M)


SPACING_M = 1.507


def at_gauge(lines, heading):
    """The rails, and their partners: two tracks that cross."""
    across = SPACING_M * np.array([-np.sin(heading), np.cos(heading)])
    return [*lines, *(line + across for line in lines)]


@pytest.mark.parametrize("sides", [(1, -1), (1,), (-1,), ()])
@pytest.mark.parametrize(("number", "radius_m", "heading"), [(9, 190.0, 0.5), (9, 190.0, -1.2), (11, 300.0, 0.3)])
def test_all_rails_of_a_slip_are_drawn(number, radius_m, heading, sides):
    true = at_gauge(rails(number, radius_m, sides, heading), heading)
    network = smooth_network(vectorize(raster_of(true, np.random.RandomState(0)), HEAD_M), 0.8)
    assert len(network.lines) == len(true)
    assert len(network.passes) == 4 * len(sides)  # each slip curve begins and ends on one of the rails that cross
    for axis in true:
        off = [np.percentile(cKDTree(axis).query(line)[0], 95) for line in network.lines]
        line = network.lines[int(np.argmin(off))]
        assert min(off) < 0.05 and np.percentile(cKDTree(line).query(axis)[0], 90) < 0.06


def test_a_curve_without_a_partner_is_no_slip():
    """The frog of a turnout may look like half a slip, but the other rail of the track has none."""
    lone = rails(9, 190.0, (1,), 0.4)
    partner = [line + SPACING_M * np.array([-np.sin(0.4), np.cos(0.4)]) for line in lone[:1]]
    network = vectorize(raster_of([*lone, *partner], np.random.RandomState(0)), HEAD_M)
    assert open_slips(network, cKDTree(np.concatenate(lone)))[1] == []


def test_a_slip_holds_what_lies_between_its_legs_and_its_curve():
    cross = _Cross(np.array([10.0, 20.0]), np.eye(2), 0.05)
    slip = Slip(cross, 12.0, ((0.3, 1.0),))
    assert slip.tangent_m == pytest.approx(2 * 0.3 / 0.05)
    curve = cross.curve(0.3, 1.0)
    inner = np.abs(curve[:, 0] - 10) < 11.9
    assert slip.holds(curve[inner]).all()
    assert not slip.holds(curve[inner] + [0, SIDE_M + 0.01]).any()
    assert slip.holds(curve[inner] + [0, SIDE_M - 0.01]).all()
    mirrored = curve * [1, -1] + [0, 40]
    middle = np.abs(curve[:, 0] - 10) < 2
    assert not slip.holds(mirrored[middle]).any()
    assert not slip.holds(np.array([[22.1, 20.0]])).any()


@pytest.mark.parametrize(
    ("bend_deg", "miss_m", "is_one"), [(3.9, 0.0, True), (4.1, 0.0, False), (0.0, -0.19, True), (0.0, 0.21, False)]
)
def test_two_legs_of_one_rail_continue_each_other(bend_deg, miss_m, is_one):
    bend = np.radians(bend_deg)
    tips = np.array([[8.0, 0.0], [-8.0 * np.cos(bend), 8.0 * np.sin(bend) + miss_m]])
    outward = np.array([[1.0, 0.0], [-np.cos(bend), np.sin(bend)]])
    assert _continue(tips, outward) == is_one


@pytest.mark.parametrize(("share", "count"), [(0.5, 1), (0.7, 2), (1.3, 2)])
def test_a_leg_shows_its_direction_over_sixty_percent_of_the_length(share, count):
    line = np.array([[-30.0, 0.0], [8.0 + share * DIRECTION_M, 0.0]])
    network = LineNetwork((line,), line, np.array([[0, 1]]))
    tips, outward = _Parts.of(network).legs(np.array([0.0, 0.0]), 8.0)
    np.testing.assert_allclose(tips, [[-8, 0], [8, 0]][:count], atol=0.11)
    np.testing.assert_allclose(outward, [[-1, 0], [1, 0]][:count], atol=1e-9)


@pytest.mark.parametrize(
    ("angle_deg", "is_found"), [(1.9, False), (2.1, True), (6.3, True), (11.9, True), (12.1, False)]
)
@pytest.mark.parametrize("sense", [1, -1])
def test_a_cross_has_the_place_axes_and_angle_of_two_lines(angle_deg, is_found, sense):
    half = np.radians(angle_deg) / 2
    ways = np.array([[np.cos(half), np.sin(half)], [np.cos(half), -np.sin(half)]])
    tips = [3, 4] + np.concatenate([[-9 * ways[0], 8 * ways[0]], [-7 * ways[1], 10 * ways[1]][::sense]])
    cross = _Cross.of(tips)
    assert (cross is not None) == is_found
    if cross is not None:
        assert cross.half_angle == pytest.approx(half)
        np.testing.assert_allclose(cross.place, [3, 4], atol=1e-9)
        np.testing.assert_allclose(cross.axes, np.eye(2), atol=1e-9)


@pytest.mark.parametrize(
    ("radius_m", "is_found"), [(70, False), (100, False), (190, True), (300, True), (600, True), (800, False)]
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_height_of_a_slip_curve_follows_from_its_radius(radius_m, is_found, side):
    """At 1:9 a curve of 100 m is less than 5 m away from both rails, and one of 800 m is wider than slips are."""
    cross = _Cross(np.array([10.0, 20.0]), np.eye(2), np.arctan(1 / 9) / 2)
    height_m = radius_m * cross.half_angle**2 / 2
    cells = cross.curve(height_m, side)
    cells = np.concatenate([cells + [0, off_m] for off_m in (-0.03, -0.01, 0.01, 0.03)])
    found = cross.height_of_curve(cells, side)
    assert found == (pytest.approx(height_m, abs=0.02) if is_found else None)
    assert cross.height_of_curve(cells, -side) is None
    half_seen = cells[np.abs(cells[:, 0] - 10) > 0.25 * np.abs(cells[:, 0] - 10).max()]
    assert cross.height_of_curve(half_seen, side) is None


def test_legs_enter_a_slip_at_its_border_and_its_partner_is_a_gauge_beside():
    slip = Slip(_Cross(np.array([10.0, 20.0]), np.eye(2), 0.05), 12.0, ((0.3, 1.0),))
    places = [[11.1, 0.555], [-11.1, 0.555], [-11.1, -0.64], [10.9, 0.545], [11.1, 0.67], [11.1, 0.44]]
    assert [slip.is_leg(np.array([10.0, 20.0]) + place) for place in places] == 3 * [True] + 3 * [False]
    for (x, y), beside in {
        (0.9, 1.5): 1,
        (-0.9, -1.5): 1,
        (1.1, 1.5): 0,
        (0, 0.5): 0,
        (0, 0.7): 1,
        (0, -1.9): 0,
    }.items():
        other = Slip(_Cross(np.array([10.0 + x, 20.0 + y]), np.eye(2), 0.05), 12.0, ((0.3, 1.0),))
        assert slip.is_beside(other) == bool(beside)
