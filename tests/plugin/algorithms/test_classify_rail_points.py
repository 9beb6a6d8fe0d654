"""Classify Rail Points, and Extract Rails from a raw cloud."""

import re

import laspy
import numpy as np
import pytest
from built import raw_track

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])


@pytest.fixture
def raw(write_cloud):
    """Write 10 m of track on ballast as class 2."""
    return write_cloud(raw_track(10.0, 2500)[0] + CORNER, "raw.laz", 2)


def test_only_rail_points_of_part_of_the_cloud_go_into_a_temporary_file(raw, run_step):
    xyz = laspy.read(raw).xyz
    (west, south, _), (east, north, _) = xyz.min(axis=0), xyz.max(axis=0) - 4
    extent = f"{west},{east + 4},{south},{north}"
    done = run_step(
        "classifyrailpoints",
        {"INPUT": raw, "RAIL_CLASS": 20, "CONTENT": 1, "EXTENT": extent, "OUTPUT": "TEMPORARY_OUTPUT"},
    )
    assert done.ok, done.error
    cloud = laspy.read(done.results["OUTPUT"])
    assert (cloud.classification == 20).all()
    assert 0 < len(cloud.points) == done.results["RAIL_POINTS"]
    assert cloud.y.max() <= north


def test_the_standard_of_a_raw_cloud_is_detected(raw, run, new_feedback, tmp_path):
    feedback = new_feedback()
    values = {"INPUT": raw, "CLASSIFY": True, "STANDARD": "DETECT", "ITERATIONS": 1}
    done = run({**values, "RAILS": tmp_path / "rails.gpkg"}, feedback)
    assert done.ok, done.error
    assert done.results["RAIL_COUNT"] == 2
    (said,) = (text for text in feedback.infos if text.startswith("Detected "))
    assert re.search(r"rails are 15\d\d mm apart, head \d\d ± \d mm; fits .*, also ", said)
