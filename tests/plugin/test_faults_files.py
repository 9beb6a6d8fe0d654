"""Invalid and unusual point cloud files."""

import json
import shutil
import struct

import laspy
import numpy as np
import pytest
from faults import FINE, Fault, refused
from osgeo import gdal
from rail_extract.rail_extract_plugin.setup import dependencies

TITLE = "Point cloud files"

HEADER, RECORDS_AT, SCALE_AT, OFFSET_AT, COUNT_AT, LATE_AT = 375, 100, 131, 155, 247, 235
"""Length of a LAS 1.4 header, and offsets of its fields, in bytes."""

POINT_6 = 30
"""Length of a point of format 6, in bytes."""


def holding(data, name="cloud.las"):
    """A file with this content."""

    def prepare(bench):
        (bench.folder / name).write_bytes(data)
        return {"INPUT": bench.folder / name}

    return prepare


def damaged(change, name="cloud.las"):
    """A valid file with changed bytes."""

    def prepare(bench):
        path = bench.cloud(bench.track(length_m=6.0), name)
        path.write_bytes(change(path.read_bytes()))
        return {"INPUT": path}

    return prepare


def cut(length):
    return lambda data: data[:length]


def overwritten(at, value):
    return lambda data: data[:at] + value + data[at + len(value) :]


def among_records(data):
    """Cut within the record of the coordinate system."""
    return data[: HEADER + 54 + 100]


def in_chunk_table(data):
    (table_at,) = struct.unpack("<q", data[points_at(data) : points_at(data) + 8])
    return data[: table_at + 5]


def in_chunks(data):
    return data[: points_at(data) + 200]


def at_points(data):
    return data[: points_at(data)]


def points_at(data):
    return struct.unpack("<I", data[96:100])[0]


def with_late_record_cut(data):
    """Announce a record after the points, of which only half exists."""
    late = struct.pack("<QI", len(data), 1)
    return data[:LATE_AT] + late + data[LATE_AT + 12 :] + bytes(30)


def with_long_late_record(data):
    """Announce a record behind the points that is longer than any file."""
    start = bytes(2) + b"someone".ljust(16, b"\0") + struct.pack("<HQ", 7, 2**63) + bytes(32)
    return data[:LATE_AT] + struct.pack("<QI", len(data), 1) + data[LATE_AT + 12 :] + start


def copc(bench):
    return bench.cloud(bench.track(length_m=6.0), "cloud.copc.laz", any_chunk_size=True)


def with_one_point_stated(bench):
    path = copc(bench)
    path.write_bytes(overwritten(COUNT_AT, struct.pack("<Q", 1))(path.read_bytes()))
    return {"INPUT": path}


def with_broken_chunk_table(bench):
    """A file with chunks of any size, as in COPC, on whose table of chunks lazrs panics."""
    path = copc(bench)
    data = path.read_bytes()
    (table_at,) = struct.unpack("<q", data[points_at(data) : points_at(data) + 8])
    path.write_bytes(overwritten(table_at + 8, b"\xff" * 4)(data))
    return {"INPUT": path}


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


def rewritten(change, name="cloud.las", version=None, point_format=None):
    """A cloud changed and rewritten with laspy."""

    def prepare(bench):
        path = bench.cloud(bench.track(length_m=6.0), name)
        cloud = laspy.read(path)
        if version:
            cloud = laspy.convert(cloud, file_version=version, point_format_id=point_format)
        change(cloud)
        cloud.write(path)
        return {"INPUT": path}

    return prepare


def add_extra_bytes(cloud):
    cloud.add_extra_dim(laspy.ExtraBytesParams(name="quality", type=np.float64))
    cloud["quality"] = np.full(len(cloud), np.nan)


def unchanged(cloud):
    pass


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


def catalogue(text):
    def prepare(bench):
        (bench.folder / "all.vpc").write_text(text)
        return {"INPUT": bench.folder / "all.vpc"}

    return prepare


NAN, INFINITE = struct.pack("<d", np.nan), struct.pack("<d", np.inf)
ITEM = {"assets": {"data": {"href": "gone.laz"}}}

