"""Classify Rail Points, and Extract Rails from a raw cloud."""

import re

import laspy
import numpy as np
import pytest
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, with_track

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])


@pytest.fixture
def raw(write_cloud):
    """Write 10 m of track on ballast as class 2; returns the path, and which points are on heads."""
    rng = np.random.RandomState(3)
    xyz, on = with_track(flat(10.0, rng=rng, per_m2=2500), 1.435, 0.072, 0.3)
    return write_cloud(rough(xyz, rng) + CORNER, "raw.laz", 2), on


def test_rail_points_get_their_class(raw, run_step, tmp_path, new_feedback):
    path, on = raw
    feedback = new_feedback()
    done = run_step("classifyrailpoints", {"INPUT": path, "OUTPUT": tmp_path / "new.laz"}, feedback)
    assert done.ok, done.error
    assert not feedback.warnings
    found = laspy.read(done.results["OUTPUT"]).classification == 10
    assert done.results["POINT_COUNT"] == len(on)
    assert done.results["RAIL_POINTS"] == found.sum()
    assert (found & on).sum() / on.sum() > 0.97
    assert done.results["PAIRED_LENGTH"] == pytest.approx(19, abs=2)
    assert done.results["SINGLE_LENGTH"] == pytest.approx(0, abs=0.5)
    assert done.results["CELLS_PER_M"] > 30
    assert sorted(one.name for one in tmp_path.iterdir()) == ["new.laz", "raw.laz"]


def test_only_rail_points_of_part_of_the_cloud_go_into_a_temporary_file(raw, run_step):
    (west, south, _), (east, north, _) = laspy.read(raw[0]).xyz.min(axis=0), laspy.read(raw[0]).xyz.max(axis=0)
    north -= 4
    extent = f"{west},{east},{south},{north}"
    done = run_step(
        "classifyrailpoints",
        {"INPUT": raw[0], "RAIL_CLASS": 20, "CONTENT": 1, "EXTENT": extent, "OUTPUT": "TEMPORARY_OUTPUT"},
    )
    assert done.ok, done.error
    cloud = laspy.read(done.results["OUTPUT"])
    assert (cloud.classification == 20).all()
    assert 0 < len(cloud.points) == done.results["RAIL_POINTS"]
    assert cloud.y.max() <= north


def test_a_folder_of_tiles_gives_a_folder_of_tiles_with_a_catalogue(raw, run_step, tmp_path):
    tiles = tmp_path / "tiles"
    tiles.mkdir()
    raw[0].rename(tiles / "a.laz")
    done = run_step("classifyrailpoints", {"INPUT": tiles, "OUTPUT": tmp_path / "new.laz"})
    assert done.ok, done.error
    assert done.results["OUTPUT"] == str(tmp_path / "new.vpc")
    assert (laspy.read(tmp_path / "new" / "a.laz").classification == 10).sum() == done.results["RAIL_POINTS"] > 0
    again = run_step("classifyrailpoints", {"INPUT": tmp_path / "new.vpc", "OUTPUT": tmp_path / "second.vpc"})
    assert again.results["RAIL_POINTS"] == done.results["RAIL_POINTS"]


def test_the_standard_of_a_raw_cloud_is_detected(raw, run, new_feedback, tmp_path):
    feedback = new_feedback()
    values = {"INPUT": raw[0], "CLASSIFY": True, "STANDARD": "DETECT", "ITERATIONS": 1}
    done = run({**values, "RAILS": tmp_path / "rails.gpkg"}, feedback)
    assert done.ok, done.error
    assert done.results["RAIL_COUNT"] == 2
    (said,) = (text for text in feedback.infos if text.startswith("Detected "))
    assert re.search(r"rails are 15\d\d mm apart, head \d\d ± \d mm; fits .*, also ", said)
