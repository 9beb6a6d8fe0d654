"""Invalid and unusual point cloud files."""

import shutil
import struct

import laspy
import numpy as np
import pytest
from faults import FINE, faults
from osgeo import gdal
from rail_extract.rail_extract_plugin.setup import dependencies

HEADER, RECORDS_AT, SCALE_AT, COUNT_AT, LATE_AT = 375, 100, 131, 247, 235
"""Length of a LAS 1.4 header, and offsets of its fields, in bytes."""

POINT_6 = 30
"""Length of a point of format 6, in bytes."""


def holding(text, name="cloud.las"):
    """A file with this content."""

    def prepare(bench):
        (bench.folder / name).write_text(text)
        return {"INPUT": bench.folder / name}

    return prepare


def damaged(change, name="cloud.las"):
    """A valid file with changed bytes."""

    def prepare(bench):
        path = bench.cloud(bench.track(length_m=6.0), name, any_chunk_size=name.endswith(".copc.laz"))
        path.write_bytes(change(path.read_bytes()))
        return {"INPUT": path}

    return prepare


def overwritten(at, value):
    return lambda data: data[:at] + value + data[at + len(value) :]


def points_at(data):
    return struct.unpack_from("<I", data, 96)[0]


def chunk_table_at(data):
    return struct.unpack_from("<q", data, points_at(data))[0]


def with_late_record_cut(data):
    """Announce a record after the points, of which only half exists."""
    late = struct.pack("<QI", len(data), 1)
    return data[:LATE_AT] + late + data[LATE_AT + 12 :] + bytes(30)


def with_broken_chunk_table(data):
    """Damage the table of chunks so that lazrs panics on it."""
    return overwritten(chunk_table_at(data) + 8, b"\xff" * 4)(data)


def with_large_layer(data):
    """State in the first chunk that its last layer has 3.8 GB."""
    return overwritten(points_at(data) + 8 + POINT_6 + 4 + 8 * 4, b"\xff\xff\xff\xe4")(data)


def with_erased_times(bench):
    """A file of which a part of the compressed GPS times is erased."""
    path = bench.cloud(bench.track(length_m=6.0), "cloud.laz")
    cloud = laspy.read(path)
    cloud.gps_time = 1e8 + 1e-6 * np.arange(len(cloud))
    cloud.write(path)
    data = path.read_bytes()
    sizes_at = points_at(data) + 8 + POINT_6 + 4
    before = sum(struct.unpack_from("<8I", data, sizes_at))
    path.write_bytes(overwritten(sizes_at + 4 * 9 + before, b"\xff" * 16)(data))
    return {"INPUT": path}


def with_extra_bytes(bench):
    path = bench.cloud(bench.track(length_m=6.0))
    cloud = laspy.read(path)
    cloud.add_extra_dim(laspy.ExtraBytesParams(name="quality", type=np.float64))
    cloud["quality"] = np.full(len(cloud), np.nan)
    cloud.write(path)
    return {"INPUT": path}


def in_the_oldest_format(bench):
    path = bench.cloud(bench.track(length_m=6.0))
    laspy.convert(laspy.read(path), file_version="1.2", point_format_id=0).write(path)
    return {"INPUT": path}


def without_backend(bench):
    find_spec = dependencies.find_spec
    bench.patch.setattr(dependencies, "find_spec", lambda name: None if name == "lazrs" else find_spec(name))
    return {"INPUT": bench.cloud(bench.track(length_m=6.0), "cloud.laz")}


def folder_without_clouds(bench):
    (bench.folder / "tiles").mkdir()
    (bench.folder / "tiles" / "notes.txt").write_text("nothing")
    return {"INPUT": bench.folder / "tiles"}


def one_bad_tile(bench):
    folder = bench.folder / "tiles"
    folder.mkdir()
    bench.cloud(bench.track(length_m=6.0), "good.las", folder=folder)
    shutil.copy(folder / "good.las", folder / "bad.las")
    (folder / "bad.las").write_bytes((folder / "bad.las").read_bytes()[:-100])
    return {"INPUT": folder}