FAULTS = [
    refused("empty file", holding(b""), "cloud.las is empty (0 bytes): copy or export it again."),
    refused(
        "text file named .las",
        holding(b"x,y,z\n1,2,3\n"),
        'cloud.las is not a LAS or LAZ file (it does not begin with "LASF"): export the cloud as LAS or LAZ.',
    ),
    refused(
        "PDF file named .las (wrong signature)",
        holding(b"%PDF-1.4 " * 100),
        'cloud.las is not a LAS or LAZ file (it does not begin with "LASF"): export the cloud as LAS or LAZ.',
    ),
    refused(
        "folder named .las",
        lambda bench: (bench.folder / "a.las").mkdir() or {"INPUT": bench.folder / "a.las"},
        "The folder …/a.las contains no .las or .laz file: choose another folder.",
    ),
    refused(
        "missing file",
        lambda bench: {"INPUT": bench.folder / "gone.laz"},
        "…/gone.laz does not exist: give a .las, .laz or .vpc file, or a folder of tiles, on this computer.",
    ),
    refused(
        "web address",
        lambda bench: {"INPUT": "https://example.org/cloud.laz"},
        "https:/example.org/cloud.laz does not exist: give a .las, .laz or .vpc file, or a folder of tiles, on this "
        "computer.",
    ),
    refused(
        "folder without clouds",
        folder_without_clouds,
        "The folder …/tiles contains no .las or .laz file: choose another folder.",
    ),
    refused(
        "folder with one bad tile",
        one_bad_tile,
        "bad.las is cut off: it has room for 3596 of the 3600 points stated in its header; copy or export it again.",
    ),
    refused(
        "virtual point cloud that is not JSON",
        catalogue("{"),
        "all.vpc is not a virtual point cloud: build it again from its tiles.",
    ),
    refused(
        "virtual point cloud without tiles",
        catalogue('{"features": []}'),
        "all.vpc names no tiles: build it again from existing tiles.",
    ),
    refused(
        "virtual point cloud with a missing tile",
        catalogue(json.dumps({"features": [ITEM]})),
        "all.vpc names …/gone.laz, which does not exist: build it again from its tiles.",
    ),
    refused(
        "truncated in the header", damaged(cut(200)), "cloud.las is cut off within its header: copy or export it again."
    ),
    refused(
        "truncated in the variable-length records",
        damaged(among_records),
        "cloud.las is cut off before its first point: copy or export it again.",
    ),
    refused(
        "truncated before the points",
        damaged(at_points),
        "cloud.las is cut off: it has room for 0 of the 3600 points stated in its header; copy or export it again.",
    ),
    refused(
        "truncated in the points",
        damaged(cut(-1000)),
        "cloud.las is cut off: it has room for 3566 of the 3600 points stated in its header; copy or export it again.",
    ),
    refused(
        "truncated in the records after the points",
        damaged(with_late_record_cut),
        "cloud.las is cut off: the records after its points are missing; copy or export it again.",
    ),
    refused(
        "LAZ truncated in the header",
        damaged(cut(200), "cloud.laz"),
        "cloud.laz is cut off within its header: copy or export it again.",
    ),
    refused(
        "LAZ truncated before the points",
        damaged(at_points, "cloud.laz"),
        "cloud.laz is cut off: its table of chunks is missing; copy or export it again.",
    ),
    refused(
        "LAZ truncated in the chunks",
        damaged(in_chunks, "cloud.laz"),
        "cloud.laz is cut off: its table of chunks is missing; copy or export it again.",
    ),
    refused(
        "LAZ truncated in the chunk table",
        damaged(in_chunk_table, "cloud.laz"),
        "cloud.laz is cut off: its table of chunks is missing; copy or export it again.",
    ),
    refused(
        "zero points",
        damaged(overwritten(COUNT_AT, bytes(8))),
        "cloud.las was not finished: it has points, but its header states none; copy or export it again.",
    ),
    refused(
        "absurd number of points",
        damaged(overwritten(COUNT_AT, b"\xff" * 6)),
        "cloud.las is cut off: it has room for 3600 of the 281474976710655 points stated in its header; copy or "
        "export it again.",
    ),
    refused(
        "LAZ with an absurd number of points",
        damaged(overwritten(COUNT_AT, b"\xff" * 6), "cloud.laz"),
        "cloud.laz is damaged: the number of points is 281474976710655 in its header but 0 to 50000 in its compressed "
        "chunks; export it again.",
    ),
    refused(
        "absurd number of records",
        damaged(overwritten(RECORDS_AT, b"\xff" * 4)),
        "cloud.las has a damaged header (375 bytes and 4294967295 records stated before the points): export it again.",
    ),
    refused(
        "point offset beyond the end of the file",
        damaged(overwritten(96, b"\xff\xff\xff\x7f")),
        "cloud.las is cut off before its first point: copy or export it again.",
    ),
    refused(
        "point offset within the header",
        damaged(overwritten(96, struct.pack("<I", 10))),
        "cloud.las has a damaged header (375 bytes and 1 records stated before the points): export it again.",
    ),
    refused(
        "header length of zero",
        damaged(overwritten(94, struct.pack("<H", 0))),
        "cloud.las is cut off or damaged (Incoherent header size): copy or export it again.",
    ),
    refused(
        "header length beyond the end of the file",
        damaged(overwritten(94, b"\xff\xff")),
        "cloud.las has a damaged header (65535 bytes and 1 records stated before the points): export it again.",
    ),
    Fault("record length reaching into the points", damaged(overwritten(HEADER + 20, b"\xff\xff"))),
    refused(
        "point length of zero",
        damaged(overwritten(105, bytes(2))),
        "cloud.las is cut off or damaged (Incoherent point size, header says 0 point_format created says "
        "30): copy or export it again.",
    ),
    refused(
        "unknown point format",
        damaged(overwritten(104, b"\x3f")),
        "cloud.las has a damaged header (point format 63): export it with a format from 0 to 10.",
    ),
    refused(
        "unknown version", damaged(overwritten(24, b"\x03\x07")), "cloud.las is LAS 3.7: export it as LAS 1.2 to 1.4."
    ),
    refused(
        "scale of NaN",
        damaged(overwritten(SCALE_AT, NAN)),
        "cloud.las has a damaged header (coordinate scale or offset): export it again.",
    ),
    refused(
        "scale of zero",
        damaged(overwritten(SCALE_AT, bytes(8))),
        "cloud.las has a damaged header (coordinate scale or offset): export it again.",
    ),
    refused(
        "infinite offset",
        damaged(overwritten(OFFSET_AT, INFINITE)),
        "cloud.las has a damaged header (coordinate scale or offset): export it again.",
    ),
    refused(
        "offset of 1e300",
        damaged(overwritten(OFFSET_AT, struct.pack("<d", 1e300))),
        "cloud.las has a damaged header (coordinate scale or offset): export it again.",
    ),
    refused(
        "record of 2^63 bytes after the points",
        damaged(with_long_late_record),
        "cloud.las is cut off: the records after its points are missing; copy or export it again.",
    ),
    refused(
        "COPC with a chunk table on which lazrs panics",
        with_broken_chunk_table,
        "cloud.copc.laz is cut off or damaged (index out of bounds: …): copy or export it again.",
    ),
    refused(
        "LAZ with a layer of 3.8 GB stated in a chunk",
        damaged(with_large_layer, "cloud.laz"),
        "cloud.laz is damaged: its compressed chunks don't fit the file; export it again.",
    ),
    refused(
        "LAZ with an erased part, on which lazrs would end the program",
        with_erased_times,
        "cloud.laz is damaged: parts of its points are erased; copy or export it again.",
    ),
    refused(
        "COPC with 1 point stated in the header and 3600 in the chunk table",
        with_one_point_stated,
        "cloud.copc.laz is damaged: the number of points is 1 in its header but 3600 in its "
        "compressed chunks; export it again.",
    ),
    refused(
        "LAZ with 1 point stated in the header and 3600 in its chunk",
        damaged(overwritten(COUNT_AT, struct.pack("<Q", 1)), "cloud.laz"),
        "cloud.laz is damaged: the number of points is 1 in its header but 3600 in its "
        "compressed chunks; export it again.",
    ),
    refused(
        "two different numbers of points in the header",
        damaged(overwritten(107, struct.pack("<I", 7))),
        "cloud.las has a damaged header (it states both 7 and 3600 points): export it again.",
    ),
    Fault("bounds of 1e300 in the header", damaged(overwritten(195, struct.pack("<d", 1e300) * 2))),
    Fault("bounds of NaN in the header", damaged(overwritten(179, NAN * 6))),
    Fault("text in the header that is not UTF-8", damaged(overwritten(26, b"\xff\xfe" * 16))),
    Fault("additional bytes after the points", damaged(lambda data: data + b"rubbish" * 99)),
    Fault("points with extra bytes", rewritten(add_extra_bytes)),
    Fault("LAZ with extra bytes", rewritten(add_extra_bytes, "cloud.laz")),
    Fault("oldest format, LAS 1.2 with point format 0", rewritten(unchanged, version="1.2", point_format=0)),
    Fault("waveforms, point format 4", rewritten(unchanged, version="1.3", point_format=4)),
    refused(
        "LAZ without the package lazrs",
        without_backend,
        "Rasterize rail points needs the Python package lazrs, which this QGIS does not have: run Install "
        "packages in the toolbox under Rail Extract, or qgis_process run railextract:installpackages in a shell. "
        "Build track centerlines and Clean rail raster (FRPDF) work without it.",
    ),
    Fault("path with spaces, umlauts, quotes and kanji", odd_names),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, track, fault):
    outcome = meet(fault, "rasterizerailpoints")
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
