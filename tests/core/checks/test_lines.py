"""Rails of no track, and lines that are too high or too low to be rails."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.checks.lines import with_tracks
from rail_extract.core.progress import Progress
from rail_extract.core.rails import Centerline, RailLine
from rail_extract.laboratory.curves import Element, trace

CURVE = trace([Element(60.0, 1 / 400, 1 / 400)], heading=0.4)
HEIGHT = 0.01 * CURVE.chainage


def line(left_m, up_m, part=slice(None, None, 10)):
    return np.column_stack([CURVE.offset(left_m), HEIGHT + up_m])[part]


def rail(number, xyz):
    return RailLine(xyz, number, 10, points=100, resid_mm=20.0, sigma_mm=1.0, bridged_m=0.0)


def track(number, left, right):
    return Centerline(line(0.0, 0.0), number, 10, (left,), (right,), 1435.0, 1.0, 0.0, 0.0, 0.0)


class Heard(Progress):
    def __init__(self):
        self.warnings = []

    def warning(self, text):
        self.warnings.append(text)


def found(*others):
    """What is kept of lines next to a track of the rails 1 and 3, and what is said; the others are 2, 4, 5 …"""
    rails = [rail(1, line(0.75, 0.0)), rail(2, others[0]), rail(3, line(-0.75, 0.0))]
    rails += [rail(number, other) for number, other in enumerate(others[1:], start=4)]
    heard = Heard()
    return with_tracks(rails, [track(7, 1, 3)], heard), heard.warnings


@pytest.mark.parametrize(
    ("left_m", "up_m"),
    [(-1.65, 0.55), (-1.65, 0.38), (3.0, 1.2), (0.0, 5.3), (4.5, 5.3), (8.0, 5.3), (0.3, -0.4)],
)
def test_platforms_fences_and_wires_are_left_out(left_m, up_m):
    kept, (said,) = found(line(left_m, up_m))
    assert said.startswith("1 line (") and "left out: too high or too low" in said
    assert float(said.partition("(")[2].partition("(")[2].partition(" m")[0]) == pytest.approx(up_m, abs=0.07)
    assert [one.rail_id for one in kept] == [1, 3]


@pytest.mark.parametrize(
    ("left_m", "up_m"),
    [(1.16, 0.08), (0.05, 0.12), (-1.3, 0.15), (4.5, 0.8), (4.5, -1.2), (12.0, 5.0), (0.5, 0.0), (1.2, np.nan)],
)
def test_what_may_be_a_rail_stays_without_a_track(left_m, up_m):
    kept, said = found(line(left_m, up_m))
    assert not said
    assert [one.track_ids for one in kept] == [(7,), (), (7,)]


def test_rails_of_a_bridge_that_crosses_above_stay():
    crossing = trace([Element(40.0)], (10.0, -15.0), heading=1.6)
    over = np.column_stack([crossing.xy[::10], np.full(len(crossing.xy[::10]), 6.0)])
    assert not found(over)[1]


def test_a_wire_that_begins_next_to_a_track_and_leaves_it_is_judged_where_they_run_together():
    assert found(line(0.2, 5.3))[1]
    away = line(0.2, 5.3) + np.linspace(0, 1, len(line(0.2, 5.3)))[:, None] * [0, 60, 0]
    assert not found(away)[1]


def test_a_rail_of_two_tracks_states_both():
    rails = [rail(number, line(left_m, 0.0)) for number, left_m in ((1, 0.75), (2, -0.75), (3, -0.4))]
    kept = with_tracks(rails, [track(1, 1, 2), replace(track(2, 1, 3), left_ids=(1, 1))])
    assert [one.track_ids for one in kept] == [(1, 2), (1,), (2,)]


def test_what_is_left_out_is_said():
    rails = [rail(1, line(0.75, 0)), rail(2, line(-0.75, 0)), rail(3, line(-1.65, 0.55)), rail(4, line(0.2, 5.3))]
    heard = Heard()
    kept = with_tracks(rails, [track(1, 1, 2)], heard)
    assert len(kept) == 2
    (warning,) = heard.warnings
    assert warning.startswith("2 lines (120 m) left out: too high or too low")
    assert "(+0.5 m, +5.3 m)" in warning or "(+0.6 m, +5.3 m)" in warning
    with_tracks(rails[:2], [track(1, 1, 2)], heard)
    assert len(heard.warnings) == 1
