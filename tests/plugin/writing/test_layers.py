import numpy as np
import pytest
from qgis.core import (
    NULL,
    QgsProcessing,
)
from rail_extract.core.fields import CENTERLINE_FIELDS, CENTERLINES, QUALITY_FIELDS, RAIL_FIELDS, RAILS
from rail_extract.core.files.layers import lines_layer
from rail_extract.core.frame import LocalFrame
from rail_extract.core.rails import Centerline, RailLine
from rail_extract.rail_extract_plugin.writing.destinations import destinations
from rail_extract.rail_extract_plugin.writing.layers import features, fields

FEET = LocalFrame(np.array([1000.0, 2000.0, 10.0]), horizontal_unit_m=0.3048, vertical_unit_m=0.3048)
XYZ = np.array([[0.0, 0.0, 0.0], [3.048, 0.0, 0.3048]])


def test_rail_becomes_a_feature_in_the_units_of_the_cloud(qgis):
    rail = RailLine(
        XYZ,
        rail_id=3,
        class_code=10,
        points=812,
        resid_mm=4.5,
        sigma_mm=np.float64(0.7),
        bridged_m=1.5,
        gaps=np.array([[0.25, 1.0], [2.0, 2.75]]),
        track_ids=(2, 5),
        sigmaz_mm=0.456,
    )
    (feature,) = features(lines_layer(RAILS, [rail]), FEET)
    vertices = [(point.x(), point.y(), point.z()) for point in feature.geometry().vertices()]
    assert np.allclose(vertices, [(1000, 2000, 10), (1010, 2000, 11)])
    assert feature.attributes() == [3, 10, 3.063, 812, 4.5, 0.7, 1.5, "2,5", "0.25-1.00,2.00-2.75", 0.46]


def test_centerline_becomes_a_feature(qgis):
    line = Centerline(XYZ, 1, 10, (1, 4), (2,), 1435.2, float("nan"), -20.0, -41.0, 0.5)
    (feature,) = features(lines_layer(CENTERLINES, [line]), FEET)
    attributes = dict(zip((column.name for column in CENTERLINE_FIELDS), feature.attributes()))
    assert (attributes["left_ids"], attributes["right_ids"]) == ("1,4", "2")
    assert attributes["cantmax_mm"] == -41.0
    assert attributes["gaugesd_mm"] == NULL


ALL_FIELDS = pytest.mark.parametrize("columns", [RAIL_FIELDS, CENTERLINE_FIELDS, QUALITY_FIELDS])


@ALL_FIELDS
def test_shapefiles_keep_the_field_names(qgis, columns):
    assert fields(columns).names() == [column.name for column in columns]
    assert max(map(len, fields(columns).names())) <= 10


@pytest.mark.parametrize("value", [None, "", "memory:", QgsProcessing.TEMPORARY_OUTPUT])
def test_outputs_that_are_not_files_are_accepted(context, value):
    assert destinations({"RAILS": value}, context) == {}
