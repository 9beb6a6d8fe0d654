"""Faults of raw clouds, in Classify Rail Points and in Extract Rails with CLASSIFY."""

import resource

import laspy
import numpy as np
import pytest
from faults import WARNED, Fault, refused
from memory_layers import layer_of
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, with_track

TITLE = "Raw clouds"

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])
NO_RAIL = (
    "No rail was found: check the rail standard and the unit of the coordinates. A cloud that contains only rail "
    "points needs no classification."
)
STRIP = "500016,500016.2,3000000,3000100"
"""Extent that holds few points of the cloud: they take less space than the copy of the cloud."""

NOTHING = {"RAIL_POINTS": 0, "PAIRED_LENGTH": 0.0}


def ballast(per_m2=1500, tracks=True):
    """Points of 8 m of track, or of the ground only."""
    rng = np.random.RandomState(3)
    xyz = flat(8.0, rng=rng, per_m2=per_m2)
    if tracks:
        xyz, _ = with_track(xyz, 1.435, 0.072, 0.3)
    return rough(xyz, rng)


def raw(change=lambda xyz: xyz, name="raw.laz", **parameters):
    """A raw cloud, changed, and these parameters."""
    return lambda bench: {"INPUT": bench.cloud(change(ballast()) + CORNER, name, 2), **parameters}


def ground(bench):
    return {"INPUT": bench.cloud(ballast(tracks=False) + CORNER, "raw.laz", 2)}


def only_rails(bench):
    return {"INPUT": bench.cloud(bench.track(), "raw.laz", 10)}


def old_format(bench):
    header = laspy.LasHeader(point_format=1, version="1.2")
    header.scales, header.offsets = [0.001] * 3, CORNER
    cloud = laspy.LasData(header)
    cloud.xyz = ballast() + CORNER
    cloud.write(bench.folder / "old.las")
    return {"INPUT": bench.folder / "old.las", "CRS": "EPSG:32643", "RAIL_CLASS": 40}


def two_names(bench):
    """Tiles a.laz and a.copc.laz, which becomes a.laz."""
    tiles = bench.folder / "tiles"
    tiles.mkdir()
    for name in ("a.laz", "a.copc.laz"):
        bench.cloud(ballast() + CORNER, name, 2, folder=tiles)
    return {"INPUT": tiles}


def in_its_place(bench):
    path = bench.cloud(ballast() + CORNER, "raw.laz", 2)
    return {"INPUT": path, "OUTPUT": path}


def guide(text, crs="EPSG:32643", **parameters):
    """A raw cloud, and a line layer with this line."""

    def prepare(bench):
        return {**raw(**parameters)(bench), "GUIDE": layer_of(*filter(None, [text]), kind="LineString", crs=crs)}

    return prepare


def full_disk(room, suffix=".laz", **parameters):
    """A disk that takes files of up to `room` bytes; further writing fails as on a full disk."""

    def prepare(bench):
        values = raw(**parameters)(bench)
        soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        bench.run.callback(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard)))
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
        return {**values, "OUTPUT": bench.folder / "out" / f"OUTPUT{suffix}"}

    return prepare


def cancelled(percent):
    def prepare(bench):
        bench.feedback.progressChanged.connect(lambda done: bench.feedback.cancel() if done >= percent else None)
        return raw()(bench)

    return prepare


