"""Simulated airborne clouds: density, heights of rails and bed, cant, strips, and guides."""

import numpy as np
import pytest
from rail_extract.core.polyline import project
from rail_extract.laboratory.airborne.designs import curved_line, drawn_together, yard
from rail_extract.laboratory.airborne.flight import Flight, fly
from rail_extract.laboratory.airborne.ground import BALLAST_TOP_M
from rail_extract.laboratory.ruler.airborne import compare_stations


@pytest.fixture(scope="module")
def design():
    made = curved_line(3, 120.0, tracks=1, cant_m=0.1, radius_m=400.0)
    made.world.bands.clear()
    return made


def flown(design, **changes):
    return fly(design.world, design.where, 4.0, Flight(**{"plants": 0.0, "wires": 0.0, **changes}), seed=1)


def across(design, cloud):
    """Distance to the left of the track, and height above its axis."""
    truth = design.truth(0)
    feet = project([truth[:, :2]], cloud.xyz[:, :2], 4.0)
    along = np.arange(len(truth)) * 0.25
    return feet.t, feet.across, cloud.xyz[feet.point, 2] - np.interp(feet.t, along, truth[:, 2])


def test_the_cloud_has_the_density_of_the_flight(design):
    area_m2 = 120.0 * 8.0
    assert len(flown(design, density=12.0).xyz) / area_m2 == pytest.approx(12.0, rel=0.1)


def test_a_narrow_beam_sees_railheads_and_bed_with_their_cant(design):
    cloud = flown(design, density=60.0, footprint_m=0.02, noise_m=0.0, strips=1)
    t, left, height = across(design, cloud)
    cant_m = np.interp(t, np.arange(len(design.truth(0))) * 0.25, design.tracks[0].cant_m)
    head = np.abs(np.abs(left) - 1.507 / 2) < 0.02
    assert np.median(height[head] - left[head] * cant_m[head] / 1.507) == pytest.approx(0.0, abs=0.015)
    bed = np.abs(left) < 0.4
    assert np.median(height[bed]) == pytest.approx(BALLAST_TOP_M + design.world.ballast_m, abs=0.03)


def test_strips_differ_by_what_the_flight_states(design):
    cloud = flown(design, density=20.0, noise_m=0.0, strip_up_m=0.08)
    _, left, height = across(design, cloud)
    feet = np.abs(left) < 0.5
    strip = cloud.strip[project([design.truth(0)[:, :2]], cloud.xyz[:, :2], 4.0).point]
    apart = np.median(height[feet & (strip == 1)]) - np.median(height[feet & (strip == 0)])
    assert apart == pytest.approx(0.08, abs=0.01)


def test_guides_lie_within_reach_of_their_tracks():
    made = yard(4)
    for track, guide in zip(made.tracks, drawn_together(made.tracks, 4)):
        feet = project([track.centerline[:, :2]], guide, 4.0)
        assert len(feet.point) >= len(guide) - 2
        assert np.abs(feet.across).max() < 3.0


def test_the_ruler_measures_to_the_side(design):
    truth = design.truth(0)
    moved = truth[40:-40:40].copy()
    moved[:, :2] += 0.05 * design.tracks[0].curve.left_normal[40:-40:40]
    seen = np.ones(len(moved), bool)
    found = compare_stations(moved, seen, np.full(len(moved), 0.03), ~seen, truth)
    assert found.across_m == pytest.approx(0.05, abs=1e-3)
    assert found.shares() == pytest.approx((1.0, 1.0, 50.0, 0.0, 1.0), abs=0.5)
