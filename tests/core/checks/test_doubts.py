"""Steps of tracks to the side, strips, and errors of rails that only the gauge of their track shows."""

from dataclasses import replace

import numpy as np
import pytest
from built import centerline_of, rail_of, support_of
from rail_extract.core.checks.doubts import (
    doubting_jumps,
    doubting_scatter,
    find_jumps,
    gauge_scatter,
)
from rail_extract.laboratory.curves import Element, trace, transition_curve


def stepped(curve, at_m, step_m):
    """Return a line along a curve that moves to the left by a step, drawn 2 m long."""
    share = 1 / (1 + np.exp(-4 * (curve.chainage - at_m)))
    return curve.xy + (step_m * share)[:, None] * curve.left_normal


def track(line, *sides):
    return centerline_of(np.column_stack([line, np.zeros(len(line))]), 1, *(sides or ((), ())))


def rail(number, line):
    return rail_of(line, number, points=800, sigma_mm=1.0, support=support_of(80.0))


def beside(curve, left_m):
    return replace(curve, xy=curve.xy + left_m * curve.left_normal)


@pytest.mark.parametrize("step_m", [0.03, -0.015])
@pytest.mark.parametrize("radius_m", [300.0, 3000.0])
def test_a_step_is_found_with_its_size(step_m, radius_m):
    curve = trace([Element(80.0, 1 / radius_m, 1 / radius_m)], heading=0.7)
    ((at_m, found_m),) = find_jumps(track(stepped(curve, 33.0, step_m)), ())
    assert at_m == pytest.approx(33.0, abs=0.3)
    assert found_m == pytest.approx(step_m, rel=0.06)


@pytest.mark.parametrize(
    "elements",
    [
        [Element(40.0), Element(30.0, 1 / 190, 1 / 190), Element(30.0)],
        transition_curve(15, 6, 38, 1 / 30),
        transition_curve(10, 25, 20, 1 / 250),
    ],
)
def test_what_tracks_do_is_no_step(elements):
    rng = np.random.RandomState(0)
    curve = trace(elements, heading=2.0)
    wave = 0.001 * np.sin(curve.chainage * 2 * np.pi / rng.uniform(4, 20))
    assert find_jumps(track(curve.xy + wave[:, None] * curve.left_normal), ()) == []
    assert find_jumps(track(curve.xy[:20]), ()) == []


def test_half_of_a_step_is_in_doubt_on_either_side():
    curve = trace([Element(80.0, 1 / 800, 1 / 800)], heading=0.3)
    middle, left, right = (stepped(beside(curve, left_m), 33.0, 0.03) for left_m in (0.0, 0.75, -0.75))
    rails = [rail(1, left), rail(2, right[::-1]), rail(3, left)]
    *doubted, kept = doubting_jumps(rails, [track(middle, (1,), (2,))])
    for one in doubted:
        assert np.allclose(one.support.sigma_m, np.hypot(0.001, 0.015), rtol=0.06)
        assert np.allclose(one.support.strips[:, 1], 0.03, rtol=0.06)
        assert one.sigma_mm == pytest.approx(15.0, rel=0.06)
    assert kept is rails[2]


@pytest.mark.parametrize("other_m", [0.0, -0.03])
def test_a_track_does_not_step_where_one_of_its_rails_does_not(other_m):
    curve = trace([Element(80.0, 1 / 800, 1 / 800)], heading=0.3)
    rails = [rail(1, stepped(beside(curve, 0.75), 33.0, 0.04)), rail(2, stepped(beside(curve, -0.75), 33.0, other_m))]
    middle = stepped(curve, 33.0, 0.02)
    one = track(middle, (1,), (2,))
    assert find_jumps(track(middle), ()) and not find_jumps(one, rails)
    assert doubting_jumps(rails, [one]) == rails


@pytest.mark.parametrize(("sigma_m", "steps"), [(0.001, 1), (0.006, 0)])
def test_both_rails_show_a_step_that_the_centerline_hides_unless_it_is_chance(sigma_m, steps):
    curve = trace([Element(80.0, 1 / 400, 1 / 400)], heading=1.2)
    rails = [rail(number, stepped(beside(curve, left_m), 40.0, 0.012)) for number, left_m in ((1, 0.75), (2, -0.75))]
    rails = [replace(one, support=replace(one.support, sigma_m=0 * one.support.sigma_m + sigma_m)) for one in rails]
    smooth = track(curve.xy, (1,), (2,))
    found = find_jumps(smooth, rails)
    assert len(found) == steps
    assert all(at_m == pytest.approx(40, abs=0.5) and size_m == pytest.approx(0.012, rel=0.1) for at_m, size_m in found)
    assert find_jumps(smooth, doubting_jumps(rails, [smooth])) == found


