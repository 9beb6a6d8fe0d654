"""Faults of axes, posts and jumps, in Station Along Axis."""

import json
import math

import pytest
from faults import faults
from memory_layers import layer_of
from qgis.core import QgsGeometry, QgsLineString, QgsPoint

AXIS = "LINESTRING(500000 3000000, 501000 3000000)"
AXIS_M = "LINESTRING M(500000 3000000 12, 501000 3000000 13)"
OTHER = "LINESTRING(500000 3000400, 501000 3000400)"
LINE = "LINESTRING Z (500000 3000000 100, 500040 3000000 100)"
PLACE = "POINT(500100 3000004)"


def with_objects(bench):
    """A GeoJSON file of a place with an object as one of its values, as exports of OpenStreetMap have."""
    place = {"type": "Point", "coordinates": [500100, 3000004]}
    feature = {"type": "Feature", "properties": {"tags": {"railway": "signal"}}, "geometry": place}
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32643"}}
    path = bench.folder / "places.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": [feature]}), encoding="utf-8")
    return path


def infinite_measure():
    return QgsGeometry(QgsLineString([QgsPoint(5e5, 3e6, m=0.0), QgsPoint(5.01e5, 3e6, m=math.inf)]))


def shape_of(line):
    """A line as well-known text, or what a function makes once QGIS runs."""
    return line() if callable(line) else line


def given(axis=(AXIS,), kind="LineString", crs="EPSG:32643", places=("Point", PLACE), **parameters):
    """A layer of places and an axis; a function among the parameters makes the value."""

    def prepare(bench):
        made = {name: value() if callable(value) else value for name, value in parameters.items()}
        return {
            "INPUT": layer_of(*places[1:], kind=places[0]),
            "AXIS": layer_of(*map(shape_of, axis), kind=kind, crs=crs),
            **made,
        }

    return prepare


def posts(*rows, fields="&field=km:double"):
    texts = [f"POINT({500_000 + east} {3_000_000 + north})" for east, north, _ in rows]
    return lambda: layer_of(*texts, kind="Point", fields=fields, values=[(km,) for _, _, km in rows])


def jumps(*rows, fields="&field=km_back:double&field=km_ahead:double"):
    return lambda: layer_of(kind="None", fields=fields, values=rows)


FAULTS = {
    "stationalongaxis": {
        "no axis": given(START_KM=1.0, AXIS=None),
        "axis without M values, start or posts": given(),
        "M values in feet": given(("LINESTRING M(500000 3000000 0, 501000 3000000 3280.8)",), "LineStringM"),
        "two axes and one start": given((AXIS, OTHER), START_KM=1.0),
        "axis in another coordinate system": given(
            ("LINESTRING M(75 27.1 12, 75.01 27.1 13)",), "LineStringM", "EPSG:4326"
        ),
        "axis and places in degrees": lambda bench: {
            "INPUT": layer_of("POINT(75 27.1)", kind="Point", crs="EPSG:4326"),
            "AXIS": layer_of("LINESTRING(75 27.1, 75.01 27.1)", kind="LineString", crs="EPSG:4326"),
            "START_KM": 1.0,
        },
        "posts out of order": given(POSTS=posts((0, 3, 1.0), (200, 3, 1.4), (300, 3, 1.3), (900, 3, 1.9))),
        "posts of another line": given(POSTS=posts((0, 90, 1.0), (200, 90, 1.2))),
        "a single post": given(POSTS=posts((0, 3, 1.0))),
        "posts without a field of kilometres": given(
            POSTS=posts((0, 3, 1.0), (200, 3, 1.2), fields="&field=board:double")
        ),
        "post with another text than a kilometre": given(
            POSTS=posts((0, 3, "km one"), (200, 3, "1.2"), fields="&field=km:string(9)")
        ),
        "a jump between posts that no table states": given(
            POSTS=posts((0, 3, 1.0), (100, 3, 1.1), (350, 3, 1.2), (450, 3, 1.3))
        ),
        "jumps that are not on the axis": given(START_KM=1.0, JUMPS=jumps((7.0, 7.5))),
        "gaps that are longer than the axis before the first post": given(
            POSTS=posts((100, 3, 1.48), (300, 3, 1.68)), JUMPS=jumps((1.0, 1.2), (1.25, 1.45))
        ),
        "table of jumps with other fields": given(
            START_KM=1.0, JUMPS=jumps((1.2, 1.3), fields="&field=a:double&field=b:double")
        ),
        "jumps for an axis with M values": given((AXIS_M,), "LineStringM", JUMPS=jumps((12.2, 12.3))),
        "places outside of any map": lambda bench: {
            **given(START_KM=1.0)(bench),
            "INPUT": layer_of(PLACE, "POINT(1e308 1e308)", kind="Point"),
        },
        "places with objects in a field": lambda bench: {**given(START_KM=1.0)(bench), "INPUT": with_objects(bench)},
        "post with a kilometre of 1e308": given(POSTS=posts((0, 3, 1.0), (200, 3, 1e308))),
        "post without a kilometre": given(POSTS=posts((0, 3, 1.0), (200, 3, None))),
        "post outside of any map": given(POSTS=posts((0, 3, 1.0), (100, 3, 1.1), (1e200, 3, 1.2))),
        "axis with a vertex outside of any map": given(("LINESTRING(500000 3000000, 1e200 3000000)",), START_KM=1.0),
        "axis with a vertex 1,000,000 km away": given(("LINESTRING(500000 3000000, 999999999 3000000)",), START_KM=1.0),
        "axis with an infinite M value": given((infinite_measure,), "LineStringM"),
        "axis with an infinite M value, and line breaks in its name": lambda bench: {
            **given()(bench),
            "AXIS": layer_of(
                infinite_measure(), kind="LineStringM", fields="&field=name:string", values=[("7\n  0\nEOF",)]
            ),
        },
        "start of an axis that is a text": given(START_KM="km one"),
        "jump to a kilometre of 1e308": given(START_KM=1.0, JUMPS=jumps((1.2, 1e308))),
        "table without places": given((AXIS_M,), "LineStringM", places=("None",)),
        "place between the arms of a hairpin": given(
            ("LINESTRING M(500000 3000000 0, 500500 3000000 500, 500500 3000100 600, 500000 3000100 1100)",),
            "LineStringM",
            places=("Point", "POINT(500200 3000048)"),
        ),
    },
    "measuretrackgeometry": {
        "start of an axis that is not given": lambda bench: {
            "INPUT": layer_of(LINE),
            "RAILS": layer_of(LINE),
            "START_KM": 3,
        },
    },
    "extractrails": {
        "kilometres for lines that are not measured": lambda bench: {
            "INPUT": bench.cloud(bench.track()),
            "AXIS": layer_of(AXIS_M, kind="LineStringM"),
            **dict.fromkeys(("QUALITY", "FINDINGS", "CLEANED")),
        },
    },
}


@pytest.mark.parametrize("fault", faults("Kilometres", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)
