"""Warnings: of points, before anything is computed, and of lines that do not look like rails."""

from dataclasses import replace

import numpy as np
import pytest
from built import arc, centerline_of, rail_of, rails_of, source_of
from heard import Heard
from rail_extract.core.checks.warnings import (
    displacement,
    plausible,
    warn_of_airborne,
    warn_of_blunt_lines,
    warn_of_rails,
    warn_of_unexplained,
    with_tracks,
)
from rail_extract.core.errors import CloudError
from rail_extract.core.parameters import Parameters
from rail_extract.core.tiles.grid import MIN_IN_WINDOW, WINDOW_M, lay_out, occupied_squares
from rail_extract.laboratory.curves import Element, trace

RNG = np.random.default_rng(4)

CURVE = trace([Element(60.0, 1 / 400, 1 / 400)], heading=0.4)
HEIGHT = 0.01 * CURVE.chainage


def rail(start_m=0.0, length_m=100.0, per_metre=20, y_m=7.0):
    """The sparsest rail: points anywhere on its head."""
    count = int(length_m * per_metre)
    return np.column_stack(
        [start_m + RNG.uniform(0, length_m, count), y_m + RNG.uniform(-0.036, 0.036, count), np.zeros(count)]
    )


def strays(count, side_m=1e6):
    return np.column_stack([RNG.uniform(-side_m / 2, side_m / 2, (count, 2)), np.zeros(count)])


def test_the_sparsest_rail_among_strays_is_plausible():
    one = source_of(rail(length_m=20.0), strays(5_000))
    assert plausible([one]) == [one]


@pytest.mark.parametrize("factor", [100, 1000])
@pytest.mark.parametrize("per_metre", [20, 600])
def test_points_in_a_smaller_unit_are_refused(factor, per_metre):
    with pytest.raises(CloudError, match=r"class 10 are \S+ m apart over \d+ m, .*centimetres or millimetres"):
        plausible([source_of(rail(per_metre=per_metre) * factor)])


def test_the_spacing_is_that_of_the_points():
    line = np.column_stack([np.arange(0, 1000, 2.8), np.zeros(358), np.zeros(358)])
    with pytest.raises(CloudError, match=r"are 2\.8 m apart over 1000 m"):
        plausible([source_of(line)])


def test_a_thin_class_beside_a_plausible_one_is_left_out_with_a_warning():
    heard, good, thin = Heard(), source_of(rail()), source_of(rail() * 100, code=11)
    assert plausible([thin, good], heard) == [good]
    (said,) = heard.warnings
    assert said.startswith("The points of class 11 are ")


def test_points_in_a_larger_unit_give_a_warning():
    heard, one = Heard(), source_of(rail(per_metre=600) / 1000)
    assert plausible([one], heard) == [one]
    (said,) = heard.warnings
    assert said.startswith("All points of class 10 are within 0.1 m of each other: if the coordinates")


def test_few_points_are_not_judged():
    one = source_of(strays(50))
    assert plausible([one]) == [one]


def test_squares_of_strays_are_left_out_and_squares_of_rails_are_kept():
    one = source_of(rail(length_m=1200.0), strays(5_000))
    kept = {square.key for square in occupied_squares([one], one)}
    assert kept == {(0, 0), (1, 0), (2, 0)}
    assert len(lay_out([one], one)) > 4_000


def test_a_square_into_which_a_rail_reaches_is_kept():
    end = rail(start_m=400.0, length_m=100.2)
    assert 0 < np.count_nonzero(end[:, 0] >= 500.0) < MIN_IN_WINDOW
    one = source_of(end, rail(start_m=-600.0, length_m=10.0))
    assert (1, 0) in {square.key for square in occupied_squares([one], one)}


