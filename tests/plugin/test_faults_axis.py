"""Faults of axes, posts and jumps, in Station Along Axis."""

import pytest
from faults import WARNED, Fault, refused
from memory_layers import layer_of

TITLE = "Kilometres"

AXIS = "LINESTRING(500000 3000000, 501000 3000000)"
AXIS_M = "LINESTRING M(500000 3000000 12, 501000 3000000 13)"
OTHER = "LINESTRING(500000 3000400, 501000 3000400)"
PLACE = "POINT(500100 3000004)"


def given(axis=(AXIS,), kind="LineString", crs="EPSG:32643", places=("Point", PLACE), **parameters):
    """A layer of places and an axis; a function among the parameters makes the value."""

    def prepare(bench):
        made = {name: value() if callable(value) else value for name, value in parameters.items()}
        return {"INPUT": layer_of(*places[1:], kind=places[0]), "AXIS": layer_of(*axis, kind=kind, crs=crs), **made}

    return prepare


def posts(*rows, fields="&field=km:double"):
    texts = [f"POINT({500_000 + east} {3_000_000 + north})" for east, north, _ in rows]
    return lambda: layer_of(*texts, kind="Point", fields=fields, values=[(km,) for _, _, km in rows])


def jumps(*rows, fields="&field=km_back:double&field=km_ahead:double"):
    return lambda: layer_of(kind="None", fields=fields, values=rows)


def without_axis(bench):
    return {**given(START_KM=1.0)(bench), "AXIS": None}


FAULTS = [
    refused("no axis", without_axis, "AXIS can't be empty: give a vector layer, or a vector file that can be read."),
    refused(
        "axis without M values, start or posts",
        given(),
        "AXIS has no M values: fill in START_KM, or give POSTS or an axis whose vertices have kilometres as M.",
    ),
    refused(
        "M values in feet",
        given(("LINESTRING M(500000 3000000 0, 501000 3000000 3280.8)",), "LineStringM"),
        "AXIS has M values that change by 3.28 per metre, so they are neither metres nor kilometres: fill in START_KM, "
        "or correct them.",
    ),
    refused(
        "two axes and one start",
        given((AXIS, OTHER), START_KM=1.0),
        "AXIS has 2 lines that do not follow each other, but START_KM is for one: choose a single line, or "
        "give M values.",
    ),
    refused("empty axis", given(()), "AXIS has no lines: give a line layer."),
    refused(
        "layer of points as the axis", given((PLACE,), "Point"), "AXIS has the geometry type Point: give a line layer."
    ),
    Fault(
        "axis in another coordinate system",
        given(("LINESTRING M(75 27.1 12, 75.01 27.1 13)",), "LineStringM", "EPSG:4326"),
        WARNED,
        "AXIS is in EPSG:4326 and was transformed to EPSG:32643. AXIS is 991.3 m long between km 12.000 and km "
        "13.000, where the numbers differ by 1000.0 m: they are spread evenly.",
        {"PLACE_COUNT": 1},
    ),
    refused(
        "axis and places in degrees",
        lambda bench: {
            "INPUT": layer_of("POINT(75 27.1)", kind="Point", crs="EPSG:4326"),
            "AXIS": layer_of("LINESTRING(75 27.1, 75.01 27.1)", kind="LineString", crs="EPSG:4326"),
            "START_KM": 1.0,
        },
        "AXIS and INPUT are in degrees, where lengths can't be measured: reproject AXIS, for example to the UTM zone "
        "of the place.",
    ),
    refused(
        "posts out of order",
        given(POSTS=posts((0, 3, 1.0), (200, 3, 1.4), (300, 3, 1.3), (900, 3, 1.9))),
        "The kilometres are out of order: km 1.300 follows km 1.400 along AXIS: correct the posts or M values, or "
        "state an overlap in JUMPS.",
    ),
    refused(
        "posts of another line",
        given(POSTS=posts((0, 90, 1.0), (200, 90, 1.2))),
        "No post is within 50 m of the axis 1: check POSTS and their coordinate system.",
    ),
    refused(
        "a single post",
        given(POSTS=posts((0, 3, 1.0))),
        "The axis 1 has one post, which does not show where kilometres increase: give a second one.",
    ),
    refused(
        "posts without a field of kilometres",
        given(POSTS=posts((0, 3, 1.0), (200, 3, 1.2), fields="&field=board:double")),
        "POSTS has no field km, kilometre, kilometer, km_text, station: choose the field with the kilometre in "
        "POST_FIELD.",
    ),
    refused(
        "post with another text than a kilometre",
        given(POSTS=posts((0, 3, "km one"), (200, 3, "1.2"), fields="&field=km:string(9)")),
        "POSTS has a row (feature 1) whose field km is 'km one' and no kilometre: correct it, or delete the row.",
    ),
    Fault(
        "a jump between posts that no table states",
        given(POSTS=posts((0, 3, 1.0), (100, 3, 1.1), (350, 3, 1.2), (450, 3, 1.3))),
        WARNED,
        "AXIS is 150.0 m longer than the numbers from km 1.100 to km 1.200: taken as a jump from km 1.350 to km 1.200.",
        {"PLACE_COUNT": 1},
    ),
    refused(
        "jumps that are not on the axis",
        given(START_KM=1.0, JUMPS=jumps((7.0, 7.5))),
        "The jump from km 7.000 to km 7.500 is not on AXIS: correct JUMPS, whose rows must be in the order of "
        "increasing kilometres.",
    ),
    refused(
        "table of jumps with other fields",
        given(START_KM=1.0, JUMPS=jumps((1.2, 1.3), fields="&field=a:double&field=b:double")),
        "JUMPS has no field km_back: give a table with km_back, the kilometre before each jump, and km_ahead, the one "
        "behind it.",
    ),
    refused(
        "jumps for an axis with M values",
        given((AXIS_M,), "LineStringM", JUMPS=jumps((12.2, 12.3))),
        "JUMPS need START_KM or POSTS: M values of AXIS contain their jumps.",
    ),
    refused(
        "table without places",
        given((AXIS_M,), "LineStringM", places=("None",)),
        "INPUT is a table without places: give a layer of points, lines or polygons.",
    ),
    Fault(
        "place between the arms of a hairpin",
        given(
            ("LINESTRING M(500000 3000000 0, 500500 3000000 500, 500500 3000100 600, 500000 3000100 1100)",),
            "LineStringM",
            places=("Point", "POINT(500200 3000048)"),
        ),
        WARNED,
        "1 of 1 places are nearly as close to another place of AXIS: check the kilometres of those whose field "
        "ambiguous is 1.",
        {"AMBIGUOUS_COUNT": 1},
    ),
    refused(
        "kilometres for lines that are not measured",
        lambda bench: {
            "INPUT": bench.cloud(bench.track()),
            "AXIS": layer_of(AXIS_M, kind="LineStringM"),
            **dict.fromkeys(("QUALITY", "FINDINGS", "CLEANED")),
        },
        "AXIS gives QUALITY, FINDINGS and REPORT kilometres: name at least one of these.",
        run="extractrails",
    ),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, fault):
    meet(fault, "stationalongaxis")