def test_an_abrupt_arc_is_no_step_of_two_rails():
    curve = trace([Element(40.0), Element(30.0, 1 / 60, 1 / 60)], heading=2.0)
    rails = [rail(number, beside(curve, left_m).xy) for number, left_m in ((1, 0.75), (2, -0.75))]
    assert find_jumps(track(curve.xy, (1,), (2,)), rails) == []


@pytest.mark.parametrize(("spread_m", "expected_m"), [(np.nan, 0.03), (0.02, 0.03), (0.05, 0.05)])
def test_the_spread_of_strips_is_at_least_the_step(spread_m, expected_m):
    curve = trace([Element(80.0, 1 / 800, 1 / 800)], heading=0.3)
    middle, left, right = (stepped(beside(curve, left_m), 33.0, 0.03) for left_m in (0.0, 0.75, -0.75))
    rails = [rail(1, left), rail(2, right)]
    strips = np.tile([2.0, spread_m, 0.004], (320, 1))
    rails = [replace(one, support=replace(one.support, strips=strips)) for one in rails]
    for one in doubting_jumps(rails, [track(middle, (1,), (2,))]):
        assert np.allclose(one.support.strips, [2.0, expected_m, np.hypot(0.004, 0.015)], rtol=0.06)


OWN_M = 0.002


def sure_rail(number):
    return rail_of([[0.0, 0.0], [80.0, 0.0]], number, sigma_mm=1000 * OWN_M, support=support_of(80.0, OWN_M))


def track_of(number, left, right, gaugesd_mm, length_m=80.0, gauge_mm=1435.0):
    return centerline_of([[0.0, 0, 0], [length_m, 0, 0]], number, (left,), (right,), gauge_mm, gaugesd_mm)


def scatter(rails, *tracks, gauges_m=(1.435,)):
    return gauge_scatter(rails, tracks, gauges_m)


def test_stated_errors_of_both_rails_add_up_to_the_scatter_of_their_gauge():
    rails = [sure_rail(1), sure_rail(2)]
    doubted = doubting_scatter(rails, scatter(rails, track_of(1, 1, 2, 9.0)))
    assert np.hypot(*(one.sigma_mm for one in doubted)) == pytest.approx(9.0)
    assert all(one.support.sigma_m == pytest.approx(0.009 / np.sqrt(2)) for one in doubted)


def test_a_gauge_within_the_stated_errors_and_a_lone_rail_change_nothing():
    rails = [sure_rail(1), sure_rail(2), sure_rail(3)]
    assert doubting_scatter(rails, scatter(rails, track_of(1, 1, 2, 2.8))) == rails
    assert doubting_scatter(rails, scatter(rails, track_of(1, 1, 2, 9.0)))[2] is rails[2]


def test_the_larger_scatter_counts_for_a_rail_of_two_tracks():
    rails = [sure_rail(1), sure_rail(2), sure_rail(3)]
    beyond = scatter(rails, track_of(1, 1, 2, 9.0), track_of(2, 1, 3, 5.0, gauge_mm=1000.0), gauges_m=(1.435, 1.0))
    assert beyond[1] == beyond[2] == pytest.approx(np.sqrt((81 - 8) / 2) / 1000)
    assert beyond[3] == pytest.approx(np.sqrt((25 - 8) / 2) / 1000)


def test_short_tracks_scatter_as_all_tracks_of_their_gauge_do():
    """Two short tracks of 1440 and 1430 mm and little scatter of their own, and one of another gauge."""
    tracks = (
        track_of(1, 1, 2, 1.0, 20.0, 1440.0),
        track_of(2, 3, 4, 7.0, 20.0, 1430.0),
        track_of(3, 5, 6, 2.0, 20.0, 1000.0),
    )
    beyond = scatter([sure_rail(number) for number in range(1, 7)], *tracks, gauges_m=(1.435, 1.0))
    whole_mm2 = (1 + 49) / 2 + 25
    assert beyond[1] == beyond[2] == pytest.approx(np.sqrt(((1 + whole_mm2) / 2 - 8) / 2) / 1000)
    assert beyond[3] == beyond[4] == pytest.approx(np.sqrt(((49 + whole_mm2) / 2 - 8) / 2) / 1000)
    assert beyond[5] == beyond[6] == 0.0


def test_a_long_track_tells_its_own_scatter():
    """And a track that scatters by more than the others is not taken for better than it looks."""
    rails = [sure_rail(number) for number in range(1, 5)]
    beyond = scatter(rails, track_of(1, 1, 2, 9.0, 3000.0), track_of(2, 3, 4, 4.0, 3000.0))
    assert beyond[1] == pytest.approx(np.sqrt((81 - 8) / 2) / 1000)
    assert beyond[3] == pytest.approx(np.sqrt((16 - 8) / 2) / 1000, rel=0.02)
