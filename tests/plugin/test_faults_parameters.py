"""Invalid and contradictory parameters."""

import numpy as np
import pytest
from faults import WARNED, Fault, refused
from qgis.core import QgsVectorLayer

TITLE = "Parameters"

NAN, INFINITE = float("nan"), float("inf")
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


def same_file(bench):
    return {**with_()(bench), "RAILS": bench.folder / "out.gpkg", "CENTERLINES": bench.folder / "out.gpkg"}


def same_file_spelled_otherwise(bench):
    return {**same_file(bench), "CENTERLINES": bench.folder / "out" / ".." / "out.gpkg"}


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


FAULTS = [
    Fault(
        "SMOOTHING_XY too large for a sharp curve",
        in_a_sharp_curve(SMOOTHING_XY=2.5),
        WARNED,
        "SMOOTHING_XY of 2.5 m displaces lines in curves by up to … mm, more than points can correct: set it "
        "to … m or less.",
        {"RAIL_COUNT": 2, "CENTERLINE_COUNT": 1},
    ),
    Fault("SMOOTHING_XY suitable for a sharp curve", in_a_sharp_curve(SMOOTHING_XY=1.5)),
    *(
        refused(f"{name} not a number", with_(**{name: NAN}), f"{name} can't be nan: give a number.")
        for name in NUMBERS
    ),
    *(refused(f"{name} negative", with_(**{name: -1}), f"{name} can't be -1: give ….") for name in NUMBERS),
    *(refused(f"{name} zero", with_(**{name: 0}), f"{name} can't be 0: give ….") for name in POSITIVE),
    refused("infinite SMOOTHING_XY", with_(SMOOTHING_XY=INFINITE), "SMOOTHING_XY can't be inf: give …."),
    refused("text for a number", with_(SMOOTHING_XY="wide"), "SMOOTHING_XY can't be wide: give …."),
    refused(
        "impossible gauge", with_(GAUGE=300), "A gauge of 300 mm is not possible: give millimetres from 500 to 2000."
    ),
    refused(
        "gauge in metres instead of millimetres",
        with_(GAUGE=1.435),
        "A gauge of 1.435 mm is not possible: give millimetres from 500 to 2000.",
    ),
    refused(
        "impossible railhead width",
        with_(HEAD_WIDTH=200),
        "A railhead width of 200 mm is not possible: give millimetres from 40 to 90.",
    ),
    refused(
        "gauge and railhead width not covered by any model",
        with_(GAUGE=600, HEAD_WIDTH=75),
        "A gauge of 600 mm is 8.0 times a railhead of 75.0 mm, and the models cover 13.4 to 26.7 times: "
        "check GAUGE and HEAD_WIDTH.",
    ),
    refused(
        "CUSTOM without gauge and railhead width",
        with_(STANDARD="CUSTOM"),
        "STANDARD CUSTOM needs both the gauge and the railhead width, in millimetres: fill in GAUGE and HEAD_WIDTH.",
    ),
    refused(
        "CUSTOM without railhead width",
        with_(STANDARD="CUSTOM", GAUGE=1435),
        "STANDARD CUSTOM needs both the gauge and the railhead width, in millimetres: fill in GAUGE and HEAD_WIDTH.",
    ),
    refused(
        "unknown standard",
        with_(STANDARD="EN_99"),
        "STANDARD can't be EN_99: give one of its 48 choices, such as US_90ARAA_1435.",
    ),
    refused("unknown engine", with_(ENGINE="JAX"), "ENGINE can't be JAX: give one of its 3 choices, such as AUTO."),
    refused(
        "no class",
        with_(RAIL_CLASSES=""),
        "RAIL_CLASSES can't be empty: give classes of the points on rails, such as 10 or 10,11.",
    ),
    refused(
        "class as a word",
        with_(RAIL_CLASSES="ten"),
        'RAIL_CLASSES "ten" must be whole numbers from 0 to 255 such as 10 or 10,11.',
    ),
    refused(
        "range of classes",
        with_(RAIL_CLASSES="10-12"),
        'RAIL_CLASSES "10-12" must be whole numbers from 0 to 255 such as 10 or 10,11.',
    ),
    refused(
        "class above 255",
        with_(RAIL_CLASSES="300"),
        'RAIL_CLASSES "300" must be whole numbers from 0 to 255 such as 10 or 10,11.',
    ),
    refused(
        "class of 5,000 digits",
        with_(RAIL_CLASSES="9" * 5000),
        f'RAIL_CLASSES "{"9" * 99}… must be whole numbers from 0 to 255 such as 10 or 10,11.',
    ),
    refused(
        "class without points",
        with_(RAIL_CLASSES="11"),
        "The cloud has no points of class 11; its classes, with the number of points, are 10 (3,600): set the rail "
        "classes or, if nobody has classified the cloud, CLASSIFY.",
    ),
    refused(
        "other gauges as words",
        with_(OTHER_GAUGES="wide"),
        'OTHER_GAUGES "wide" must be millimetres such as 1000;1067, or 1000/66 with the width of the railhead.',
    ),
    refused(
        "other gauge of zero",
        with_(OTHER_GAUGES="0"),
        'OTHER_GAUGES "0" must be millimetres such as 1000;1067, or 1000/66 with the width of the railhead.',
    ),
    refused(
        "railhead of another gauge too wide",
        with_(OTHER_GAUGES="1000/660"),
        "A railhead width of 660 mm is not possible: give millimetres from 40 to 90.",
    ),
    refused(
        "two railhead widths on one gauge",
        with_(OTHER_GAUGES="1000/66;1000/72"),
        "Tracks of 1000 mm gauge can't have railheads of 66 and 72 mm: give one width.",
    ),
    refused(
        "other gauge too close to the gauge",
        with_(OTHER_GAUGES="1440"),
        "Gauges of 1435 and 1440 mm can't be distinguished within CENTERLINE_TOLERANCE (0.05 m): give one of them, "
        "or a smaller tolerance.",
    ),
    refused(
        "tolerance larger than the difference of the gauges",
        with_(OTHER_GAUGES="1067", CENTERLINE_TOLERANCE=0.5),
        "Gauges of 1067 and 1435 mm can't be distinguished within CENTERLINE_TOLERANCE (0.5 m): give one of them, or "
        "a smaller tolerance.",
    ),
    refused(
        "extent outside the cloud",
        with_(EXTENT="0,1,0,1"),
        "The extent contains no points of class 10: choose a larger extent.",
    ),
    refused(
        "extent without area",
        with_(EXTENT="500000,500000,3000000,3000001"),
        "EXTENT has no area, or an infinite one: give a rectangle as xmin,xmax,ymin,ymax, or leave it empty.",
    ),
    *(
        refused(
            f"extent {what}",
            prepare,
            "EXTENT has no area, or an infinite one: give a rectangle as xmin,xmax,ymin,ymax, or leave it empty.",
        )
        for what, prepare in (
            ("of zeros", with_(EXTENT="0,0,0,0")),
            ("of a layer without features", with_extent_of_nothing),
            ("with an infinite side", with_(EXTENT="-inf,inf,0,1")),
        )
    ),
    refused("invalid extent", with_(EXTENT="here"), "EXTENT can't be here: give four numbers: xmin,xmax,ymin,ymax."),
    refused(
        "extent outside the cloud, in another coordinate system",
        with_(EXTENT="0,1,0,1 [EPSG:4326]"),
        "The extent contains no points of class 10: choose a larger extent.",
    ),
    refused(
        "invalid coordinate system",
        with_(CRS="EPSG:0"),
        "CRS EPSG:0 is not a coordinate system: choose one from the list.",
    ),
    refused(
        "OPENCV on a GPU",
        with_(ENGINE="OPENCV", DEVICE="CUDA"),
        "ENGINE OPENCV runs on the CPU only: set DEVICE to AUTO, or ENGINE to TORCH.",
    ),
    refused(
        "no cloud",
        lambda bench: {"INPUT": None},
        "INPUT can't be empty: give a loaded point cloud layer, or the path of a LAS, LAZ or COPC file, of a "
        "folder of such files, or of a virtual point cloud (.vpc).",
    ),
    refused("two outputs in one file", same_file, "RAILS and CENTERLINES are the same file: give each its own name."),
    refused(
        "two outputs in one file, with different spellings",
        same_file_spelled_otherwise,
        "RAILS and CENTERLINES are the same file: give each its own name.",
    ),
    refused(
        "a file for one output, a table in it for another",
        file_and_table_of_it,
        "RAILS and CENTERLINES are the same file: give each its own name.",
    ),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, fault):
    meet(fault, "extractrails")
