"""Kilometres of the features of layers: sources, coordinate systems, kinds of layers, fields and messages."""

import numpy as np
import pytest
from memory_layers import layer_of
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsGeometry,
    QgsVectorLayer,
)

EAST, NORTH = 500_000, 3_000_000
FIELDS = ["axis", "piece", "km", "km_text", "offset_m", "side", "ambiguous"]


def layer(kind, *texts, fields="", values=(), crs="EPSG:32643"):
    """Make a layer of shapes whose coordinates count from the corner."""
    shapes = [text and QgsGeometry.fromWkt(text) for text in texts]
    for shape in filter(None, shapes):
        shape.translate(EAST, NORTH)
    return layer_of(*shapes, kind=kind, crs=crs, fields=fields, values=values)


AXIS = "LINESTRING(0 0, 1000 0)"
AXIS_M = "LINESTRING M(0 0 12000, 1000 0 13000)"
PLACES = ("POINT(100 4)", "POINT(250.5 -2.5)", "POINT(999 0)")


def moved(source, crs):
    """The same layer in another coordinate system."""
    target = QgsCoordinateReferenceSystem(crs)
    made = QgsVectorLayer(f"LineStringM?crs={crs}", "moved", "memory")
    change = QgsCoordinateTransform(source.crs(), target, source.transformContext())
    for feature in source.getFeatures():
        shape = feature.geometry().densifyByCount(50)
        shape.transform(change)
        feature.setGeometry(shape)
        assert made.dataProvider().addFeature(feature)
    return made


@pytest.fixture
def station(run_table):
    """Run, and return results, values by field, and what was said."""

    def run(places, axis, **parameters):
        results, _, values, feedback = run_table("stationalongaxis", INPUT=places, AXIS=axis, **parameters)
        return results, values, feedback.warnings

    return run


def test_points_get_kilometre_offset_and_side_and_keep_their_fields(station):
    places = layer("Point", *PLACES, fields="&field=signal:string(9)", values=[("A",), ("B",), ("C",)])
    results, values, warnings = station(places, layer("LineStringM", AXIS_M))
    assert list(values) == ["signal", *FIELDS]
    assert values["signal"] == ["A", "B", "C"]
    assert values["km"] == [12.1, 12.2505, 12.999]
    assert values["km_text"] == ["12.1+00.00", "12.2+50.50", "12.9+99.00"]
    assert values["offset_m"] == [4.0, -2.5, 0.0]
    assert values["side"] == ["left", "right", "on"]
    assert values["axis"] == ["1"] * 3
    assert values["piece"] == [1] * 3
    assert values["ambiguous"] == [0] * 3
    assert (results["PLACE_COUNT"], results["BEYOND_COUNT"], results["AMBIGUOUS_COUNT"]) == (3, 0, 0)
    assert warnings == []


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:32644"])
def test_an_axis_in_another_system_is_transformed_and_that_is_said(station, crs):
    axis = moved(layer("LineStringM", AXIS_M), crs)
    _, values, warnings = station(layer("Point", *PLACES), axis)
    np.testing.assert_allclose(values["km"], [12.1, 12.2505, 12.999], atol=2e-6)
    np.testing.assert_allclose(values["offset_m"], [4.0, -2.5, 0.0], atol=0.02)
    assert (warnings == [f"AXIS is in {crs} and was transformed to EPSG:32643."]) == (crs == "EPSG:4326")
