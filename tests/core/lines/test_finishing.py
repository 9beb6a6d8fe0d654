"""Finished lines: united, without turns, thinned."""

from dataclasses import replace

import numpy as np
import pytest
from built import arc, rail_of
from heard import Heard
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.lines.finishing import (
    MAX_TURN_DEG,
    essential_vertices,
    finished,
    parts_without_turns,
    thin,
    united,
)
from rail_extract.core.parameters import Parameters
from rail_extract.core.polyline import interpolate, length_along
from rail_extract.core.rails import RailLine, Support
from rail_extract.core.raster import rasterize
from rail_extract.core.squares.steps import lines_of
from rail_extract.laboratory.rasters.drawing import Window, draw_label
from rail_extract.laboratory.rasters.layouts import random_layout
from rail_extract.laboratory.rasters.pairs import BASE_RATIO, CELL_M, SPACING_M
from rail_extract.laboratory.rasters.paths import TrackSize


def piece(start_m, end_m, points=100, resid_mm=1.0, gaps=()):
    xyz = np.array([[x, 0.0, 0.1 * x] for x in np.linspace(start_m, end_m, 5)])
    gaps = np.array(gaps, dtype=float).reshape(-1, 2)
    return RailLine(xyz, 3, 10, points, resid_mm, 2.0, float(np.diff(gaps).sum()), gaps)


def test_a_single_piece_keeps_its_line_and_has_whole_points():
    part = piece(0, 10)
    assert united([part]) is part
    some = united([replace(part, points=99.6, sigma_mm=3.5)])
    assert (some.points, some.sigma_mm) == (100, 3.5)
    assert np.array_equal(some.xyz, part.xyz)


def test_vertices_counts_and_gaps_of_two_pieces_are_those_of_the_whole():
    whole = united([piece(0, 10, 100, 1.0, [(8.0, 10.0)]), piece(10, 30, 300, 2.0, [(0.0, 1.0), (5.0, 6.0)])])
    assert np.array_equal(whole.xyz[:, 0], [0, 2.5, 5, 7.5, 10, 15, 20, 25, 30])
    assert whole.points == 400
    assert whole.resid_mm == pytest.approx(np.sqrt((1 * 100 + 4 * 300) / 400))
    assert whole.gaps.tolist() == [[8.0, 11.0], [15.0, 16.0]]
    assert whole.bridged_m == pytest.approx(4.0)
    assert whole.sigma_mm == 2.0


def supported(start_m, end_m, sigma_m, strips=None):
    t = np.arange(0.5, end_m - start_m)
    one = Support.of_one_strip(t, np.full(len(t), 7), np.full(len(t), sigma_m), 2 * sigma_m)
    return replace(piece(start_m, end_m), support=replace(one, strips=np.full((len(t), 3), strips)) if strips else one)


def test_supports_follow_each_other_and_sigma_is_that_of_the_whole():
    whole = united([supported(0, 10, 0.003), supported(10, 40, 0.005)])
    np.testing.assert_allclose(whole.support.t, np.arange(0.5, 40))
    np.testing.assert_allclose(whole.support.sigma_m, [0.003] * 10 + [0.005] * 30)
    assert whole.support.points.sum() == 280 and (whole.support.strips[:, 0] == 1).all()
    assert whole.sigma_mm == pytest.approx(np.sqrt((9 + 3 * 25) / 4))
    assert whole.sigmaz_mm == pytest.approx(2 * np.sqrt((9 + 3 * 25) / 4))
    marked = united([supported(0, 10, 0.003, 2.0), supported(10, 40, 0.005)])
    assert marked.support.strips[9].tolist() == [2.0] * 3 and marked.support.strips[10, 0] == 1.0
    partly = united([supported(0, 10, 0.003), piece(10, 20)])
    assert partly.support is None and partly.sigma_mm == 2.0
    empty = Support.of_one_strip(*np.empty((3, 0)))
    assert united([replace(piece(0, 10), support=empty), replace(piece(10, 20), support=empty)]).sigma_mm == 2.0


