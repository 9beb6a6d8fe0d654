"""Kilometres of the features of layers: sources, coordinate systems, kinds of layers, fields and messages."""

import numpy as np
import pytest
from memory_layers import layer_of
from qgis.core import (
    NULL,
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
def station(run_step, context, new_feedback):
    """Run, and return results, values by field, and what was said."""

    def run(places, axis, **parameters):
        feedback = new_feedback()
        given = {"INPUT": places, "AXIS": axis, "OUTPUT": "memory:", **parameters}
        outcome = run_step("stationalongaxis", given, feedback)
        assert outcome.ok, outcome.error
        made = context.getMapLayer(outcome.results["OUTPUT"])
        rows = [feature.attributes() for feature in made.getFeatures()]
        names = made.fields().names()
        values = {name: [None if row[at] == NULL else row[at] for row in rows] for at, name in enumerate(names)}
        return outcome.results, values, feedback.warnings

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


def test_posts_with_texts_and_a_field_of_their_own(station):
    posts = layer(
        "Point", "POINT(0 3)", "POINT(500 -3)", fields="&field=board:string(9)", values=[("7,5 + 0",), ("8.0",)]
    )
    _, values, _ = station(layer("Point", *PLACES), layer("LineString", AXIS), POSTS=posts, POST_FIELD="board")
    assert values["km"] == [7.6, 7.7505, 8.499]


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:32644"])
def test_an_axis_in_another_system_is_transformed_and_that_is_said(station, crs):
    axis = moved(layer("LineStringM", AXIS_M), crs)
    _, values, warnings = station(layer("Point", *PLACES), axis)
    np.testing.assert_allclose(values["km"], [12.1, 12.2505, 12.999], atol=2e-6)
    np.testing.assert_allclose(values["offset_m"], [4.0, -2.5, 0.0], atol=0.02)
    assert (warnings == [f"AXIS is in {crs} and was transformed to EPSG:32643."]) == (crs == "EPSG:4326")


def test_on_a_ring_kilometres_run_once_round_and_either_end_is_meant_where_it_closes(station):
    angle = np.linspace(0, 2 * np.pi, 2001)
    ring = ", ".join(f"{500 * np.sin(one):.6f} {500 - 500 * np.cos(one):.6f}" for one in angle)
    places = layer("Point", "POINT(498 500)", "POINT(-498 500)", "POINT(0.5 2)")
    _, values, _ = station(places, layer("LineString", f"LINESTRING({ring})"), START_KM=1.0)
    np.testing.assert_allclose(values["km"][:2], [1 + 0.25 * np.pi, 1 + 0.75 * np.pi], atol=2e-5)
    assert values["ambiguous"] == [0, 0, 1]


def test_fields_of_the_same_name_stay(station):
    places = layer("Point", PLACES[0], fields="&field=km:double", values=[(99.0,)])
    _, values, _ = station(places, layer("LineStringM", AXIS_M))
    assert (values["km"], values["km_2"]) == ([99.0], [12.1])


@pytest.mark.parametrize("name", ["stations.csv", "Größe 1.gpkg"])
def test_files(station, run_step, tmp_path, name):
    outcome = run_step(
        "stationalongaxis",
        {
            "INPUT": layer("MultiPoint", "MULTIPOINT((100 4))"),
            "AXIS": layer("LineStringM", AXIS_M),
            "OUTPUT": tmp_path / name,
        },
    )
    assert outcome.ok, outcome.error
    assert "12.1+00.00" in (tmp_path / name).read_bytes().decode("latin-1")
