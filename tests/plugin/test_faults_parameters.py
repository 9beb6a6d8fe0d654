"""Invalid and contradictory parameters."""

import numpy as np
import pytest
from faults import faults
from qgis.core import QgsVectorLayer

NAN = float("nan")
PLACE = np.array([500_000.0, 3_000_000.0, 100.0])
POSITIVE = (
    *("GAUGE", "HEAD_WIDTH", "SMOOTHING_XY", "SMOOTHING_Z", "TOLERANCE_XY", "TOLERANCE_Z", "CROWN_RADIUS"),
    *("CENTERLINE_TOLERANCE", "STEP"),
)
NUMBERS = (*POSITIVE, "ITERATIONS", "MAX_GAP", "GAP_ANGLE", "SIMPLIFY_XY", "SIMPLIFY_Z", "MIN_LENGTH")
"""All numbers of Extract Rails; those in `POSITIVE` must not be zero."""


def with_(**parameters):
    """A valid cloud and these parameters."""
    return lambda bench: {"INPUT": bench.cloud(bench.track(length_m=6.0)), **parameters}


def with_extent_of_nothing(bench):
    return with_(EXTENT=QgsVectorLayer("Point?crs=EPSG:32643", "none", "memory"))(bench)


def with_mask_of_nothing(bench):
    return with_(MASK=QgsVectorLayer("Polygon?crs=EPSG:32643", "none", "memory"))(bench)


def same_file(bench):
    """The same file, spelled in two ways."""
    return {
        **with_()(bench),
        "RAILS": bench.folder / "out.gpkg",
        "CENTERLINES": bench.folder / "out" / ".." / "out.gpkg",
    }


def file_and_table_of_it(bench):
    return {**same_file(bench), "CENTERLINES": f"ogr:dbname='{bench.folder / 'out.gpkg'}' table=\"tracks\" (geom)"}


def in_a_sharp_curve(**parameters):
    """The track in a curve of radius 25 m, and these parameters."""

    def prepare(bench):
        along, across, z = (bench.track(length_m=24.0) - PLACE).T
        angle, radius_m = along / 25.0, 25.0 - across
        points = PLACE + np.column_stack([radius_m * np.sin(angle), 25.0 - radius_m * np.cos(angle), z])
        return {"INPUT": bench.cloud(points), "ITERATIONS": 1, **parameters}

    return prepare


FAULTS = {
    "extractrails": {
        "SMOOTHING_XY too large for a sharp curve": in_a_sharp_curve(SMOOTHING_XY=2.5),
        "SMOOTHING_XY suitable for a sharp curve": in_a_sharp_curve(SMOOTHING_XY=1.5),
        "number that is not a number": with_(STEP=NAN),
        "negative number": with_(MAX_GAP=-1),
        "number that must not be zero": with_(STEP=0),
        "impossible gauge": with_(GAUGE=300),
        "impossible railhead width": with_(HEAD_WIDTH=200),
        "gauge and railhead width not covered by any model": with_(GAUGE=600, HEAD_WIDTH=75),
        "CUSTOM without railhead width": with_(STANDARD="CUSTOM", GAUGE=1435),
        "unknown standard": with_(STANDARD="EN_99"),
        "unknown engine": with_(ENGINE="JAX"),
        "no class": with_(RAIL_CLASSES=""),
        "range of classes": with_(RAIL_CLASSES="10-12"),
        "class of 5,000 digits": with_(RAIL_CLASSES="9" * 5000),
        "class without points": with_(RAIL_CLASSES="11"),
        "other gauge of zero": with_(OTHER_GAUGES="0"),
        "two railhead widths on one gauge": with_(OTHER_GAUGES="1000/66;1000/72"),
        "other gauge too close to the gauge": with_(OTHER_GAUGES="1440"),
        "extent outside the cloud": with_(EXTENT="0,1,0,1"),
        "extent of a layer without features": with_extent_of_nothing,
        "mask without polygons": with_mask_of_nothing,
        "extent with an infinite side": with_(EXTENT="-inf,inf,0,1"),
        "invalid extent": with_(EXTENT="here"),
        "invalid coordinate system": with_(CRS="EPSG:0"),
        "OPENCV on a GPU": with_(ENGINE="OPENCV", DEVICE="CUDA"),
        "no cloud": lambda bench: {"INPUT": None},
        "two outputs in one file, with different spellings": same_file,
        "a file for one output, a table in it for another": file_and_table_of_it,
    },
}


@pytest.mark.parametrize("fault", faults("Parameters", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)


def test_every_number_has_its_range(run, bench):
    given = with_()(bench)
    for name in NUMBERS:
        for value in (NAN, -1, *[0] * (name in POSITIVE)):
            assert run({**given, name: value}).error.startswith(f"{name} can't be {value}: give "), (name, value)