def odd_names(bench):
    folder = bench.folder / "Größe östlich 1 & 'zwei'"
    folder.mkdir()
    return {"INPUT": bench.cloud(bench.track(length_m=6.0), "Schienen – 線路.LAS", folder=folder)}


NAN = struct.pack("<d", np.nan)
MISSING_TILE = '{"features": [{"assets": {"data": {"href": "gone.laz"}}}]}'

FAULTS = {
    "rasterizerailpoints": {
        "empty file": holding(""),
        "text file named .las": holding("x,y,z\n1,2,3\n"),
        "missing file": lambda bench: {"INPUT": bench.folder / "gone.laz"},
        "folder without clouds": folder_without_clouds,
        "folder with one bad tile": one_bad_tile,
        "virtual point cloud that is not JSON": holding("{", "all.vpc"),
        "virtual point cloud without tiles": holding('{"features": []}', "all.vpc"),
        "virtual point cloud with a missing tile": holding(MISSING_TILE, "all.vpc"),
        "truncated in the header": damaged(lambda data: data[:200]),
        "truncated in the records after the points": damaged(with_late_record_cut),
        "LAZ truncated in the chunk table": damaged(lambda data: data[: chunk_table_at(data) + 5], "cloud.laz"),
        "zero points": damaged(overwritten(COUNT_AT, bytes(8))),
        "LAZ with an absurd number of points": damaged(overwritten(COUNT_AT, b"\xff" * 6), "cloud.laz"),
        "absurd number of records": damaged(overwritten(RECORDS_AT, b"\xff" * 4)),
        "point offset beyond the end of the file": damaged(overwritten(96, b"\xff\xff\xff\x7f")),
        "header length of zero": damaged(overwritten(94, struct.pack("<H", 0))),
        "record length reaching into the points": damaged(overwritten(HEADER + 20, b"\xff\xff")),
        "point length of zero": damaged(overwritten(105, bytes(2))),
        "unknown point format": damaged(overwritten(104, b"\x3f")),
        "unknown version": damaged(overwritten(24, b"\x03\x07")),
        "scale of zero": damaged(overwritten(SCALE_AT, bytes(8))),
        "COPC with a chunk table on which lazrs panics": damaged(with_broken_chunk_table, "cloud.copc.laz"),
        "LAZ with a layer of 3.8 GB stated in a chunk": damaged(with_large_layer, "cloud.laz"),
        "LAZ with an erased part, on which lazrs would end the program": with_erased_times,
        "COPC with 1 point stated in the header and 3600 in the chunk table": damaged(
            overwritten(COUNT_AT, struct.pack("<Q", 1)), "cloud.copc.laz"
        ),
        "two different numbers of points in the header": damaged(overwritten(107, struct.pack("<I", 7))),
        "bounds of NaN in the header": damaged(overwritten(179, NAN * 6)),
        "text in the header that is not UTF-8": damaged(overwritten(26, b"\xff\xfe" * 16)),
        "additional bytes after the points": damaged(lambda data: data + b"rubbish" * 99),
        "points with extra bytes": with_extra_bytes,
        "oldest format, LAS 1.2 with point format 0": in_the_oldest_format,
        "LAZ without the package lazrs": without_backend,
        "path with spaces, umlauts, quotes and kanji": odd_names,
    },
}


@pytest.mark.parametrize("fault", faults("Point cloud files", FAULTS), ids=str)
def test_fault(meet, track, fault):
    outcome = meet(fault)
    if fault.ends == FINE:
        points = track(length_m=6.0)
        stored = points[0] + (points - points[0]).round(3)
        assert cells_of(outcome.results["OUTPUT"]) == cells_under(stored, outcome.results["OUTPUT"])


def cells_of(path):
    return set(map(tuple, np.argwhere(gdal.Open(path).ReadAsArray())))


def cells_under(xyz, path):
    """Row and column of each point, in the grid of a file."""
    x, side, _, y, _, _ = gdal.Open(path).GetGeoTransform()
    return set(map(tuple, np.floor(np.column_stack([y - xyz[:, 1], xyz[:, 0] - x]) / side).astype(int)))
