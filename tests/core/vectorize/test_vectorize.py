"""From drawn rails to lines and back: accuracy, junctions, gaps, and ends that must never be joined."""

from functools import cache

import numpy as np
import pytest
from built import check_meeting
from heard import Heard
from rail_extract.core.errors import Cancelled
from rail_extract.core.lines.smoothing import smooth_network
from rail_extract.core.polyline import length_along
from rail_extract.core.raster import RailRaster
from rail_extract.core.vectorize import vectorize
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.rasters.turnouts import FORMS, branch
from scipy.spatial import cKDTree

CELL_M = 0.04
HEAD_M = 0.0762


def dense(line, step_m=0.005):
    t = length_along(line)
    at = np.linspace(0, t[-1], int(t[-1] / step_m) + 2)
    return np.column_stack([np.interp(at, t, axis) for axis in line.T])


def draw(lines, x0=0.0, y0=0.0):
    """Set the cells whose centre is at most half a railhead from a line."""
    raster = RailRaster({}, CELL_M, x0, y0)
    points = np.concatenate([dense(line, 0.01) for line in lines])
    at = np.unique(np.floor(np.column_stack([y0 - points[:, 1], points[:, 0] - x0]) / CELL_M).astype(int), axis=0)
    around = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), -1).reshape(-1, 2)
    cells = np.unique((at[:, None] + around).reshape(-1, 2), axis=0)
    return raster.with_cells(cells[cKDTree(points).query(raster.to_local(cells))[0] <= HEAD_M / 2])


def offsets(line, truth):
    """Distance of a line from the truth, without the half metre at either end."""
    points = dense(line, 0.02)
    return cKDTree(dense(truth, 0.002)).query(points[25:-25])[0]


def straight(length, slope, start=(3.017, -2.009)):
    direction = np.array([1.0, slope]) / np.hypot(1.0, slope)
    return np.array(start) + np.outer([0.0, length], direction)


def arc(length, radius, heading=0.3):
    return trace([Element(length, 1 / radius, 1 / radius)], (1.003, -50.011), heading).xy


def smoothed(raster, **parameters):
    return smooth_network(vectorize(raster, HEAD_M, **parameters), 0.8).lines


@pytest.mark.parametrize(
    ("truth", "rms_mm"),
    [
        (straight(30, 0.0), 12),
        (straight(30, 1 / 200), 12),
        (straight(30, 1 / 50), 12),
        (straight(30, 1 / 18), 5),
        (straight(30, -1 / 9), 5),
        (straight(30, 0.7), 5),
        (straight(30, 3.0), 5),
        (arc(60, 190), 5),
        (arc(60, 25), 5),
        (arc(60, -600, heading=2.0), 5),
    ],
)
def test_a_drawn_rail_comes_back(truth, rms_mm):
    (line,) = smoothed(draw([truth]))
    assert np.sqrt(np.mean(offsets(line, truth) ** 2)) < rms_mm / 1000
    np.testing.assert_allclose(sorted(np.hypot(*(line[[0, -1]] - truth[0]).T))[0], 0, atol=0.04)
    assert length_along(line)[-1] == pytest.approx(length_along(truth)[-1], abs=0.08)


def test_a_loop_comes_back_closed():
    angle = np.linspace(0, 2 * np.pi, 2000)
    truth = 25 * np.column_stack([np.cos(angle), np.sin(angle)])
    (line,) = smoothed(draw([truth]))
    np.testing.assert_array_equal(line[0], line[-1])
    assert np.sqrt(np.mean((np.hypot(*line.T) - 25) ** 2)) < 0.003


def three_tracks(length=160):
    curve = trace([Element(60), Element(40, 0, 1 / 300), Element(length - 100, 1 / 300, 1 / 300)], heading=0.43)
    return [curve.offset(track + side) for track in (0.0, 4.0, 8.0) for side in (-0.531, 0.531)]


