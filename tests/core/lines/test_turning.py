"""Lines that turn too sharply for rails are split there."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.lines.network_smoothing import smooth_network
from rail_extract.core.lines.turning import MAX_TURN_DEG, parts_without_turns, turn_deg
from rail_extract.core.parameters import Parameters
from rail_extract.core.polyline import interpolate, length_along
from rail_extract.core.progress import Progress
from rail_extract.core.rails import RailLine, Support
from rail_extract.core.raster import rasterize
from rail_extract.core.steps import _finished, lines_of
from rail_extract.core.vectorize import vectorize
from rail_extract.laboratory.rasters.drawing import Window, draw_label
from rail_extract.laboratory.rasters.layouts import random_layout
from rail_extract.laboratory.rasters.pairs import BASE_RATIO, CELL_M, SPACING_M
from rail_extract.laboratory.rasters.paths import TrackSize

SIZE = TrackSize(SPACING_M, SPACING_M / (1 + BASE_RATIO))
SIDE = 640


def way(*corners, step_m=0.1):
    """A line through corners with vertices every 0.1 m."""
    corners = np.array(corners, dtype=float)
    along = length_along(corners)
    return interpolate(corners, along, np.arange(0, along[-1] + step_m / 2, step_m))


def arc(radius_m, length_m=15.0):
    t = np.arange(0, length_m, 0.1) / radius_m
    return radius_m * np.column_stack([np.sin(t), 1 - np.cos(t)])


@pytest.mark.parametrize("line", [way([0, 0], [30, 0]), way([0, 0], [0.4, 0]), arc(20.0), arc(-8.0)])
def test_what_a_rail_can_do_stays(line):
    assert parts_without_turns(line, 1.0, 0.8) == [(0.0, pytest.approx(length_along(line)[-1]))]


def test_stairs_of_a_line_that_is_hardly_smoothed_are_no_turn():
    x = np.arange(0, 20, 0.04)
    stairs = np.column_stack([x, np.round(0.1 * x / 0.02) * 0.02])
    assert len(parts_without_turns(stairs, 1.0, 0.1)) == 1
    assert len(parts_without_turns(stairs, 1.0, 0.8)) != 1


class Heard(Progress):
    def __init__(self):
        self.warnings = []

    def warning(self, text):
        self.warnings.append(text)


@pytest.mark.parametrize("gaps", [[[3.0, 5.0], [28.0, 29.0]]])
def test_rails_with_a_corner_are_split_and_said(gaps):
    line = way([0, 0], [20, 0], [20, 10])
    xyz = np.column_stack([line, np.zeros(len(line))])
    t = np.arange(0.125, 30, 0.25)
    support = Support(t, np.full(len(t), 10), np.where(t < 20, 0.001, 0.004))
    rail = RailLine(xyz, 1, 10, 1200, 20.0, 2.0, 3.0, np.array(gaps), support)
    heard = Heard()
    one, other = _finished([rail], Parameters(1.435, 0.072), 5, heard)
    assert (one.rail_id, other.rail_id) == (5, 6)
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
    assert all(turn_deg(rail.xyz[:, :2]) <= MAX_TURN_DEG + 1.5 for rail in rails)


@pytest.mark.parametrize("seed", [[77, 0]])
def test_no_crossing_is_drawn_back_along_its_legs(seed):
    """Without the last check: here a leg runs alongside the shared part, and the line turned by 180 degrees."""
    rng = np.random.default_rng(seed)
    layout = random_layout(rng, SIZE)
    heading, half = rng.uniform(0, 6.28), 768 * CELL_M / 2
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    window, label = Window(768, CELL_M, -half, half), np.zeros((768, 768), dtype=bool)
    for rail in layout.rails:
        draw_label(label, window, (rail.xy - layout.spots[0]) @ turn, rail.normal @ turn, SIZE.head_width_m)
    rows, columns = np.nonzero(label)
    places = np.column_stack([window.x0 + (columns + 0.5) * CELL_M, window.y0 - (rows + 0.5) * CELL_M])
    network = smooth_network(vectorize(rasterize(places, CELL_M), SIZE.head_width_m), 0.8)
    assert max(turn_deg(line) for line in network.lines) < MAX_TURN_DEG
