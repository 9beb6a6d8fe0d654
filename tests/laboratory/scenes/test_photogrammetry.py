"""Surveys by images: one surface, blunted and wavy, with holes beside vertical faces and nothing below overhangs."""

from __future__ import annotations

from dataclasses import replace

import laspy
import numpy as np
import pytest
from rail_extract.core.standards import STANDARDS
from rail_extract.laboratory.scenes.raw import scan_world
from rail_extract.laboratory.scenes.raw_catalogue import line, parallel, turnout
from rail_extract.laboratory.scenes.raw_photogrammetry import (
    Photogrammetry,
    misplaced,
)
from rail_extract.laboratory.scenes.raw_scanner import RawScanner
from rail_extract.laboratory.scenes.raw_world import HEAD, PLANT, ground, pavement, running_rails
from rail_extract.laboratory.scenes.write import write_raw

STANDARD = STANDARDS["EN_60E1_1435"]
EXACT = Photogrammetry(
    blur_m=1e-4, blur_varies=0.0, widening_m=0.0, wave_m=0.0, drift_m=0.0, noise_m=0.0, stray_share=0.0
)


def surveyed(camera, things=(ground, running_rails), tracks=True, length_m=12.0, half_width_m=4.0, seed=3):
    curve = line(length_m, 0.0, 0.4)
    laid = parallel(curve, (0.0,)) if tracks else []
    return scan_world("here", laid, STANDARD, [camera], list(things), seed, reference=curve, half_width_m=half_width_m)


def left_of(scene, xyz):
    """Places to the left of the reference line, which starts at (3, 5) with a heading of 0.4."""
    return (xyz[:, 1] - 5.0) * np.cos(0.4) - (xyz[:, 0] - 3.0) * np.sin(0.4)


def test_a_rail_becomes_a_ridge_of_the_width_and_height_of_a_blunted_bar():
    scene = surveyed(Photogrammetry(blur_varies=0.0, wave_m=0.0, drift_m=0.0), length_m=25.0)
    rail = scene.rails[0]
    off = np.abs(left_of(scene, scene.xyz) - left_of(scene, rail)[0])
    above = scene.xyz[:, 2] - np.interp(scene.xyz[:, 0], rail[:, 0], rail[:, 2])
    edges = np.arange(0.0, 0.2, 0.01)
    section = np.array([np.mean(above[(off >= low) & (off < low + 0.01)]) for low in edges])
    bed = section[12:17].mean()
    half = 2 * np.interp(0.5 * (section[0] + bed), section[::-1], edges[::-1] + 0.005)
    assert 0.105 < half < 0.143
    assert 0.12 < section[0] - bed < 0.18
    assert np.mean(scene.shown[0][:, 2] - rail[:, 2]) == pytest.approx(section[0], abs=0.003)
    assert np.mean(scene.shown[0][:, 2] - rail[:, 2]) < -0.02
    assert off[scene.kind == HEAD].min() < 0.01


def test_rails_of_a_switch_are_as_far_below_their_tops_as_the_other_track():
    """Sampled beside a branch, its crest lay on the flank; where two rails meet, one ridge of both lifted it."""
    scene = turnout(5, scanner=Photogrammetry(wave_m=0.0, drift_m=0.0))
    lowered_m = [np.percentile(rail[:, 2] - shown[:, 2], [10, 50, 90]) for rail, shown in zip(scene.rails, scene.shown)]
    assert np.ptp([median for _, median, _ in lowered_m]) < 0.003
    assert max(most - least for least, _, most in lowered_m) < 0.006


def test_the_throat_of_a_crossing_does_not_lower_the_rails_that_images_show():
    """In world 14440, both rails fell by 8 cm where the nose of their crossing begins."""
    for rail, shown in zip(*(getattr(turnout(5, scanner=Photogrammetry()), one) for one in ("rails", "shown"))):
        assert np.ptp(rail[:, 2] - shown[:, 2]) < 0.03


def test_a_level_crossing_does_not_raise_the_rails_that_images_show():
    """Blur lowers the heads between ballast by centimetres, and those between pavement not: the truth had a step."""

    def crossing(world):
        road = world.between(9.0, 16.0)
        ground(world, where=~road)
        running_rails(world, ~road)
        pavement(world, road, (0.065, 0.06), 0.015)

    scene = surveyed(Photogrammetry(blur_varies=0.0, wave_m=0.0, drift_m=0.0), [crossing], length_m=25.0)
    lowered_m = scene.rails[0][:, 2] - scene.shown[0][:, 2]
    assert lowered_m.min() > 0.02
    assert np.ptp(lowered_m) < 0.006


def test_a_plant_beside_a_rail_does_not_raise_it():
    """In world 14165, weeds raised the truth by 15 mm over 2 m."""

    def plant(world):
        world.box(STANDARD.gauge_m / 2 + 0.08, 0.2, 0.1, 0.2, PLANT, world.between(9.0, 11.0))

    camera = Photogrammetry(blur_varies=0.0, wave_m=0.0, drift_m=0.0)
    scene = surveyed(camera, (ground, running_rails, plant), length_m=25.0)
    for rail, shown in zip(scene.rails, scene.shown):
        assert np.ptp(rail[:, 2] - shown[:, 2]) < 0.006


def test_two_epochs_share_the_place_and_have_errors_of_their_own():
    shift = (0.03, -0.02, 0.025)
    camera = Photogrammetry(stray_share=0.0)
    first, second = surveyed(camera), surveyed(replace(camera, epoch=1, shift_m=shift))
    assert np.array_equal(first.rails[0], second.rails[0])
    assert second.shown[0] - first.shown[0] == pytest.approx(np.tile(shift, (len(first.shown[0]), 1)), abs=1e-6)
    assert len(first.xyz) != len(second.xyz) or not np.allclose(first.xyz, second.xyz - shift, atol=1e-3)
    place = np.zeros((200, 3)) + np.random.RandomState(2).uniform(0, 50, (200, 3))
    apart = misplaced(place, camera, np.random.RandomState(1)) - misplaced(place, camera, np.random.RandomState(2))
    assert apart[:, 2].std() == pytest.approx(np.sqrt(2) * camera.wave_m, rel=0.5)


@pytest.mark.parametrize("camera", [EXACT, RawScanner(profile_step_m=0.2)])
def test_files_have_what_a_camera_or_a_scanner_gives(camera, tmp_path):
    scene = surveyed(camera)
    write_raw(scene, tmp_path / "raw.laz")
    cloud = laspy.read(tmp_path / "raw.laz")
    of_images = camera is EXACT
    assert np.column_stack([cloud.x, cloud.y, cloud.z]) == pytest.approx(scene.xyz, abs=6e-4)
    assert ("gps_time" in cloud.point_format.dimension_names) is not of_images
    assert ("red" in cloud.point_format.dimension_names) is of_images
    assert np.asarray(cloud.intensity).any() != of_images
    assert np.array_equal(cloud.classification, scene.classification if of_images else np.ones(len(scene.xyz)))


def test_a_turned_grid_shows_as_many_places_in_rows_that_cross_the_track():
    straight, turned = (surveyed(replace(EXACT, irregular=0.0, turned_rad=turn)) for turn in (0.0, 0.3))
    assert len(turned.xyz) == pytest.approx(len(straight.xyz), rel=0.01)
    straight_rows, turned_rows = (len(np.unique(left_of(one, one.xyz).round(3))) for one in (straight, turned))
    assert straight_rows < 200 < 4000 < turned_rows
