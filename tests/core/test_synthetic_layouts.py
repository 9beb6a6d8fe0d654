"""Curves, clothoids, turnouts and random layouts."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.synthetic.clothoids import connect
from rail_extract.core.synthetic.curves import Element, trace, transition_curve
from rail_extract.core.synthetic.layouts import NO_TRACK, SHARPEST_RADIUS_M, random_alignment, random_layout
from rail_extract.core.synthetic.turnouts import FORMS, TurnoutForm, branch, separation
from scipy.special import fresnel

ANGLES = st.floats(-2.0, 2.0)


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


def test_an_offset_lies_at_its_distance_along_the_normal():
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


@given(ANGLES, ANGLES, st.floats(1.0, 200.0), st.floats(-3.0, 3.0))
def test_a_clothoid_reaches_its_end_in_its_direction(first, last, chord, direction):
    end = (chord * math.cos(direction), chord * math.sin(direction))
    element = connect((0.0, 0.0), direction + first, end, direction + last)
    if element is None:
        return
    step = element.length_m / 2000
    curve = trace([element], (0.0, 0.0), direction + first, step)
    assert np.abs(curve.xy[-1] - end).max() < 1e-6 * chord + 1e-9
    assert math.cos(curve.heading[-1] - direction - last) == pytest.approx(1.0, abs=1e-9)


def test_equal_deflections_are_joined_by_an_arc():
    element = connect((0.0, 0.0), 0.3, (20.0, 0.0), -0.3)
    assert element.start == pytest.approx(element.end, abs=1e-12)
    assert element.start == pytest.approx(-2 * math.sin(0.3) / 20, rel=1e-9)


def test_a_300_1_9_turnout_ends_where_the_form_says():
    form = next(form for form in FORMS if form.name == "300-1:9")
    main = trace([Element(80.0)])
    side = branch(main, 10.0, form, 1, 20.0)
    assert form.arc_m == pytest.approx(33.197, abs=0.001)
    assert side.heading[-1] == pytest.approx(math.atan(1 / 9), abs=1e-4)
    # the tangent length t = R tan(alpha / 2) = 16.616 m places the arc's end
    end = side.xy[int(round(form.arc_m / side.step_m))] - main.xy[int(round(10.0 / main.step_m))]
    assert end == pytest.approx(
        [16.616 * (1 + math.cos(math.atan(1 / 9))), 16.616 * math.sin(math.atan(1 / 9))], abs=0.02
    )


def test_a_branch_in_a_curve_inherits_its_curvature():
    main = trace([Element(80.0, 1 / 500, 1 / 500)])
    side = branch(main, 10.0, TurnoutForm("test", 250.0, 20.0), -1, 10.0)
    assert side.curvature[0] == pytest.approx(1 / 500 - 1 / 250)
    assert separation(main, side, 10.0)[0] == 0.0


@pytest.mark.parametrize("seed", range(20))
def test_the_rails_of_a_track_lie_a_spacing_apart(seed):
    layout = random_layout(np.random.default_rng(seed), 1.5112, 0.0762)
    tracks = {rail.track for rail in layout.rails}
    for track in tracks:
        left, right = (rail for rail in layout.rails if rail.track == track)
        assert np.linalg.norm(left.xy - right.xy, axis=1) == pytest.approx(1.5112)
    assert all(line.track == NO_TRACK for line in layout.distractors)


def test_guard_rails_leave_a_flangeway_inside_their_rail():
    found = 0
    for seed in range(60):
        layout = random_layout(np.random.default_rng(seed), 1.5112, 0.0762)
        for guard in layout.distractors:
            found += 1
            middle = guard.xy[len(guard.xy) // 2]
            apart = [np.linalg.norm(rail.xy - middle, axis=1).min() for rail in layout.rails]
            assert any(0.0762 + 0.037 < distance < 0.0762 + 0.051 for distance in apart)
    assert found > 10


@pytest.mark.parametrize("seed", range(10))
def test_alignments_keep_to_the_sharpest_radius(seed):
    alignment = random_alignment(np.random.default_rng(seed), 120.0)
    assert np.abs(alignment.curvature).max() <= 1 / SHARPEST_RADIUS_M + 1e-12
    assert np.abs(np.diff(alignment.heading)).max() <= alignment.step_m / SHARPEST_RADIUS_M + 1e-9