SIZE = TrackSize(SPACING_M, SPACING_M / (1 + BASE_RATIO))
SIDE = 640


def way(*corners, step_m=0.1):
    """A line through corners with vertices every 0.1 m."""
    corners = np.array(corners, dtype=float)
    along = length_along(corners)
    return interpolate(corners, along, np.arange(0, along[-1] + step_m / 2, step_m))


@pytest.mark.parametrize("line", [way([0, 0], [30, 0]), way([0, 0], [0.4, 0]), arc(20.0, 15.0), arc(-8.0, 15.0)])
def test_what_a_rail_can_do_stays(line):
    assert parts_without_turns(line, 1.0, 0.1) == [(0.0, pytest.approx(length_along(line)[-1]))]


def test_stairs_of_a_line_that_is_hardly_smoothed_are_no_turn():
    x = np.arange(0, 20, 0.04)
    stairs = np.column_stack([x, np.round(0.1 * x / 0.02) * 0.02])
    assert len(parts_without_turns(stairs, 1.0, 0.5)) == 1
    assert len(parts_without_turns(stairs, 1.0, 0.1)) != 1


@pytest.mark.parametrize("gaps", [[[3.0, 5.0], [28.0, 29.0]]])
def test_rails_with_a_corner_are_split_and_said(gaps):
    line = way([0, 0], [20, 0], [20, 10])
    xyz = np.column_stack([line, np.zeros(len(line))])
    t = np.arange(0.125, 30, 0.25)
    support = Support.of_one_strip(t, np.full(len(t), 10), np.where(t < 20, 0.001, 0.004))
    rail = RailLine(xyz, 1, 10, 1200, 20.0, 2.0, 3.0, np.array(gaps), support)
    heard = Heard()
    one, other = finished([rail], Parameters(1.435, 0.072), heard)
    assert one.length_m + other.length_m == pytest.approx(28.9, abs=0.2)
    assert (one.bridged_m, other.bridged_m) == (pytest.approx(2.0), pytest.approx(1.0))
    assert (one.sigma_mm, other.sigma_mm) == (pytest.approx(1.0), pytest.approx(4.0))
    assert one.points + other.points == pytest.approx(1200, rel=0.05)
    (warning,) = heard.warnings
    assert warning.startswith("1 rail bends by more than 10° within a metre")