@cache
def scene(seed):
    """Six rails with gaps, ragged flanks and weeds."""
    random = np.random.default_rng(seed)
    pieces, rails = [], three_tracks()
    for rail in rails:
        t = length_along(rail)
        keep = np.ones(len(rail), dtype=bool)
        for start in np.arange(10, 150, 12) + random.uniform(0, 5, 12):
            keep &= (t < start) | (t > start + random.uniform(0.3, 3.0))
        pieces += [part for part in np.split(rail, np.flatnonzero(np.diff(keep)) + 1) if len(part) > 30]
        pieces = [part for part in pieces if len(part) > 160]
    raster = draw(pieces)
    cells = raster.cells()
    flank = np.concatenate([cells + step for step in ([0, 1], [1, 0], [0, -1], [-1, 0])])
    noise = [cells[random.random(len(cells)) > 0.05], flank[random.random(len(flank)) < 0.03]]
    for middle in cells[random.integers(len(cells), size=25)] + random.integers(-30, 31, (25, 2)):
        weed = random.normal(0, random.uniform(1, 3), (60, 2)).round().astype(int)
        noise.append(middle + weed)
    return raster.with_cells(np.concatenate(noise)), rails


@pytest.mark.parametrize("seed", [1, 2])
def test_three_noisy_tracks_with_gaps_give_one_line_per_rail(seed):
    raster, rails = scene(seed)
    network = vectorize(raster, HEAD_M)
    check_meeting(network)
    lines = smooth_network(network, 0.8).lines
    assert 6 <= len(lines) <= 8
    off = cKDTree(np.concatenate([dense(rail, 0.01) for rail in rails]))
    found = cKDTree(np.concatenate([dense(line, 0.01) for line in lines]))
    astray = np.concatenate([off.query(dense(line))[0] for line in lines]) > 0.05
    missed = np.concatenate([found.query(dense(rail))[0] for rail in rails]) > 0.05
    assert astray.mean() < 0.005
    assert missed.mean() < 0.01


def test_the_result_does_not_depend_on_the_tiles():
    raster, _ = scene(1)
    moved = RailRaster({}, CELL_M, raster.x0 - 77 * CELL_M, raster.y0 + 131 * CELL_M).with_cells(
        raster.cells() + [131, 77]
    )
    expected, found = vectorize(raster, HEAD_M), vectorize(moved, HEAD_M)
    assert len(expected.lines) == len(found.lines)
    for one, other in zip(expected.lines, found.lines):
        np.testing.assert_allclose(one, other, atol=1e-9)


def with_gap(line, start, length):
    t = length_along(line)
    return [line[t <= start], line[t >= start + length]]


def reverse(length, first, second):
    return trace([Element(length, first, first), Element(20, second, second)], (0.0, 0.0), 0.4).xy


@pytest.mark.parametrize(
    ("truth", "start", "gap", "off_m"),
    [
        *((arc(24, radius), 10, gap, 0.02) for radius in (25, 190, 1e9) for gap in (0.3, 1.5, 4.0)),
        (reverse(20, 1 / 190, -1 / 190), 18, 4, 0.02),
        (reverse(20, 0.0, -1 / 30), 18, 4, 0.05),  # a tram enters a sharp curve
    ],
)
def test_gaps_are_bridged_along_the_curve(truth, start, gap, off_m):
    (line,) = smoothed(draw(with_gap(truth, start, gap)))
    assert offsets(line, truth).max() < off_m


def test_gaps_longer_than_allowed_stay():
    pieces = with_gap(straight(30, 0.4)[[0]] + np.outer(np.arange(0, 30, 0.1), [0.93, 0.37]), 10, 4)
    assert len(vectorize(draw(pieces), HEAD_M, max_gap_m=5).lines) == 1
    assert len(vectorize(draw(pieces), HEAD_M, max_gap_m=3.5).lines) == 2


@pytest.mark.parametrize("spacing", [0.3, 0.5, 1.06, 1.5])
@pytest.mark.parametrize("gap", [1.0, 4.0])
def test_the_neighbouring_rail_is_never_joined(spacing, gap):
    first, second = straight(20, 0.3), straight(20, 0.3)
    second = second + (first[1] - first[0]) * (1 + gap / 20) + spacing * np.array([-0.287, 0.958])
    assert len(vectorize(draw([first, second]), HEAD_M).lines) == 2


def test_a_weed_before_a_rail_end_is_not_joined():
    rail = straight(20, 0.3)
    direction = (rail[1] - rail[0]) / 20
    weed = rail[1] + np.outer([0.6, 1.2], direction) + np.outer([0.25, 0.65], [-direction[1], direction[0]])
    network = vectorize(draw([rail, weed]), HEAD_M, min_length_m=0.3)
    assert len(network.lines) == 2


