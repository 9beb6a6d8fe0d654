"""Grow Rail Points from Seeds: seeds of layers and of the map, and the results."""

import laspy
import numpy as np
import pytest
from memory_layers import layer_of
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsGeometry,
    QgsPointXY,
    QgsProject,
    QgsVectorLayer,
)
from rail_extract.laboratory.scenes.raw_strips import SPACING_M, strip

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])
TRACK = strip(14.0)


@pytest.fixture
def raw(write_cloud):
    return write_cloud(TRACK.xyz + CORNER, "raw.laz", 2)


def place(along, left):
    return QgsPointXY(*(CORNER[:2] + TRACK.at(along, left)))


def test_both_rails_get_their_class_from_a_seed_in_degrees(raw, run_step, tmp_path, new_feedback):
    utm, degrees = QgsCoordinateReferenceSystem("EPSG:32643"), QgsCoordinateReferenceSystem("EPSG:4326")
    shape = QgsGeometry.fromPointXY(place(7.0, SPACING_M / 2))
    shape.transform(QgsCoordinateTransform(utm, degrees, QgsProject.instance()))
    feedback = new_feedback()
    values = {
        "INPUT": raw,
        "SEEDS": layer_of(shape, kind="Point", crs="EPSG:4326"),
        "OUTPUT": tmp_path / "new.laz",
        "STOPS": tmp_path / "stops.gpkg",
    }
    done = run_step("growrailpoints", values, feedback)
    assert done.ok, done.error
    assert not feedback.warnings
    found = np.asarray(laspy.read(done.results["OUTPUT"]).classification) == 10
    assert done.results["RAIL_POINTS"] == found.sum() > 0.9 * TRACK.head.sum()
    assert done.results["PAIRED_LENGTH"] == pytest.approx(27, abs=2)
    stops = list(QgsVectorLayer(str(tmp_path / "stops.gpkg"), "stops", "ogr").getFeatures())
    assert [(stop["stop"], stop["reason"]) for stop in stops] == [(1, "the cloud ends"), (2, "the cloud ends")]
    ends = [stop.geometry().constGet() for stop in stops]
    assert sorted(end.x() for end in ends) == pytest.approx([500_000, 500_014], abs=1.0)
    assert [end.y() for end in ends] == pytest.approx([3_000_000 + SPACING_M / 2] * 2, abs=0.02)
    assert [end.y() for end in ends] == pytest.approx([3_000_000 + SPACING_M / 2] * 2, abs=0.02)


def test_one_rail_grows_from_a_place_on_the_map(raw, run_step):
    x, y = place(7.0, -SPACING_M / 2)
    values = {"INPUT": raw, "SEED": f"{x},{y} [EPSG:32643]", "BOTH": False, "CONTENT": 1, "OUTPUT": "TEMPORARY_OUTPUT"}
    done = run_step("growrailpoints", values)
    assert done.ok, done.error
    cloud = laspy.read(done.results["OUTPUT"])
    assert len(cloud.points) == done.results["RAIL_POINTS"]
    assert np.abs(cloud.y - y).max() < 0.06
    assert done.results["SINGLE_LENGTH"] == pytest.approx(13.5, abs=1)
