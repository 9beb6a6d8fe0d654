"""Tracks fitted along guides: where they lie, what is not seen and why, and what has no guide."""

import numpy as np
import pytest
from rail_extract.core.airborne.fitting import EMPTY, HIDDEN, MISLED, SEEN, TWIN, UNSURE, fit_tracks
from rail_extract.core.airborne.guide_line import axis_of_guide
from rail_extract.laboratory.airborne.designs import SPACING_M, box
from rail_extract.laboratory.airborne.flight import Flight, fly
from rail_extract.laboratory.airborne.ground import Axis, Band, World
from rail_extract.laboratory.ruler.airborne import Stationwise, compare_stations
from scipy.spatial import cKDTree


def fitted(xyz, strip, guides, reach_m=3.0, footprint_m=0.25):
    return fit_tracks(
        xyz, strip, [axis_of_guide(one) for one in guides], [SPACING_M] * len(guides), reach_m, footprint_m
    )


@pytest.fixture(scope="module")
def found(flown):
    return fitted(flown.cloud.xyz, flown.cloud.strip, flown.guides)


def moved(guide, left_m):
    """A guide moved to the left, (k, 2)."""
    step = np.gradient(guide, axis=0)
    return guide + left_m * np.column_stack([-step[:, 1], step[:, 0]]) / np.hypot(*step.T)[:, None]


def test_both_tracks_lie_within_centimetres(flown, found):
    for number, one in enumerate(found):
        own = one.stations
        xyz, seen = np.column_stack([own.xy, own.bed]), own.reason == SEEN
        compared = compare_stations(xyz, seen, own.sigma, own.switch, flown.design.truth(number))
        share, right, rms_mm, _, within = compared.shares()
        assert share >= 0.95
        assert right == 1.0
        assert np.nanmax(np.abs(compared.across_m)) < 0.06
        assert rms_mm < 20
        assert within > 0.9


def test_cant_and_height_are_those_of_the_bed(flown, found):
    for number, one in enumerate(found):
        truth = flown.design.truth(number)
        middle = len(truth) // 2
        nearest = int(np.argmin(np.hypot(*(one.stations.xy - truth[middle, :2]).T)))
        cant_m = flown.design.tracks[number].cant_m[middle]
        assert SPACING_M * one.stations.tilt[nearest] == pytest.approx(cant_m, abs=0.025)
        assert one.stations.bed[nearest] == pytest.approx(truth[middle, 2] - 0.19, abs=0.05)


def test_a_section_that_one_strip_covers_alone_may_be_off_by_half_their_distance(flown):
    truth = flown.design.truth(0)
    nearest = cKDTree(truth[:, :2]).query(flown.cloud.xyz[:, :2])[1]
    left = flown.design.tracks[0].curve.left_normal[nearest]
    xyz, other = flown.cloud.xyz.copy(), flown.cloud.strip == 1
    xyz[other, :2] += 0.08 * left[other]
    kept = ~other | (nearest < len(truth) / 2)
    stations = fitted(xyz[kept], flown.cloud.strip[kept], flown.guides[:1])[0].stations
    both, alone = stations.t < 80, (stations.t > 180) & (stations.t < 240)
    assert np.median(stations.sigma[both]) < 0.02
    assert np.median(stations.sigma[alone]) == pytest.approx(0.05, abs=0.02)


def test_little_of_a_sparse_cloud_with_a_wide_footprint_is_lost(flown):
    cloud = fly(flown.design.world, flown.design.where, 9.0, Flight(5.0, 0.5, plants=0.03), seed=5)
    found = fitted(cloud.xyz, cloud.strip, flown.guides, footprint_m=0.5)
    rows = [
        compare_stations(
            np.column_stack([one.stations.xy, one.stations.bed]),
            one.stations.reason == SEEN,
            one.stations.sigma,
            one.stations.switch,
            flown.design.truth(number),
        )
        for number, one in enumerate(found)
    ]
    share, right, rms_mm, _, within = Stationwise.joined(rows).shares()
    assert share > 0.8
    assert right == 1.0
    assert rms_mm < 45
    assert within > 0.9


def test_the_distance_of_a_track_without_a_guide_is_stated(flown):
    one = fitted(flown.cloud.xyz, flown.cloud.strip, flown.guides[:1])[0]
    apart = flown.design.tracks[1].left_m - flown.design.tracks[0].left_m
    assert len(one.others) >= 3
    assert np.abs(one.others[:, 1] - apart).max() < 0.2


