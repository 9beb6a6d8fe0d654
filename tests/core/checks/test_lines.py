"""Rails of no track, lines that are too high or too low to be rails, and lines that smoothing displaces."""

from dataclasses import replace

import numpy as np
import pytest
from built import centerline_of, rails_of
from heard import Heard
from rail_extract.core.checks.lines import displacement, warn_of_blunt_lines, warn_of_rails, with_tracks
from rail_extract.core.parameters import Parameters
from rail_extract.laboratory.curves import Element, trace

CURVE = trace([Element(60.0, 1 / 400, 1 / 400)], heading=0.4)
HEIGHT = 0.01 * CURVE.chainage


def line(left_m, up_m, part=slice(None, None, 10)):
    return np.column_stack([CURVE.offset(left_m), HEIGHT + up_m])[part]


def track(track_id, right):
    return centerline_of(line(0.0, 0.0), track_id, (1,), (right,))


def found(*others):
    """What is kept of lines next to a track of the rails 1 and 3, and what is said; the others are 2, 4, 5 …"""
    rails = rails_of(line(0.75, 0.0), others[0], line(-0.75, 0.0), *others[1:])
    heard = Heard()
    return with_tracks(rails, [track(7, 3)], heard), heard.warnings


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
    rails = rails_of(*(line(left_m, 0.0) for left_m in (0.75, -0.75, -0.4)))
    kept = with_tracks(rails, [track(1, 2), replace(track(2, 3), left_ids=(1, 1))])
    assert [one.track_ids for one in kept] == [(1, 2), (1,), (2,)]


def arc(radius_m, length_m=40.0):
    angle = np.linspace(0, length_m / radius_m, 400)
    return radius_m * np.column_stack([np.sin(angle), 1 - np.cos(angle)])


def warned(line, smoothing_m):
    heard = Heard()
    warn_of_rails(rails_of(line), 10, Parameters(1.435, 0.072, smoothing_xy_m=smoothing_m), heard)
    return heard.warnings


@pytest.mark.parametrize(("radius_m", "sigma_m"), [(25, 1.0), (60, 2.0), (300, 3.0)])
def test_a_line_that_ends_in_an_arc_is_displaced_in_proportion_to_sigma_squared(radius_m, sigma_m):
    assert displacement(arc(radius_m), sigma_m) == pytest.approx(0.26 * sigma_m**2 / radius_m, rel=0.03)


def test_a_ring_has_no_end():
    assert displacement(arc(25.0, 2 * np.pi * 25.0), 2.0) == pytest.approx(1.8 * 2.0**4 / 25.0**3, abs=5e-4)


def test_three_metres_are_too_much_in_a_tram_curve():
    assert warned(arc(25.0), 3.0) == [
        "SMOOTHING_XY of 3 m displaces lines in curves by up to 98 mm, more than points can correct: "
        "set it to 1.8 m or less."
    ]
    assert warned(arc(25.0), 1.8) == []


def test_three_metres_do_no_harm_on_a_main_line():
    assert warned(arc(300.0, 200.0), 3.0) == []


def test_a_corner_that_no_rail_has_does_not_cause_a_warning_about_the_default():
    corner = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
    assert displacement(corner, 0.8) > 0.1
    assert warned(corner, 0.8) == []


def test_the_user_is_told_how_much_only_blunt_points_show():
    heard = Heard()
    warn_of_blunt_lines([], heard)
    assert not heard.warnings
    warn_of_blunt_lines(rails_of(line(0.75, 0.0), line(-0.75, 0.0)), heard)
    assert len(heard.warnings) == 1 and "on 120 m" in heard.warnings[0]
