"""Faults of airborne clouds and their guides, in Track Centerlines from Airborne Lidar."""

import numpy as np
import pytest
from faults import refused
from memory_layers import layer_of

TITLE = "Airborne clouds"

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])
ALONG = "LINESTRING(500000 3000005, 500060 3000005)"


def cloud(bench, density=10, class_code=2, width_m=10.0):
    """A field 60 m long."""
    count = int(60 * width_m * density)
    xyz = np.random.RandomState(1).uniform(0, 1, (count, 3)) * [60.0, width_m, 0.05] + CORNER
    return bench.cloud(xyz, "air.laz", class_code)


def guided(*texts, kind="LineString", crs="EPSG:32643", density=10, class_code=2, **parameters):
    def prepare(bench):
        guide = layer_of(*texts, kind=kind, crs=crs)
        return {"INPUT": cloud(bench, density, class_code), "GUIDE": guide, **parameters}

    return prepare


FAULTS = [
    refused(
        "neither a guide nor a layer for proposals",
        lambda bench: {"INPUT": cloud(bench)},
        "GUIDE is empty: choose lines along the tracks, or PROPOSED to have some proposed.",
    ),
    refused(
        "mobile lidar without a guide",
        lambda bench: {"INPUT": cloud(bench, density=800), "PROPOSED": "TEMPORARY_OUTPUT"},
        "The cloud has 800 points per square metre, as mobile lidar and dense drone surveys have: use Extract Rails, "
        "which finds the single railheads and is more accurate there.",
    ),
    refused("guide without lines", guided(), "GUIDE has no lines: give a line layer."),
    refused(
        "polygons as guide",
        guided("POLYGON((500000 3000004, 500060 3000004, 500060 3000006, 500000 3000004))", kind="Polygon"),
        "GUIDE has the geometry type Polygon: give a line layer.",
    ),
    refused(
        "guide outside of the cloud",
        guided("LINESTRING(510000 3000005, 510060 3000005)"),
        "No guide lies in the cloud: check the coordinate system of the guides, and that the cloud covers the line.",
    ),
    refused(
        "guide in degrees that does not say so",
        guided("LINESTRING(75 27.12, 75.001 27.12)"),
        "The guides are in degrees, but state another coordinate system or none: assign WGS 84 (EPSG:4326).",
    ),
    refused(
        "guide that is too short",
        guided("LINESTRING(500000 3000005, 500012 3000005)"),
        "Guide 1 is 12.0 m long: give guides of 30 m or more.",
    ),
    refused(
        "airborne cloud of another class",
        guided(ALONG, class_code=6),
        "The cloud has no points of class 1, 2 along the guides: set the classes, and check the coordinate system of "
        "the guides.",
    ),
    refused(
        "mobile lidar as airborne cloud",
        guided(ALONG, density=800),
        "The cloud has 799 points per square metre, as mobile lidar and dense drone surveys have: use Extract Rails, "
        "which finds the single railheads and is more accurate there.",
    ),
    refused(
        "airborne cloud in Extract Rails",
        lambda bench: {"INPUT": cloud(bench, width_m=30.0)},
        "The cloud has no points of class 10; its classes, with the number of points, are 2 (18,000): set the rail "
        "classes or, if nobody has classified the cloud, CLASSIFY. For an airborne cloud, use Track Centerlines from "
        "Airborne Lidar.",
        run="extractrails",
    ),
    refused(
        "airborne cloud with classified rails in Extract Rails",
        lambda bench: {"INPUT": cloud(bench, density=2, width_m=30.0, class_code=10)},
        "The points of class 10 are … m apart over … m, too far for rails: if the coordinates are in centimetres or "
        "millimetres, assign a coordinate system that says so. For an airborne cloud, use Track Centerlines from "
        "Airborne Lidar.",
        run="extractrails",
    ),
    refused(
        "raw airborne cloud in Extract Rails",
        lambda bench: {"INPUT": cloud(bench, width_m=30.0), "CLASSIFY": True},
        "No rail was found in the raw cloud: check the rail standard and the unit of the coordinates, or classify the "
        "rail points yourself. For an airborne cloud, use Track Centerlines from Airborne Lidar.",
        run="extractrails",
    ),
    refused(
        "text as classes of an airborne cloud",
        guided(ALONG, CLASSES="ground"),
        'CLASSES "ground" must be whole numbers from 0 to 255 such as 10 or 10,11.',
    ),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, fault):
    meet(fault, "airbornecenterlines")