def test_two_guides_on_one_track_give_no_line(flown):
    alone = World([flown.design.tracks[0]], seed=3)
    cloud = fly(alone, flown.design.where, 7.0, Flight(10.0, 0.25, plants=0.0), seed=2)
    truth = flown.design.truth(0)[::40, :2]
    found = fitted(cloud.xyz, cloud.strip, [moved(truth, -1.6), moved(truth, 1.6)])
    reasons = np.concatenate([one.stations.reason for one in found])
    assert not (reasons == SEEN).any()
    assert (reasons == TWIN).mean() > 0.5


def test_a_guide_between_two_tracks_gives_no_line(flown):
    apart = flown.design.tracks[1].left_m - flown.design.tracks[0].left_m
    between = moved(flown.design.truth(0)[::40, :2], apart / 2)
    one = fitted(flown.cloud.xyz, flown.cloud.strip, [between])[0]
    assert not (one.stations.reason == SEEN).any()
    assert set(one.stations.reason) <= {UNSURE, MISLED, HIDDEN}


def test_a_train_and_a_hole_are_not_seen(flown):
    track = flown.design.tracks[0]
    world = World([track], [Band(Axis.of_track(track).beside(0.0), box(1.5, 3.7), 60.0, 130.0)], seed=3)
    cloud = fly(world, flown.design.where, 7.0, Flight(10.0, 0.25), seed=2)
    truth = flown.design.truth(0)
    near = np.hypot(*(cloud.xyz[:, :2] - truth[780, :2]).T) < 18
    stations = fitted(cloud.xyz[~near], cloud.strip[~near], [truth[::40, :2]])[0].stations
    under = (stations.t > 70) & (stations.t < 120)
    hole = np.abs(stations.t - 195) < 8
    assert not (stations.reason[under] == SEEN).any()
    assert (stations.reason[hole] == EMPTY).all()
    assert (stations.reason[(stations.t < 45) | ((stations.t > 145) & (stations.t < 170))] == SEEN).all()


@pytest.mark.parametrize("thing", ["road with kerbs", "hedge", "ditch", "bank", "field"])
def test_no_line_where_there_is_no_track(thing):
    along = np.arange(0.0, 160.0, 0.25)
    flat = Axis(np.column_stack([along, 0 * along, 0 * along + 50]), 0 * along, 0 * along)
    profiles = {
        "road with kerbs": [[-4.0, 0.12], [-3.05, 0.12], [-3, 0], [0, 0.07], [3, 0], [3.05, 0.12], [4.0, 0.12]],
        "hedge": [[-0.7, 0.0], [-0.6, 0.25], [0.6, 0.25], [0.7, 0.0]],
        "ditch": [[-1.5, 0.0], [-0.4, -0.6], [0.4, -0.6], [1.5, 0.0]],
        "bank": [[-3.0, 0.0], [-1.2, 0.9], [1.2, 0.9], [3.0, 0.0]],
        "field": [[-1.0, 0.0], [1.0, 0.0]],
    }
    band = Band(flat, np.array(profiles[thing]), covers=thing != "ditch")
    ground = Band(flat, np.array([[-15.0, 0.0], [15.0, 0.0]]), covers=False)
    cloud = fly(World([], [ground, band], seed=4), flat.xyz[::4, :2], 7.0, Flight(10.0, 0.25), seed=1)
    guide = np.column_stack([along[::160], 0.3 * np.sin(along[::160])])
    assert not (fitted(cloud.xyz, cloud.strip, [guide])[0].stations.reason == SEEN).any()


@pytest.mark.parametrize("length_m", [30, 60, 90])
def test_short_guides_are_fitted_too(flown, length_m):
    truth = flown.design.truth(0)[200 : 200 + 4 * length_m + 1 : 40, :2]
    stations = fitted(flown.cloud.xyz, flown.cloud.strip, [truth])[0].stations
    assert len(stations.t) == length_m / 10
    assert (stations.reason == SEEN).mean() > 0.6


def test_no_points_give_no_track():
    one = fitted(np.empty((0, 3)), np.empty(0, int), [np.array([[0.0, 0.0], [100.0, 0.0]])])[0]
    assert (one.stations.reason != SEEN).all()
    assert one.shape is None
