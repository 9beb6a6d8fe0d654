"""Worlds: a seed gives the same world, and the truth is where the scanner saw the heads."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.comparison import cut
from rail_extract.laboratory.scenes.raw_world import HEAD
from rail_extract.laboratory.worlds.classes import HEADS, classified, draw_classification
from rail_extract.laboratory.worlds.railway import LADDER, draw_railway
from rail_extract.laboratory.worlds.world import make
from scipy.spatial import cKDTree

SMALL = (1, 6, 11)
"""A drone over a double track, one narrow-gauge track in a curve, and a crossover."""


@pytest.fixture(scope="module", params=SMALL)
def world(request):
    return make(request.param, "classified")


def test_a_world_is_a_function_of_its_seed(world):
    again = make(world.seed, "classified")
    assert again.scene.xyz.shape == world.scene.xyz.shape
    assert np.abs(again.scene.xyz - world.scene.xyz).max() < 1e-9  # rounding depends on threads and alignment
    assert np.array_equal(again.classified.classification, world.classified.classification)
    assert again.describe() == world.describe()


def test_points_on_heads_are_around_the_truth(world):
    on_head = world.scene.xyz[world.scene.kind == HEAD]
    feet, _ = cut(world.scene.rails).nearest(on_head)
    off = on_head - feet
    noise_m = 0.02 if world.survey.from_above else 0.008
    across = np.hypot(off[:, 0], off[:, 1])
    assert np.percentile(across, 99) < world.scene.standard.head_width_m / 2 + noise_m
    assert np.percentile(off[:, 2], 99) < 2 * noise_m
    assert np.median(off[:, 2]) > -0.03


def test_heads_in_a_street_are_on_their_rails_where_profiles_are_turned_and_the_track_rises():
    world = make(9089)
    assert world.survey.scanners[0].turned > 0.5
    on_head = world.scene.xyz[world.scene.kind == HEAD]
    rails = cut(world.scene.rails)
    feet, number = rails.nearest(on_head)
    for rail in np.unique(rails.number):
        assert abs(np.median((on_head - feet)[rails.number[number] == rail, 2])) < 0.005


def test_passes_whose_planes_are_turned_show_the_same_ground():
    world = make(11956)
    turned = np.array([scanner.turned for scanner in world.survey.scanners])
    assert np.ptp(turned) > 0.5
    one, other = (world.scene.xyz[np.isin(world.scene.passes, np.flatnonzero(way))] for way in (turned > 0, turned < 0))
    distance_m, nearest = cKDTree(one[:, :2]).query(other[:, :2])
    off_m = np.abs(other[:, 2] - one[nearest, 2])[distance_m < 0.03]
    assert np.percentile(off_m, 95) < 0.10  # of which heads, sleepers and stones make up to 8 cm


def test_many_worlds_differ_in_what_counts():
    railways = [draw_railway(seed) for seed in range(1, 61)]
    assert len({one.standard.name for one in railways}) > 20
    assert {one.family for one in railways} == {"main line", "yard", "narrow gauge", "tram", "metro"}
    assert max(len(one.tracks) for one in railways) >= 6
    assert sum(not one.plain for one in railways) > 15
    sharpest = [np.abs(one.reference.curvature).max() for one in railways]
    assert max(sharpest) > 1 / 60
    assert sum(one == 0 for one in sharpest) > 10


def test_turnouts_of_a_ladder_do_not_overlap():
    """Those of seed 13056 were half a metre apart, and their rails 50 mm."""
    ladders = [one for one in map(draw_railway, range(12600, 13100)) if one.layout == LADDER and not one.plain]
    pairs = [one.tracks[-2:] for one in ladders if one.tracks[-2].curve is not one.reference]
    ends = [[np.hypot(*(first.curve.xy[end] - second.curve.xy[end])) for end in (0, -1)] for first, second in pairs]
    assert len(ends) >= 8
    assert np.max(ends, axis=1).min() > 24.9


def test_tracks_that_meet_have_rails_at_one_height():
    for seed in range(1, 200):
        railway = draw_railway(seed)
        if railway.plain:
            continue
        rails = [rail for track in railway.tracks for rail in track.rails()]
        for number, rail in enumerate(rails):
            others = cut([*rails[:number], *rails[number + 1 :]])
            feet, _ = others.nearest(rail)
            off = rail - feet
            meeting = np.hypot(off[:, 0], off[:, 1]) < 0.002
            assert np.all(np.abs(off[meeting, 2]) < 0.003), seed


def test_from_above_a_class_holds_strips_that_are_wider_than_heads():
    """Nobody sees the edges of heads in beams and images as wide as they are."""
    world = make(SMALL[0], "raw")
    how = replace(draw_classification(3), style=HEADS, strip_m=0.06, aside_m=0.01, missed=0.0, gaps=0, leaks=0.0)
    scene = classified(world.scene, how, 3, from_above=True)
    feet, _ = cut(world.scene.rails).nearest(scene.rail_points().xyz)
    off_m = np.hypot(*(scene.rail_points().xyz - feet)[:, :2].T)
    assert 0.045 < np.percentile(off_m, 98) < 0.075
