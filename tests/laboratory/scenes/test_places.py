"""Places without rails have what misleads: joints, kerbs, beams, ruts and ridges at the sizes that are stated."""

from __future__ import annotations

import numpy as np
import pytest
from rail_extract.core.standards import STANDARDS
from rail_extract.laboratory.scenes import raw_places
from rail_extract.laboratory.scenes.raw import scan_world
from rail_extract.laboratory.scenes.raw_catalogue import line
from rail_extract.laboratory.scenes.raw_photogrammetry import Photogrammetry
from rail_extract.laboratory.scenes.raw_places import (
    BARRIER_M,
    BEAM_M,
    BEAM_SIZE_M,
    CONTAINER_M,
    KERB_M,
    MARKING_M,
    building_site,
    farmland,
    kerbed_car_park,
    motorway,
)
from rail_extract.laboratory.scenes.raw_world import GROUND, PAVEMENT, TRAIN, WALL

FROM_ABOVE = Photogrammetry(
    point_step_m=0.02,
    irregular=0.0,
    blur_m=1e-4,
    blur_varies=0.0,
    widening_m=0.0,
    wave_m=0.0,
    drift_m=0.0,
    noise_m=0.0,
    stray_share=0.0,
    hidden_rise_m=99.0,
)


@pytest.fixture(params=[motorway, kerbed_car_park, building_site, farmland], scope="module")
def place(request):
    """Name of a place, its points from above, and their places along and to the left."""
    reference = line(8.0, 0.0, 0.0)
    scene = scan_world(
        request.param.__name__, [], STANDARDS["EN_60E1_1435"], [FROM_ABOVE], [request.param], 4,
        reference=reference, half_width_m=20.0,
    )  # fmt: skip
    return scene, *(scene.xyz - [3.0, 5.0, 0.0])[:, :2].T


def named(place, name):
    if place[0].name != name:
        pytest.skip("another place")
    return place


def test_a_place_has_no_rails_and_covers_its_width(place):
    scene, along, left = place
    assert scene.rails == () and not scene.head.any()
    assert np.ptp(left) == pytest.approx(40.0, abs=0.1)


def test_a_motorway_has_joints_markings_beams_and_a_barrier(place):
    scene, along, left = named(place, "motorway")
    z = scene.xyz[:, 2]

    def height(middle, half=0.02):
        return np.median(z[np.abs(left - middle) < half])

    joint = z[np.abs(left - raw_places.JOINTS_M[2]) < 0.006]
    assert np.median(joint) - height(raw_places.JOINTS_M[2] + 0.1) == pytest.approx(-0.012, abs=0.005)
    assert height(8.5, 0.1) - 0.5 * (height(8.25) + height(8.70)) == pytest.approx(MARKING_M[1], abs=0.0015)
    assert height(0.0) == pytest.approx(max(up for _, up in BARRIER_M), abs=1e-3)
    beam = z[(scene.kind == WALL) & (left > 10)]
    assert np.max(beam) == pytest.approx(-0.275 + max(up for _, up in BEAM_M), abs=0.01)


def test_kerbs_stand_above_the_car_park(place):
    scene, along, left = named(place, "kerbed_car_park")
    kerb = (scene.kind == WALL) & (np.abs(left - (11.0 + 1.55 / 2 - KERB_M / 2)) < KERB_M / 2 - 0.01)
    road = (scene.kind == PAVEMENT) & (np.abs(left - 12.1) < 0.1)
    # The road rises by 15 mm per metre; the kerb stands on its height at 11 m.
    above = np.median(scene.xyz[kerb, 2]) - np.median(scene.xyz[road, 2])
    assert above == pytest.approx(KERB_M - 0.015 * 1.1, abs=0.005)
    assert (scene.kind == TRAIN).any()


def test_a_building_site_has_containers_and_beams(place):
    scene, along, left = named(place, "building_site")
    box = (scene.kind == WALL) & (left < -10.8) & (left > -13.2) & (along > 4.1) & (along < 7.9)
    soil = np.median(scene.xyz[(scene.kind == GROUND) & (np.abs(left + 14) < 0.5), 2])
    assert np.median(scene.xyz[box, 2]) - soil == pytest.approx(2 * CONTAINER_M[1], abs=0.3)
    assert ((scene.kind == WALL) & (scene.xyz[:, 2] - soil < 1.0)).sum() > 0.5 * BEAM_SIZE_M[0] / 0.02**2


def test_ridges_of_potatoes_repeat_every_three_quarters_of_a_metre(place):
    scene, along, left = named(place, "farmland")
    bare = (scene.kind == GROUND) & (left > 7) & (left < 17)
    edge = scene.kind == GROUND
    before, after = (np.median(scene.xyz[edge & (np.abs(left - at) < 0.05), 2]) for at in (6.28, 6.48))
    assert abs(after - before) < 0.06
    wave = np.exp(2j * np.pi * left[bare] / 0.75)
    assert np.abs(np.mean(wave * scene.xyz[bare, 2])) == pytest.approx(0.11 / 2, rel=0.15)
