"""Faults of raw clouds, in Classify Rail Points and in Extract Rails with CLASSIFY."""

import numpy as np
import pytest
from faults import cancelled, faults, full_disk
from memory_layers import layer_of
from rail_extract.laboratory.scenes.las import write_las
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, with_track

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])
STRIP = "500016,500016.2,3000000,3000100"
"""Extent that holds few points of the cloud: they take less space than the copy of the cloud."""


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


def old_format(bench):
    path = write_las(bench.folder / "old.las", ballast() + CORNER, point_format=1)
    return {"INPUT": path, "CRS": "EPSG:32643", "RAIL_CLASS": 40}


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
        return {**raw(**parameters)(bench), "GUIDE": layer_of(text, kind="LineString", crs=crs)}

    return prepare


FAULTS = {
    "classifyrailpoints": {
        "raw cloud with ground only": ground,
        "raw cloud with coordinates in millimetres": raw(lambda xyz: 1000 * xyz),
        "raw cloud with an extent elsewhere": raw(EXTENT="600000,600010,3000000,3000010"),
        "raw cloud, other gauge almost equal to the gauge": raw(OTHER_GAUGES="1450"),
        "guide far from the cloud": guide("LINESTRING(510000 3000000, 511000 3000000)"),
        "guide beside the extent": guide(
            "LINESTRING(500000 3000016, 500040 3000016.1)", EXTENT="500016,500024,3000023.5,3000030"
        ),
        "guide with the coordinates of another system": guide(
            "LINESTRING(500000 3000020, 500040 3000020)", "EPSG:4326"
        ),
        "guide outside of any map": guide("LINESTRING(500000 3000020, 1e200 3000020)"),
        "guide with a stray vertex": guide("LINESTRING(500000 3000020, 550000 3000020, 500040 3000020)"),
        "mask outside of any map": lambda bench: {
            **raw()(bench),
            "MASK": layer_of(
                "POLYGON((500000 3000000, 1e200 3000000, 500000 3000040, 500000 3000000))", kind="Polygon"
            ),
        },
        "only the tracks along a guide that is missing": raw(ONLY_GUIDED=True),
        "guide across the tracks": guide("LINESTRING(500022 3000010, 500018 3000030)"),
        "only the tracks along a guide beside the track": guide(
            "LINESTRING(500000 3000015.8, 500040 3000028.2)", ONLY_GUIDED=True
        ),
        "class beyond the range of an old point format": old_format,
        "classified cloud in the place of the raw one": in_its_place,
        "two tiles with one name": two_names,
        "classified cloud with the suffix .txt": raw(OUTPUT="new.txt"),
        "full disk, classified LAS file": full_disk(raw(EXTENT=STRIP), 200_000, ".las"),
        "full disk, classified LAZ file": full_disk(raw(EXTENT=STRIP), 200_000, ".laz"),
        "full disk, temporary points of a raw cloud": full_disk(raw(), 1000, ".laz"),
        "classification cancelled at 5 %": cancelled(raw(), 5),
        "classification cancelled at 50 %": cancelled(raw(), 50),
        "classification cancelled at 66 %": cancelled(raw(), 66),
    },
    "extractrails": {
        "extraction from a raw cloud with ground only": lambda bench: {**ground(bench), "CLASSIFY": True},
        "rail standard to be detected from a raw cloud with ground only": lambda bench: {
            **ground(bench),
            "CLASSIFY": True,
            "STANDARD": "DETECT",
        },
    },
}


@pytest.mark.parametrize("fault", faults("Raw clouds", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)
