"""Curves, turnouts and random layouts."""

import math

import numpy as np
import pytest
from rail_extract.laboratory.curves import Element, trace, transition_curve
from rail_extract.laboratory.rasters.alignments import MIN_RADIUS_M, bend, bent, random_alignment, shifted
from rail_extract.laboratory.rasters.fittings import FLANGEWAY_M, crossing
from rail_extract.laboratory.rasters.layouts import (
    BLADE_OPENING_M,
    FAMILIES,
    WEIGHTS,
    ladder,
    open_blade,
    random_layout,
    slip,
    third_rail_end,
)
from rail_extract.laboratory.rasters.paths import NO_TRACK, TrackSize, track
from rail_extract.laboratory.rasters.turnouts import FORMS, TurnoutForm, branch, crossover, turnout
from scipy.spatial import cKDTree
from scipy.special import fresnel

SIZE = TrackSize(1.5112, 0.0762)


def test_an_arc_closes_to_a_circle():
    circle = trace([Element(2 * math.pi * 190, 1 / 190, 1 / 190)], step_m=2 * math.pi * 190 / 10_000)
    assert np.abs(np.hypot(circle.xy[:, 0], circle.xy[:, 1] - 190) - 190).max() < 1e-9
    assert np.abs(circle.xy[-1]).max() < 1e-6


def test_a_clothoid_follows_the_fresnel_integrals():
    length, sharpness = 60.0, 1 / (300 * 60)
    curve = trace([Element(length, 0.0, length * sharpness)])
    scale = math.sqrt(math.pi / sharpness)
    sine, cosine = fresnel(curve.chainage / scale)
    assert np.abs(curve.xy - scale * np.column_stack([cosine, sine])).max() < 1e-8


def test_a_railway_curve_turns_by_arc_and_half_of_each_clothoid():
    curve = trace(transition_curve(20.0, 40.0, 100.0, 1 / 500))
    assert curve.heading[-1] == pytest.approx((100 + 40) / 500, abs=1e-4)
    assert curve.curvature.max() == pytest.approx(1 / 500)


def test_an_offset_is_along_the_normal():
    curve = trace([Element(50.0, 0.0, 1 / 200)])
    assert np.linalg.norm(curve.offset(0.75) - curve.xy, axis=1) == pytest.approx(0.75)
    side = np.cross(np.gradient(curve.xy, axis=0), curve.offset(0.75) - curve.xy)
    assert (side > 0).all()


def test_a_reversed_curve_runs_back_with_opposite_curvature():
    curve = trace([Element(30.0, 0.0, 1 / 100)], start=(3.0, 4.0), heading=1.0)
    back = curve.reversed()
    assert np.array_equal(back.xy[0], curve.xy[-1])
    step = back.xy[1] - back.xy[0]
    assert math.atan2(step[1], step[0]) == pytest.approx(math.remainder(back.heading[0], 2 * math.pi), abs=1e-3)
    assert back.curvature[0] == pytest.approx(-1 / 100)


def test_a_300_1_9_turnout_ends_where_its_tangent_says():
    form = next(form for form in FORMS if form.name == "300-1:9")
    main = trace([Element(80.0)])
    side = branch(main, 10.0, form, 1, 20.0)
    assert form.arc_m == pytest.approx(33.197, abs=0.001)
    assert side.heading[-1] == pytest.approx(math.atan(1 / 9), abs=1e-4)
    # the end of the arc follows from the tangent length t = R tan(alpha / 2) = 16.616 m
    end = side.xy[int(round(form.arc_m / side.step_m))] - main.xy[int(round(10.0 / main.step_m))]
    assert end == pytest.approx(
        [16.616 * (1 + math.cos(math.atan(1 / 9))), 16.616 * math.sin(math.atan(1 / 9))], abs=0.02
    )


def test_a_branch_in_a_curve_inherits_its_curvature():
    main = trace([Element(80.0, 1 / 500, 1 / 500)])
    side = branch(main, 10.0, TurnoutForm("test", 250.0, 20.0), -1, 10.0)
    assert side.curvature[0] == pytest.approx(1 / 500 - 1 / 250)
    assert np.array_equal(side.xy[0], main.xy[500])


