"""Seams: the parts of a line in several squares become that line again, without a step."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from rail_extract.core.frame import LocalFrame
from rail_extract.core.polyline import length_along, project
from rail_extract.core.rails import RailLine, Support
from rail_extract.core.squares.seams import join, trim
from rail_extract.core.tiles.grid import HALO_M, Square, Tiling

SIDE, REACH = 40.0, 20.0
FRAME = LocalFrame(np.zeros(3))
STEP_M = 0.2
"""Spacing of the vertices of a true line."""


def rail(xyz, gaps=()):
    """A rail with ten points per station."""
    length = length_along(xyz[:, :2])[-1]
    t = np.arange(0.125, length, 0.25)
    support = Support.of_one_strip(t, np.full(len(t), 10), np.full(len(t), 0.001))
    gaps = np.array(gaps, dtype=float).reshape(-1, 2)
    return RailLine(xyz, 0, 10, 10 * len(t), 2.0, 1.0, float(np.sum(np.diff(gaps))), gaps, support)


def seen_by_squares(lines, error_m=0.0):
    """The lines that each square would find: the true lines around it, with a small error and cut at REACH."""
    keys = {key for line in lines for key in Tiling(SIDE).keys(line.xyz)[0]}
    results = []
    for key in sorted(keys):
        square = Square.on_grid(key, SIDE, FRAME)
        found = []
        for line in lines:
            inside = square.holds(line.xyz - square.frame.shift_to(FRAME), REACH)
            edges = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
            along = length_along(line.xyz[:, :2])
            for first, after in edges.reshape(-1, 2):
                if after - first > 2:
                    part = line.between(along[first], along[after - 1])
                    beside = error_m * np.array([np.sin(17 * key[0] + key[1]), np.cos(5 * key[1] + key[0]), 0.3])
                    found.append(part.reversed() if (key[0] + key[1]) % 2 else part)
                    found[-1] = moved(found[-1], beside - square.frame.shift_to(FRAME))
        results.append(trim(found, square))
    return results


def moved(line, by):
    return RailLine(line.xyz + by, 0, 10, line.points, line.resid_mm, line.sigma_mm, 0.0, line.gaps, line.support)


def curve(heading, bend, length=190.0, start=(3.0, 5.0)):
    s = np.arange(0.0, length, STEP_M)
    angle = heading + bend * s
    xy = np.array(start) + STEP_M * np.column_stack([np.cumsum(np.cos(angle)), np.cumsum(np.sin(angle))])
    return np.column_stack([xy, 0.01 * s])


def step(line, bend):
    """Largest deviation of a vertex from the curve through its neighbours, which may be far apart: seams drop some."""
    before, after = np.diff(line.line.t)[:-1, None], np.diff(line.line.t)[1:, None]
    off = line.xyz[1:-1] - (after * line.xyz[:-2] + before * line.xyz[2:]) / (before + after)
    sagitta = 0.5 * abs(bend) * before * after
    return np.maximum(np.linalg.norm(off, axis=1) - sagitta[:, 0], 0.0).max()


@settings(deadline=None, max_examples=12)
@given(st.floats(-3.1, 3.1), st.floats(-0.012, 0.012))
def test_one_line_comes_back_whole(heading, bend):
    true = rail(curve(heading, bend))
    (line,) = join(seen_by_squares([true]), FRAME)
    assert line.length_m == pytest.approx(true.length_m, abs=1e-3)
    rise = abs(bend) * (3 * STEP_M) ** 2 / 8  # of a chord: a seam may leave out two vertices
    assert np.abs(project([true.xyz[:, :2]], line.xyz[:, :2], 1.0).across).max() < 1e-5 + rise
    assert line.points == pytest.approx(true.points, rel=0.01)
    assert line.sigma_mm == pytest.approx(1.0) and line.resid_mm == pytest.approx(2.0)


@settings(deadline=None, max_examples=12)
@given(st.floats(-3.1, 3.1), st.floats(-0.012, 0.012))
@example(-1.1015625, 0.0108)  # two vertices are left out
def test_where_squares_disagree_no_step_remains(heading, bend):
    true = rail(curve(heading, bend))
    (line,) = join(seen_by_squares([true], error_m=0.0008), FRAME)
    assert step(line, bend) < 2e-4
    assert np.abs(project([true.xyz[:, :2]], line.xyz[:, :2], 1.0).across).max() < 0.0015


@pytest.mark.parametrize("start", [(3.0, 5.0), (40.0, -11.0), (20.0, 20.0)])
def test_a_ring_comes_back_closed(start):
    length = 2 * np.pi * 45.0
    flat = curve(0.3, 1 / 45.0, length=length, start=start) * [1, 1, 0]
    true = rail(np.concatenate([flat, flat[:1]]))
    (line,) = join(seen_by_squares([true], error_m=0.0008), FRAME)
    np.testing.assert_array_equal(line.xyz[0], line.xyz[-1])
    assert line.length_m == pytest.approx(true.length_m, rel=1e-4)
    assert np.abs(project([true.xyz[:, :2]], line.xyz[:, :2], 1.0).across).max() < 0.0015
    assert line.points == pytest.approx(true.points, rel=0.01)


@pytest.mark.parametrize("offset", [-1e-9, 0.0, 0.3, HALO_M, HALO_M + 0.01])
def test_a_line_along_a_border_comes_back_whole(offset):
    s = np.arange(0.0, 190.0, 0.2)
    beside = SIDE + offset + 0.002 * np.sin(s / 3)
    true = rail(np.column_stack([s + 5, beside, np.full(len(s), 7.0)]))
    (line,) = join(seen_by_squares([true], error_m=0.001), FRAME)
    assert line.length_m == pytest.approx(true.length_m, abs=0.05)
    assert np.abs(project([true.xyz[:, :2]], line.xyz[:, :2], 1.0).across).max() < 0.002


def test_lines_side_by_side_and_across_stay_apart():
    tracks = [rail(curve(0.3, 0.004, start=(3.0, 5.0 + beside))) for beside in (0.0, 1.5)]
    crossing = rail(curve(1.4, 0.0, length=90.0, start=(60.0, -20.0)))
    lines = join(seen_by_squares([*tracks, crossing], error_m=0.001), FRAME)
    assert sorted(line.length_m for line in lines) == pytest.approx(
        sorted(line.length_m for line in (*tracks, crossing)), abs=0.05
    )


def test_a_branch_still_ends_on_the_line_it_left():
    through = curve(0.0, 0.0, start=(0.0, 5.0))
    for node in (150, 190, 199, 203, 215, 240):
        bend = np.cumsum(np.full(400, 0.2))
        branch = through[node] + np.column_stack([bend, bend**2 / 380, np.zeros(400)])
        branch = np.concatenate([through[node : node + 1], branch])
        lines = join(seen_by_squares([rail(through), rail(branch)], error_m=0.002), FRAME)
        assert len(lines) == 2
        short, long = sorted(lines, key=lambda line: line.length_m)
        ends = {tuple(end) for end in short.xyz[[0, -1], :2]}
        assert len(ends & set(map(tuple, long.xyz[:, :2]))) == 1


def test_gaps_are_counted_once():
    true = rail(curve(0.0, 0.0), gaps=[(10, 12), (33, 41), (70, 90)])
    (line,) = join(seen_by_squares([true]), FRAME)
    assert line.bridged_m == pytest.approx(30.0, abs=0.05)
    gaps = line.gaps if line.xyz[0, 0] < 20 else length_along(line.xyz[:, :2])[-1] - line.gaps[::-1, ::-1]
    np.testing.assert_allclose(gaps, true.gaps, atol=0.05)


def test_a_short_rail_across_a_border_comes_once():
    true = rail(curve(0.2, 0.0, length=3.0, start=(SIDE - 1.0, 5.0)))
    (line,) = join(seen_by_squares([true]), FRAME)
    assert line.length_m == pytest.approx(true.length_m, abs=1e-4)


def test_the_order_of_squares_does_not_matter():
    results = seen_by_squares([rail(curve(0.7, 0.01))], error_m=0.002)
    one, other = join(results, FRAME), join(results[::-1], FRAME)
    np.testing.assert_array_equal(one[0].xyz, other[0].xyz)