def test_the_nearer_of_two_rails_that_end_is_not_preferred_to_the_straight_one():
    rail = np.outer(np.arange(0, 30, 0.1), [0.9578, 0.2873]) + [0.013, 0.007]
    stray = rail[150:152] + [[0.0, 0.0], [1.0, 1.5]]
    line = max(smoothed(draw([*with_gap(rail, 12, 4), stray])), key=len)
    assert length_along(line)[-1] == pytest.approx(29.9, abs=0.1)
    assert offsets(line, rail).max() < 0.03


@pytest.mark.parametrize(
    ("name", "curvature"), [("tram 25", 0.0), ("190-1:9", 0.0), ("300-1:9", 1 / 400), ("500-1:12", 0.0)]
)
def test_a_turnout_has_two_rails_through_and_two_that_begin_where_they_part(name, curvature):
    form = next(form for form in FORMS if form.name == name)
    main = trace([Element(65 + form.arc_m, curvature, curvature)], heading=0.35)
    side = branch(main, 25.0, form, -1, 20.0)
    rails = [curve.offset(left) for curve in (main, side) for left in (-0.7556, 0.7556)]
    network = vectorize(draw(rails), HEAD_M)
    check_meeting(network)
    assert len(network.lines) == 4
    assert sorted(network.degrees()) == [1] * 6 + [3] * 2
    lines = smooth_network(network, 0.8).lines
    truth = cKDTree(np.concatenate([dense(rail, 0.005) for rail in rails]))
    found = cKDTree(np.concatenate([dense(line, 0.02) for line in lines]))
    assert max(found.query(dense(rail, 0.05))[0].max() for rail in rails) < 0.05
    astray = np.concatenate([truth.query(line)[0] for line in lines])
    assert astray.max() < 0.05
    assert np.sqrt(np.mean(astray**2)) < 0.006
    longest = sorted(length_along(line)[-1] for line in lines)[-2:]
    np.testing.assert_allclose(longest, main.length_m, rtol=0.02)


def test_no_cells_no_lines():
    network = vectorize(RailRaster({}, CELL_M, 0.0, 0.0), HEAD_M)
    assert network.lines == ()
    assert smooth_network(network, 0.8).lines == ()


def test_short_pieces_are_dropped():
    assert len(vectorize(draw([straight(0.8, 0.3), straight(5, 0.3, (20, 0))]), HEAD_M).lines) == 1


def test_a_cancel_ends_the_work():
    with pytest.raises(Cancelled):
        vectorize(draw([straight(5, 0.3)]), HEAD_M, progress=Heard(cancel_after=0))


def test_a_weed_on_the_side_of_a_rail_is_not_a_branch():
    rail = straight(20, 0.3)
    weed = rail.mean(axis=0) + np.outer([0.0, 0.8], [0.0, 1.0])
    assert len(vectorize(draw([rail, weed]), HEAD_M, min_length_m=0.3).lines) == 1


@pytest.mark.parametrize("aside_m", [0.16, 0.2])
def test_a_crossing_whose_leg_a_wing_rail_bends_sharply_is_two_rails(aside_m):
    """As in world 9842, where the rails changed places; the rail goes on along its own course."""
    slope = 1 / 12
    falling = np.array(
        [[-30.0, 30 * slope], [-1.8, 1.8 * slope], [-0.7, aside_m], [-0.67, 0.67 * slope], [30.0, -30 * slope]]
    )
    lines = smoothed(draw([falling, np.array([[-30.0, -30 * slope], [30.0, 30 * slope]])]))
    assert len(lines) == 2
    for line in lines:
        sign = np.sign((line[-1] - line[0]).prod())
        assert np.abs(line[:, 1] - sign * slope * line[:, 0]).max() < 0.05


@pytest.mark.parametrize("angle_deg", [90.0, 60.0, 45.0])
def test_rails_with_short_legs_cross(angle_deg):
    across = np.array([[-3.0, 0.0], [3.0, 0.0]])
    rails = [across + [0.0, left] for left in (-0.75, 0.75)]
    turn = np.radians(angle_deg)
    turned = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    lines = vectorize(draw([*rails, *(rail @ turned for rail in rails)]), HEAD_M).lines
    np.testing.assert_allclose([np.hypot(*(line[-1] - line[0])) for line in lines], 6.0, atol=0.1)
    assert len(lines) == 4