def test_an_american_number_10_has_its_frog_where_its_lead_says():
    """The lead of a number 10, from the point of the switch to that of the frog, is about 78 ft 9 in."""
    form = next(form for form in FORMS if form.name == "#10")
    assert math.degrees(form.angle) == pytest.approx(5.7248, abs=1e-3)
    main = trace([Element(80.0)])
    side = branch(main, 0.0, form, 1, 20.0)
    at, _ = crossing(main.offset(SIZE.spacing_m / 2), side.offset(-SIZE.spacing_m / 2))
    assert at * main.step_m / 0.3048 == pytest.approx(78.75 + 0.0762 / math.tan(form.angle) / 0.3048, abs=1.5)


def test_a_bent_curve_keeps_its_distance_from_the_axis():
    axis = trace([Element(60.0, 1 / 200, 1 / 200)])
    side = bent(axis, trace([Element(30.0)], (10.0, 4.0)))
    assert np.hypot(side.xy[:, 0], side.xy[:, 1] - 200) == pytest.approx(196.0, abs=1e-4)
    assert side.heading == pytest.approx(axis.heading[500:2001], abs=1e-9)


def test_a_parallel_axis_has_the_parallel_radius():
    axis = shifted(trace([Element(60.0, 1 / 200, 1 / 200)]), 4.0)
    assert 1 / axis.curvature == pytest.approx(196.0)


def test_crossings_are_found_and_parallel_lines_have_none():
    along = np.linspace(0, 20, 1001)
    first = np.column_stack([along, np.zeros_like(along)])
    second = np.column_stack([along, 0.1 * (along - 12.0)])
    assert crossing(first, second) == (600, 600)
    assert crossing(first, first + [0.0, 1.5]) is None


@pytest.mark.parametrize("hand", [1, -1])
def test_a_crossover_leads_from_one_track_to_the_other(hand):
    axis = trace([Element(120.0, 1 / 400, 1 / 400)])
    form = next(form for form in FORMS if form.name == "190-1:9")
    layout = crossover(np.random.default_rng(0), axis, (0.0, 4.5 * hand), 60.0, form, SIZE)
    rails = [rail.xy for rail in layout.rails]
    first, second = (shifted(axis, offset) for offset in (0.0, 4.5 * hand))
    outer, inner = hand * SIZE.spacing_m / 2, -hand * SIZE.spacing_m / 2
    assert np.abs(cKDTree(first.offset(outer)).query(rails[0][:1])[0]).max() < 0.02
    assert np.abs(cKDTree(second.offset(inner)).query(rails[1][-1:])[0]).max() < 0.02
    assert len(layout.openings) == 2


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(4))
def test_the_rails_of_every_family_keep_to_their_tracks(family, seed):
    layout = random_layout(np.random.default_rng([seed, 1]), SIZE, family)
    assert layout.spots
    assert all(line.track == NO_TRACK for line in layout.distractors)
    for number in {rail.track for rail in layout.rails}:
        first, *others = (rail for rail in layout.rails if rail.track == number)
        apart = [cKDTree(first.xy).query(rail.xy[::10])[0] for rail in others]
        assert any(np.median(distance) == pytest.approx(SIZE.spacing_m, abs=0.001) for distance in apart)
    for rail in (*layout.rails, *layout.distractors):
        assert np.linalg.norm(rail.normal, axis=1) == pytest.approx(1.0)
        step = np.linalg.norm(np.diff(rail.xy, axis=0), axis=1)
        assert step.min() > 0.01 and step.max() < 0.03


def test_every_family_has_a_weight_and_all_are_drawn_at_random():
    assert list(WEIGHTS) == list(FAMILIES)
    counts = {len(random_layout(np.random.default_rng(seed), SIZE).rails) for seed in range(30)}
    assert len(counts) > 4