def test_points_with_company_across_a_corner_are_no_strays():
    corner = np.array([500.0, 500.0, 0.0])
    shifts = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    heap = np.column_stack([np.repeat(shifts, 3, axis=0), np.zeros(12)]) * (WINDOW_M / 2)
    one = source_of(corner + heap, np.array([[5_000.0, 0.0, 0.0]]))
    assert {square.key for square in occupied_squares([one], one)} == {(0, 0), (0, 1), (1, 0), (1, 1)}
    less = source_of(corner + heap[: MIN_IN_WINDOW - 1], np.array([[5_000.0, 0.0, 0.0]]))
    assert not occupied_squares([less], less)


def test_a_cloud_within_one_square_is_never_divided():
    one = source_of(strays(20, side_m=100.0))
    (whole,) = occupied_squares([one], one)
    assert whole.is_whole_plane


@pytest.mark.parametrize("length_m", [100.0, 700.0])
@pytest.mark.parametrize(("others", "said"), [(0, None), (1, None), (2, "33 %"), (4, "20 %")])
def test_points_far_from_all_rails_give_a_warning(others, said, length_m):
    one = source_of(*(rail(y_m=7.0 + 0.5 * number, length_m=length_m) for number in range(others + 1)))
    heard = Heard()
    warn_of_unexplained(one, [rail_of([[0.0, 7.1], [length_m, 7.1]])], heard)
    assert [text[5:9] for text in heard.warnings] == [said] * bool(said)


@pytest.mark.parametrize(("per_metre", "said"), [(3, "have 3.0 points per metre"), (9, "have 9.0 points"), (20, "")])
def test_rails_of_an_airborne_cloud_give_a_warning(per_metre, said):
    heard = Heard()
    warn_of_airborne(source_of(rail(per_metre=per_metre)), [rail_of([[0.0, 7.0], [100.0, 7.0]])], heard)
    assert len(heard.warnings) == bool(said)
    assert all(said in text and "use Track Centerlines from Airborne Lidar" in text for text in heard.warnings)


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
    [(-1.65, 0.55), (-1.65, 0.38), (3.0, 1.2), (0.0, 5.3), (4.5, 5.3), (8.0, 5.3), (0.3, -0.4), (4.2, -0.8)],
)
def test_platforms_fences_and_wires_are_left_out(left_m, up_m):
    kept, (said,) = found(line(left_m, up_m))
    assert said.startswith("1 line (") and "left out: too high or too low" in said
    assert float(said.partition("(")[2].partition("(")[2].partition(" m")[0]) == pytest.approx(up_m, abs=0.07)
    assert [one.rail_id for one in kept] == [1, 3]


@pytest.mark.parametrize(
    ("left_m", "up_m"),
    [
        *[(1.16, 0.08), (0.05, 0.12), (-1.3, 0.15), (4.2, -0.25), (5.5, 0.8), (6.0, -1.2), (12.0, 5.0), (0.5, 0.0)],
        (1.2, np.nan),
    ],
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


def warned(line, smoothing_m):
    heard = Heard()
    warn_of_rails(rails_of(line), 10, Parameters(1.435, 0.072, smoothing_xy_m=smoothing_m), heard)
    return heard.warnings


@pytest.mark.parametrize(("radius_m", "sigma_m"), [(25, 1.0), (60, 2.0), (300, 3.0)])
def test_a_line_that_ends_in_an_arc_is_displaced_in_proportion_to_sigma_squared(radius_m, sigma_m):
    assert displacement(arc(radius_m, 40.0), sigma_m) == pytest.approx(0.26 * sigma_m**2 / radius_m, rel=0.03)


def test_a_ring_has_no_end():
    assert displacement(arc(25.0, 2 * np.pi * 25.0), 2.0) == pytest.approx(1.8 * 2.0**4 / 25.0**3, abs=5e-4)


def test_three_metres_are_too_much_in_a_tram_curve():
    assert warned(arc(25.0, 40.0), 3.0) == [
        "SMOOTHING_XY of 3 m displaces lines in curves by up to 98 mm, more than points can correct: "
        "set it to 1.8 m or less."
    ]
    assert warned(arc(25.0, 40.0), 1.8) == []


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
