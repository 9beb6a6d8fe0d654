"""Faults of airborne clouds and their guides, in Track Centerlines from Airborne Lidar."""

import numpy as np
import pytest
from faults import faults
from memory_layers import layer_of

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])
ALONG = "LINESTRING(500000 3000005, 500060 3000005)"


def cloud(bench, density=10, class_code=2, width_m=10.0):
    """A field 60 m long."""
    count = int(60 * width_m * density)
    xyz = np.random.RandomState(1).uniform(0, 1, (count, 3)) * [60.0, width_m, 0.05] + CORNER
    return bench.cloud(xyz, "air.laz", class_code)


def guided(line, density=10, class_code=2):
    return lambda bench: {"INPUT": cloud(bench, density, class_code), "GUIDE": layer_of(line, kind="LineString")}


FAULTS = {
    "airbornecenterlines": {
        "airborne cloud without a guide": lambda bench: {"INPUT": cloud(bench)},
        "guide outside of the cloud": guided("LINESTRING(510000 3000005, 510060 3000005)"),
        "guide in degrees that does not say so": guided("LINESTRING(75 27.12, 75.001 27.12)"),
        "guide that is too short": guided("LINESTRING(500000 3000005, 500012 3000005)"),
        "airborne cloud of another class": guided(ALONG, class_code=6),
        "mobile lidar as airborne cloud": guided(ALONG, density=800),
    },
    "extractrails": {
        "airborne cloud in Extract Rails": lambda bench: {"INPUT": cloud(bench, width_m=30.0)},
        "raw airborne cloud in Extract Rails": lambda bench: {"INPUT": cloud(bench, width_m=30.0), "CLASSIFY": True},
    },
}


@pytest.mark.parametrize("fault", faults("Airborne clouds", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)