def test_openings_guard_rails_and_third_rails_are_in_some_families_only():
    def lay(family):
        return [random_layout(np.random.default_rng(seed), SIZE, family) for seed in range(8)]

    assert all(len(layout.rails) == 2 for layout in lay("plain"))
    assert all(len(layout.openings) == 4 for layout in lay("diamond"))
    assert all(
        len(layout.rails) == 3 and len({rail.track for rail in layout.rails}) == 1 for layout in lay("dual gauge")
    )
    assert all(len(layout.distractors) == 1 for layout in lay("buffer end"))
    assert all(len(layout.rails) >= 10 for layout in lay("yard"))
    assert any(layout.distractors for layout in lay("crossover"))


def test_the_branches_of_a_ladder_are_parallel():
    layout = ladder(np.random.default_rng(2), SIZE)
    headings = [np.arctan2(*(rail.xy[-1] - rail.xy[-2])[::-1]) for rail in layout.rails[2:]]
    assert len(headings) >= 4
    assert np.ptp(np.unwrap(headings)) < 1e-6


def test_guard_rails_leave_a_flangeway_inside_their_rail():
    main = trace([Element(100.0)])
    found = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        layout = turnout(rng, main, 20.0, FORMS[4], 1, SIZE)
        rails = [rail.xy for rail in (*track(main, SIZE).rails, *layout.rails)]
        for guard in layout.distractors:
            middle = guard.xy[len(guard.xy) // 2]
            found.append(min(np.linalg.norm(xy - middle, axis=1).min() for xy in rails) - SIZE.head_width_m)
    assert len(found) > 20
    assert min(found) > FLANGEWAY_M[0] - 0.003
    assert max(found) < FLANGEWAY_M[1] + 0.003


def test_rails_open_where_they_cross():
    layout = turnout(np.random.default_rng(0), trace([Element(100.0)]), 20.0, FORMS[4], 1, SIZE)
    ((centre, width_m),) = layout.openings
    inner = layout.rails[1].xy
    assert np.linalg.norm(inner - centre, axis=1).min() < 0.02
    assert 0.03 <= width_m <= 0.06


@pytest.mark.parametrize("seed", range(10))
def test_alignments_have_the_smallest_radius_or_a_larger_one(seed):
    rng = np.random.default_rng(seed)
    for alignment in (random_alignment(rng), bend(rng, MIN_RADIUS_M, (1, -1))):
        assert np.abs(alignment.curvature).max() <= 1 / MIN_RADIUS_M + 1e-12
        assert np.abs(np.diff(alignment.heading)).max() <= alignment.step_m / MIN_RADIUS_M + 1e-9


def test_a_reverse_curve_turns_both_ways():
    axis = bend(np.random.default_rng(1), 100.0, (1, -1))
    assert axis.curvature.max() > 1 / 150
    assert axis.curvature.min() < -1 / 150


@pytest.mark.parametrize("seed", range(4))
def test_an_open_blade_stands_off_its_stock_rail_and_every_rail_keeps_its_gauge_elsewhere(seed):
    rails = [rail.xy for rail in open_blade(np.random.default_rng(seed), SIZE).rails]
    # The tip is the end of a rail that is nearest to another rail without being on it.
    tips = [
        cKDTree(np.concatenate([other for other in rails if other is not rail])).query(rail[0])[0] for rail in rails
    ]
    off = [tip for tip in tips if 0.05 < tip < 0.5]
    assert len(off) == 1
    assert BLADE_OPENING_M[0] - 0.02 < off[0] < BLADE_OPENING_M[1] + 0.02


@pytest.mark.parametrize("seed", range(4))
def test_a_slip_joins_the_two_tracks_that_cross(seed):
    layout = slip(np.random.default_rng(seed), SIZE)
    assert len(layout.rails) in (6, 8)
    crossing_rails = cKDTree(np.concatenate([rail.xy for rail in layout.rails[:4]]))
    for rail in layout.rails[4:]:
        assert crossing_rails.query(rail.xy[[0, -1]])[0].max() < 0.03
        assert crossing_rails.query(rail.xy)[0].max() > 0.2


def test_a_third_rail_ends_where_the_raster_shows_it():
    layout = third_rail_end(np.random.default_rng(0), SIZE)
    left, right, third = (len(rail.xy) for rail in layout.rails)
    assert left == right > third
    assert np.array_equal(layout.spots[0], layout.rails[2].xy[-1])
