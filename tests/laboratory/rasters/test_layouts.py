"""Curves, turnouts and random layouts."""

import math

import numpy as np
import pytest
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.rasters.fittings import FLANGEWAY_M, crossing
from rail_extract.laboratory.rasters.layouts import (
    FAMILIES,
    random_layout,
    slip,
)
from rail_extract.laboratory.rasters.paths import NO_TRACK, TrackSize, track
from rail_extract.laboratory.rasters.turnouts import FORMS, branch, turnout
from scipy.spatial import cKDTree
from scipy.special import fresnel

SIZE = TrackSize(1.5112, 0.0762)


def test_a_clothoid_follows_the_fresnel_integrals():
    length, sharpness = 60.0, 1 / (300 * 60)
    curve = trace([Element(length, 0.0, length * sharpness)])
    scale = math.sqrt(math.pi / sharpness)
    sine, cosine = fresnel(curve.chainage / scale)
    assert np.abs(curve.xy - scale * np.column_stack([cosine, sine])).max() < 1e-8


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


def test_crossings_are_found_and_parallel_lines_have_none():
    along = np.linspace(0, 20, 1001)
    first = np.column_stack([along, np.zeros_like(along)])
    second = np.column_stack([along, 0.1 * (along - 12.0)])
    assert crossing(first, second) == (600, 600)
    assert crossing(first, first + [0.0, 1.5]) is None


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


@pytest.mark.parametrize("seed", range(4))
def test_a_slip_joins_the_two_tracks_that_cross(seed):
    layout = slip(np.random.default_rng(seed), SIZE)
    assert len(layout.rails) in (6, 8)
    crossing_rails = cKDTree(np.concatenate([rail.xy for rail in layout.rails[:4]]))
    for rail in layout.rails[4:]:
        assert crossing_rails.query(rail.xy[[0, -1]])[0].max() < 0.03
        assert crossing_rails.query(rail.xy)[0].max() > 0.2