def damaged(layout, seed):
    """Draw a layout with an open blade next to a rail, a slip between two rails, holes and blots."""
    rng = np.random.default_rng(seed)
    half = SIDE * CELL_M / 2
    window, label = Window(SIDE, CELL_M, -half, half), np.zeros((SIDE, SIDE), dtype=bool)
    heading = rng.uniform(0, 2 * np.pi)
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    for rail in layout.rails:
        xy, normal = (rail.xy - layout.spots[0]) @ turn, rail.normal @ turn
        draw_label(label, window, xy, normal, SIZE.head_width_m)
        inside = np.flatnonzero((np.abs(xy) < half).all(axis=1))
        if len(inside) > 1000 and rng.random() < 0.7:
            first = rng.choice(inside[:-500])
            t = 0.02 * np.arange(min(700, len(xy) - first))[:, None]
            apart = rng.choice([0.06, 0.1, 0.14]) + t**2 / rng.choice([380.0, 600.0]) * rng.choice([0, 1])
            part = slice(first, first + len(t))
            draw_label(label, window, xy[part] + rng.choice([-1, 1]) * apart * normal[part], normal[part], 0.04)
    rows, columns = np.nonzero(label)
    for _ in range(len(rows) // 400):
        row, column = rows[(number := rng.integers(len(rows)))], columns[number]
        size = rng.integers(1, 12)
        label[max(row - size, 0) : row + size, max(column - size, 0) : column + size] = rng.random() < 0.3
    rows, columns = np.nonzero(label)
    return np.column_stack([window.x0 + (columns + 0.5) * CELL_M, window.y0 - (rows + 0.5) * CELL_M])


@settings(max_examples=12, derandomize=True)
@given(st.integers(0, 2**31))
def test_no_line_of_a_damaged_network_turns_as_no_rail_can(seed):
    layout = random_layout(np.random.default_rng(seed), SIZE)
    raster = rasterize(damaged(layout, seed), CELL_M)
    rails = lines_of(raster, 10, None, Parameters(1.435, SIZE.head_width_m))
    # The angle is measured from other stations here, and simplified lines have corners of a degree.
    assert all(len(parts_without_turns(rail.xyz[:, :2], 0.0, 0.1, MAX_TURN_DEG + 1.5)) == 1 for rail in rails)


def test_lines_keep_the_vertices_in_which_others_end():
    main = rail_of(arc(300.0, 60.0, 0.05)).xyz
    branch = main[517] + np.column_stack([np.arange(20.0), 0.02 * np.arange(20.0) ** 2, np.zeros(20)])
    alone = thin([rail_of(main)], 0.002, 0.002)[0].xyz
    thinned, other = (line.xyz for line in thin([rail_of(main), rail_of(branch)], 0.002, 0.002))
    assert not (alone == main[517]).all(axis=1).any()
    assert (thinned == other[0]).all(axis=1).any()
    assert len(thinned) <= len(alone) + 2


@pytest.mark.parametrize("radius", [25.0, 190.0, 1200.0])
def test_thinned_curves_neither_shrink_nor_shift(radius):
    """Chords between vertices of the curve would be inside it, by 1.3 mm on average."""
    (line,) = thin([rail_of(arc(radius, 60.0, 0.01))], 0.002, 0.002)
    at = np.linspace(0, len(line.xyz) - 1, 20_001)
    x, y = (np.interp(at, np.arange(len(line.xyz)), column) for column in line.xyz.T[:2])
    weight = np.hypot(np.gradient(x), np.gradient(y))
    off = np.hypot(x, y - radius) - radius
    assert abs(np.average(off, weights=weight)) < 0.0001
    assert np.abs(off).max() < 0.002


@given(st.integers(0, 10**6), st.floats(1e-3, 0.3), st.floats(1e-3, 0.3))
@settings(max_examples=25, deadline=None)
def test_simplified_lines_keep_both_tolerances(seed, tolerance_xy, tolerance_z):
    random = np.random.default_rng(seed)
    line = np.cumsum(random.normal(size=(60, 3)) * 0.3 + [0.5, 0, 0], axis=0)
    kept = np.flatnonzero(essential_vertices(line, tolerance_xy, tolerance_z)).tolist()
    assert kept[0] == 0
    assert kept[-1] == 59
    for first, last in zip(kept[:-1], kept[1:]):
        chord = line[last] - line[first]
        for vertex in line[first : last + 1]:
            share = np.clip((vertex - line[first])[:2] @ chord[:2] / (chord[:2] @ chord[:2]), 0, 1)
            off = vertex - line[first] - share * chord
            assert np.hypot(*off[:2]) <= tolerance_xy + 1e-12
            assert abs(off[2]) <= tolerance_z + 1e-12


def test_height_counts_on_its_own_and_plan_without_height():
    hump = np.column_stack([np.arange(5.0), np.zeros(5), [0, 0, 0.01, 0, 0]])
    assert essential_vertices(hump, 0.002, 0.002).sum() > 2
    assert essential_vertices(hump, 0.002, 0.02).sum() == 2
    hump[:, 2] = np.nan
    assert essential_vertices(hump, 0.002, 0.002).sum() == 2
    hump[2, 1] = 0.01
    assert essential_vertices(hump, 0.002, 0.002).sum() == 5


def test_a_tolerance_of_zero_drops_only_vertices_on_the_line():
    assert essential_vertices(rail_of(arc(25, 90.0, 3.0)).xyz, 0.0, 0.0).all()
    straight = np.column_stack([np.arange(9.0), np.zeros(9), np.zeros(9)])
    assert essential_vertices(straight, 0.0, 0.0).sum() == 2