FAULTS = [
    Fault("raw cloud with ground only", ground, WARNED, NO_RAIL, NOTHING),
    Fault("raw cloud that contains only rail points", only_rails, WARNED, NO_RAIL, NOTHING),
    refused(
        "raw cloud with coordinates in millimetres",
        raw(lambda xyz: 1000 * xyz),
        "The points of raw.laz are too far apart for rails: if the coordinates are in centimetres or millimetres, "
        "assign a coordinate system that says so.",
    ),
    refused(
        "raw cloud with an extent elsewhere",
        raw(EXTENT="600000,600010,3000000,3000010"),
        "The extent contains no points that are neither noise nor withheld: choose another.",
    ),
    refused(
        "raw cloud, other gauge almost equal to the gauge",
        raw(OTHER_GAUGES="1450"),
        "Gauges of 1435 and 1450 mm can't be distinguished: give one of them.",
    ),
    refused(
        "guide far from the cloud",
        guide("LINESTRING(510000 3000000, 511000 3000000)"),
        "The guide has no line within 4 m of the cloud: check its place and coordinate system.",
    ),
    refused(
        "guide beside the extent",
        guide("LINESTRING(500000 3000016, 500040 3000016.1)", EXTENT="500016,500024,3000023.5,3000030"),
        "The extent has no point within 4 m of the guide: check the guide's place and coordinate system.",
    ),
    refused(
        "guide with the coordinates of another system",
        guide("LINESTRING(500000 3000020, 500040 3000020)", "EPSG:4326"),
        "GUIDE can't be transformed to the coordinate system of the cloud (EPSG:32643): check that both are assigned "
        "as the data were made.",
    ),
    refused("guide without lines", guide(""), "GUIDE has no lines: give a line layer."),
    refused(
        "only the tracks along a guide that is missing",
        raw(ONLY_GUIDED=True),
        "ONLY_GUIDED needs lines to compare tracks with: choose GUIDE.",
    ),
    Fault(
        "guide across the tracks",
        guide("LINESTRING(500022 3000010, 500018 3000030)"),
        WARNED,
        "The guide crosses the tracks: 16 m of the rails near it run across it, and 0 m along it. Draw it along the "
        "tracks.",
        {},
    ),
    Fault(
        "only the tracks along a guide beside the track",
        guide("LINESTRING(500000 3000015.8, 500040 3000028.2)", ONLY_GUIDED=True),
        WARNED,
        "No track has the guide within 0.5 m of its middle: draw the guide along the middle of the track, or search "
        "for all tracks near it.",
        NOTHING,
    ),
    refused(
        "class beyond the range of an old point format",
        old_format,
        "old.las has point format 1, whose classes end at 31: choose a class up to 31, or export the cloud with point "
        "format 6.",
    ),
    refused(
        "classified cloud in the place of the raw one",
        in_its_place,
        "The classified cloud would replace the cloud that is read: choose another name.",
    ),
    refused("two tiles with one name", two_names, "Two tiles are called a.laz: classify them one folder at a time."),
    refused(
        "classified cloud with the suffix .txt",
        raw(OUTPUT="new.txt"),
        "new.txt is not a name for the classified cloud: let it end in .las or .laz.",
    ),
    *(
        refused(
            f"full disk, classified {suffix[1:].upper()} file",
            full_disk(200_000, suffix, EXTENT=STRIP),
            "The output …/out/OUTPUT… can't be written (…): free space on the disk, or choose another place.",
        )
        for suffix in (".las", ".laz")
    ),
    refused(
        "full disk, temporary points of a raw cloud",
        full_disk(1000),
        "… can't be written to (…): free space on the disk, or choose another folder.",
    ),
    *(
        refused(f"classification cancelled at {percent} %", cancelled(percent), "Cancelled; nothing was written.")
        for percent in (5, 50, 66)
    ),
    refused(
        "extraction from a raw cloud with ground only",
        lambda bench: {**ground(bench), "CLASSIFY": True},
        "No rail was found in the raw cloud: check the rail standard and the unit of the coordinates, or classify the "
        "rail points yourself.",
        run="extractrails",
    ),
    refused(
        "rail standard to be detected from a raw cloud with ground only",
        lambda bench: {**ground(bench), "CLASSIFY": True, "STANDARD": "DETECT"},
        "No rail standard could be detected: choose STANDARD, or fill in GAUGE and HEAD_WIDTH.",
        run="extractrails",
    ),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, fault):
    meet(fault, "classifyrailpoints")
