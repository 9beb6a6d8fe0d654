"""Faults of airborne clouds and their guides, in Track Centerlines from Airborne Lidar."""

import numpy as np
import pytest
from faults import REFUSED, Fault
from qgis.core import QgsFeature, QgsGeometry, QgsVectorLayer

TITLE = "Airborne clouds"

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])
ALONG = "LINESTRING(500000 3000005, 500060 3000005)"


def cloud(bench, density=10, class_code=2):
    """A field of 60 m by 10 m."""
    count = 600 * density
    xyz = np.random.RandomState(1).uniform(0, 1, (count, 3)) * [60.0, 10.0, 0.05] + CORNER
    return bench.cloud(xyz, "air.laz", class_code)


def guided(*texts, kind="LineString", crs="EPSG:32643", density=10, class_code=2, **parameters):
    def prepare(bench):
        layer = QgsVectorLayer(f"{kind}?crs={crs}", "guides", "memory")
        for text in texts:
            feature = QgsFeature(layer.fields())
            feature.setGeometry(QgsGeometry.fromWkt(text))
            assert layer.dataProvider().addFeature(feature)
        return {"INPUT": cloud(bench, density, class_code), "GUIDE": layer, **parameters}

    return prepare


FAULTS = [
    Fault("guide without lines", guided(), REFUSED, "GUIDE has no lines: give a line layer."),
    Fault(
        "guide outside of the cloud",
        guided("LINESTRING(510000 3000005, 510060 3000005)"),
        REFUSED,
        "No guide lies in the cloud: check the coordinate system of the guides, and that the cloud covers the line.",
    ),
    Fault(
        "guide in degrees that does not say so",
        guided("LINESTRING(75 27.12, 75.001 27.12)"),
        REFUSED,
        "The guides are in degrees, but state another coordinate system or none: assign WGS 84 (EPSG:4326).",
    ),
    Fault(
        "guide that is too short",
        guided("LINESTRING(500000 3000005, 500012 3000005)"),
        REFUSED,
        "Guide 1 is 12.0 m long: give guides of 30 m or more.",
    ),
    Fault(
        "airborne cloud of another class",
        guided(ALONG, class_code=6),
        REFUSED,
        "The cloud has no points of class 1, 2 along the guides: set the classes, and check the coordinate system of "
        "the guides.",
    ),
    Fault(
        "mobile lidar as airborne cloud",
        guided(ALONG, density=800),
        REFUSED,
        "The cloud has 799 points per square metre along the guides, as mobile lidar has: use Extract Rails, which "
        "finds the single railheads and is more accurate there.",
    ),
    Fault(
        "text as classes of an airborne cloud",
        guided(ALONG, CLASSES="ground"),
        REFUSED,
        'CLASSES "ground" must be whole numbers from 0 to 255 such as 10 or 10,11.',
    ),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, fault):
    meet(fault, "airbornecenterlines")
