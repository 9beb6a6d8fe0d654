"""Closed lines: where they start, where they are closed, and their extension."""

import numpy as np
import pytest
from rail_extract.core.polyline import length_along
from rail_extract.core.rails import RailLine
from rail_extract.core.tracks.rings import MAX_SEAM_M, closed_centerline, extended_ring, started_abreast

RADIUS_M = 30.0


def ring(start=0.0, radius_m=RADIUS_M, turns=1.0, count=400):
    angle = start + np.linspace(0, 2 * np.pi * turns, count)
    xyz = np.column_stack([radius_m * np.cos(angle), radius_m * np.sin(angle), np.zeros(count)])
    if turns == 1.0:
        xyz[-1] = xyz[0]
    return xyz


def test_closed_rails_start_abreast():
    lines = [RailLine(xyz, 1, 10, 10, 1.0, 1.0, 0.0) for xyz in (ring(), ring(2.0, RADIUS_M + 1.5), ring()[:200])]
    first, second, open_line = started_abreast(lines)
    assert np.hypot(*(first.xyz[0] - second.xyz[0])[:2]) == pytest.approx(1.5, abs=0.002)
    assert second.length_m == pytest.approx(lines[1].length_m, abs=0.001)
    assert np.array_equal(second.xyz[0], second.xyz[-1])
    assert open_line is lines[2]


@pytest.mark.parametrize("turns", [1.001, 1.0, 0.999])
def test_a_centerline_is_closed_if_its_ends_are_close(turns):
    line = ring(turns=turns)
    closed = closed_centerline(line)
    assert np.array_equal(closed[0], closed[-1])
    assert np.array_equal(closed[0], line[0])
    steps = np.hypot(*np.diff(closed[:, :2], axis=0).T)
    assert (steps > 0).all()
    assert length_along(closed[:, :2])[-1] == pytest.approx(2 * np.pi * RADIUS_M, abs=0.05)
    apart = ring(turns=1 - 1.2 * MAX_SEAM_M / (2 * np.pi * RADIUS_M))
    assert closed_centerline(apart) is apart


def test_the_extension_of_a_ring_runs_on_along_it():
    line = ring()
    step_m = length_along(line[:, :2])[1]
    longer, before_m = extended_ring(line, 5.0)
    assert 5.0 <= before_m < 5.0 + step_m + 1e-9
    along = length_along(longer[:, :2])
    assert 5.0 <= along[-1] - before_m - length_along(line[:, :2])[-1] < 5.0 + step_m + 1e-9
    assert np.hypot(*np.diff(longer[:, :2], axis=0).T) == pytest.approx(step_m)
