"""Tracks fitted along guides: where they lie, what is not seen and why, and what has no guide."""

import numpy as np
import pytest
from rail_extract.core.airborne.fitting import HIDDEN, MISLED, SEEN, UNSURE, fit_tracks
from rail_extract.core.airborne.guide_line import axis_of_guide
from rail_extract.laboratory.airborne.designs import SPACING_M
from rail_extract.laboratory.airborne.flight import Flight, fly
from rail_extract.laboratory.airborne.ground import Axis, Band, World
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


def test_the_distance_of_a_track_without_a_guide_is_stated(flown):
    one = fitted(flown.cloud.xyz, flown.cloud.strip, flown.guides[:1])[0]
    apart = flown.design.tracks[1].left_m - flown.design.tracks[0].left_m
    assert len(one.others) >= 3
    assert np.abs(one.others[:, 1] - apart).max() < 0.2


def test_a_guide_between_two_tracks_gives_no_line(flown):
    apart = flown.design.tracks[1].left_m - flown.design.tracks[0].left_m
    between = moved(flown.design.truth(0)[::40, :2], apart / 2)
    one = fitted(flown.cloud.xyz, flown.cloud.strip, [between])[0]
    assert not (one.stations.reason == SEEN).any()
    assert set(one.stations.reason) <= {UNSURE, MISLED, HIDDEN}


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
