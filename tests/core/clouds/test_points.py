"""Reading of rail points: LAS versions, units, tiles, and damaged files."""

from __future__ import annotations

import struct
from dataclasses import replace

import laspy
import numpy as np
import pytest
from heard import Heard
from rail_extract.core.clouds import las
from rail_extract.core.clouds.points import ask, read_rail_points, read_requested
from rail_extract.core.clouds.readers import first_header
from rail_extract.core.errors import (
    Cancelled,
    CrsError,
    EmptyCloudError,
    NoRailPointsError,
)
from rail_extract.laboratory.scenes.las import las_data, write_las

RAIL = 10
UTM = "EPSG:32643"
PLACE = np.array([578123.0, 2494456.0, 556.0])


def make_cloud(path, crs=UTM, version="1.4", point_format=6, count=3000, place=PLACE, codes=(1, 2, RAIL), spread=20.0):
    """Write a cloud around a place; return its coordinates as stored, and its classes."""
    random = np.random.RandomState(1)
    xyz, codes = place + spread * random.standard_normal((count, 3)), random.choice(codes, size=count)
    how = {"version": version, "point_format": point_format, "scales": 0.001 if spread > 1 else 1e-9}
    cloud = las_data(xyz, crs, **how, offsets=np.floor(place), classification=codes)
    cloud.write(path)
    return np.column_stack([cloud.x, cloud.y, cloud.z]), np.asarray(cloud.classification)


@pytest.mark.parametrize(
    ("name", "version", "point_format"),
    [("a.las", "1.2", 3), ("a.laz", "1.2", 1), ("a.laz", "1.3", 3), ("a.las", "1.4", 6), ("a.LAZ", "1.4", 7)],
)
def test_every_version_gives_only_the_rail_class(tmp_path, name, version, point_format):
    xyz, codes = make_cloud(tmp_path / name, version=version, point_format=point_format)
    (points,) = read_rail_points(tmp_path / name, [RAIL])
    assert points.class_code == RAIL
    np.testing.assert_allclose(points.frame.to_crs(points.xyz), xyz[codes == RAIL], rtol=0, atol=1e-9)
    assert "UTM zone 43N" in points.frame.crs_wkt


def test_classes_are_separate_and_share_a_frame(tmp_path):
    _, codes = make_cloud(tmp_path / "a.laz", codes=(2, RAIL, 11))
    first, second = read_rail_points(tmp_path / "a.laz", [11, RAIL, 12])
    assert (first.class_code, second.class_code) == (RAIL, 11)
    assert len(first.xyz) == np.count_nonzero(codes == RAIL)
    assert len(second.xyz) == np.count_nonzero(codes == 11)
    assert first.frame is second.frame


def test_a_chunk_table_whose_position_is_at_the_end_of_the_file_is_found(tmp_path):
    """Writers that can't seek back, for example into a pipe, put it there."""
    make_cloud(tmp_path / "a.laz", codes=(RAIL,))
    whole = bytearray((tmp_path / "a.laz").read_bytes())
    (points_at,) = struct.unpack("<I", whole[96:100])
    table_at = bytes(whole[points_at : points_at + 8])
    whole[points_at : points_at + 8] = struct.pack("<q", -1)
    (tmp_path / "a.laz").write_bytes(whole + table_at)
    (points,) = read_rail_points(tmp_path / "a.laz", [RAIL])
    assert len(points.xyz) == 3000


def test_withheld_points_are_left_out(tmp_path):
    make_cloud(tmp_path / "a.las", codes=(RAIL,))
    cloud = laspy.read(tmp_path / "a.las")
    cloud.withheld[:100] = 1
    cloud.write(tmp_path / "a.las")
    (points,) = read_rail_points(tmp_path / "a.las", [RAIL])
    assert len(points.xyz) == 2900
    cloud.withheld[:] = 1
    cloud.classification[:500] = 2
    cloud.write(tmp_path / "a.las")
    with pytest.raises(NoRailPointsError, match="^All points of the cloud are marked as withheld"):
        read_rail_points(tmp_path / "a.las", [RAIL])
    cloud.withheld[:500] = 0
    cloud.write(tmp_path / "a.las")
    with pytest.raises(NoRailPointsError, match=r"number of points, are 2 \(500\): set"):
        read_rail_points(tmp_path / "a.las", [RAIL])


@pytest.mark.parametrize(("version", "point_format"), [("1.2", 1), ("1.4", 6)])
def test_overlap_and_synthetic_points_are_left_out_on_demand(tmp_path, version, point_format):
    """Point formats below 6 have a class for overlap, and no flag."""
    make_cloud(tmp_path / "a.las", version=version, point_format=point_format, codes=(RAIL,))
    cloud = laspy.read(tmp_path / "a.las")
    cloud.synthetic[:100] = 1
    if point_format < 6:
        cloud.classification[50:300] = 12
    else:
        cloud.overlap[50:300] = 1
    cloud.write(tmp_path / "a.las")
    request = ask(tmp_path / "a.las", [RAIL, 12])
    counts = []
    for flags in ((), ("SYNTHETIC",), ("OVERLAP",), ("OVERLAP", "SYNTHETIC")):
        points = read_requested(replace(request, leave_out=flags))
        counts.append(sum(len(one.xyz) for one in points))
    assert counts == [3000, 2900, 2750, 2700]
    cloud.synthetic[:] = 1
    cloud.write(tmp_path / "a.las")
    with pytest.raises(NoRailPointsError, match="^All points of the cloud are marked as withheld or synthetic"):
        read_requested(replace(request, leave_out=("SYNTHETIC",)))


@pytest.mark.parametrize(
    ("crs", "horizontal_m", "vertical_m"),
    [
        (UTM, 1.0, 1.0),
        ("EPSG:2227", 1200 / 3937, 1200 / 3937),  # California, US survey feet
        ("EPSG:2222", 0.3048, 0.3048),  # Arizona, international feet
        ("EPSG:2227+5703", 1200 / 3937, 1.0),  # heights in metres
        ("EPSG:6355+6360", 1.0, 1200 / 3937),  # heights in US survey feet
    ],
)
def test_units_become_metres_and_back(tmp_path, crs, horizontal_m, vertical_m):
    xyz, _ = make_cloud(tmp_path / "a.las", crs=crs, codes=(RAIL,))
    (points,) = read_rail_points(tmp_path / "a.las", [RAIL])
    scale = np.array([horizontal_m, horizontal_m, vertical_m])
    np.testing.assert_allclose(np.ptp(points.xyz, axis=0), np.ptp(xyz, axis=0) * scale, rtol=1e-12)
    np.testing.assert_allclose(points.frame.to_crs(points.xyz), xyz, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("keys", "vertical_m"),
    [({4099: 9001}, 1.0), ({4099: 9003}, 1200 / 3937), ({4096: 5703}, 1.0), ({4096: 6360, 4099: 9003}, 1200 / 3937)],
)
def test_vertical_geotiff_keys_set_the_unit_of_height(tmp_path, keys, vertical_m):
    path = tmp_path / "a.las"
    make_cloud(path, crs="EPSG:2222", version="1.2", point_format=1)
    cloud = laspy.read(path)
    (record,) = cloud.header.vlrs.get("GeoKeyDirectoryVlr")
    for number, value in keys.items():
        record.geo_keys.append(laspy.vlrs.known.GeoKeyEntryStruct(number, 0, 1, value))
    record.geo_keys_header.number_of_keys += len(keys)
    cloud.write(path)
    (points,) = read_rail_points(path, [RAIL])
    assert points.frame.horizontal_unit_m == 0.3048
    assert points.frame.vertical_unit_m == pytest.approx(vertical_m, rel=1e-9)


def test_a_given_coordinate_system_applies_only_to_files_that_state_none(tmp_path):
    make_cloud(tmp_path / "bare.las", crs=None)
    make_cloud(tmp_path / "utm.las")
    (bare,) = read_rail_points(tmp_path / "bare.las", [RAIL], crs_wkt="EPSG:2227")
    (utm,) = read_rail_points(tmp_path / "utm.las", [RAIL], crs_wkt="EPSG:2227")
    assert bare.frame.horizontal_unit_m == pytest.approx(1200 / 3937)
    assert utm.frame.horizontal_unit_m == 1.0
    with pytest.raises(CrsError, match="'nonsense' is unknown"):
        read_rail_points(tmp_path / "bare.las", [RAIL], crs_wkt="nonsense")


@pytest.mark.parametrize(
    ("place", "zone"),
    [([77.2, 13.1, 5.0], "43N (EPSG:32643)"), ([-58.4, -34.6, 5.0], "21S (EPSG:32721)")],
)
def test_degrees_are_refused_with_the_right_zone(tmp_path, place, zone):
    make_cloud(tmp_path / "a.las", crs="EPSG:4326", place=np.array(place), spread=1e-3)
    with pytest.raises(CrsError) as caught:
        read_rail_points(tmp_path / "a.las", [RAIL])
    assert zone in str(caught.value)


@pytest.mark.parametrize("name", ["0.las", "0.laz", "9.las"])
def test_tiles_without_points_are_left_out(tmp_path, name):
    make_cloud(tmp_path / "1.las")
    laspy.LasData(laspy.LasHeader(point_format=6, version="1.4")).write(tmp_path / name)
    heard = Heard()
    (points,) = read_rail_points(tmp_path, [RAIL], progress=heard)
    (alone,) = read_rail_points(tmp_path / "1.las", [RAIL])
    assert len(points.xyz) == len(alone.xyz)
    assert heard.infos == [f"{name} has no points and is left out."]
    assert first_header([tmp_path / name, tmp_path / "1.las"]).point_count > 0
    with pytest.raises(EmptyCloudError, match="has no points: leave it out"):
        read_rail_points(tmp_path / name, [RAIL])


def test_an_extent_selects_points(tmp_path):
    xyz, codes = make_cloud(tmp_path / "1.las")
    make_cloud(tmp_path / "2.las", place=PLACE + [500, 0, 0])
    extent = (PLACE[0] - 5, PLACE[1] - 5, PLACE[0] + 5, PLACE[1] + 5)
    (points,) = read_rail_points(tmp_path, [RAIL], extent=extent)
    inside = (np.abs(xyz[:, :2] - PLACE[:2]) <= 5).all(axis=1) & (codes == RAIL)
    assert len(points.xyz) == np.count_nonzero(inside) > 0
    with pytest.raises(NoRailPointsError, match="^The extent contains no points of class 10: choose"):
        read_rail_points(tmp_path, [RAIL], extent=(0, 0, 1, 1))


def test_reading_reports_progress_and_can_be_cancelled(tmp_path, monkeypatch):
    make_cloud(tmp_path / "a.las")
    monkeypatch.setattr(las, "CHUNK", 500)
    heard = Heard()
    read_rail_points(tmp_path / "a.las", [RAIL], progress=heard)
    assert heard.fractions == sorted(heard.fractions)
    assert len(heard.fractions) == 6
    assert heard.fractions[-1] == pytest.approx(1)
    with pytest.raises(Cancelled):
        read_rail_points(tmp_path / "a.las", [RAIL], progress=Heard(cancel_after=2))


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
@pytest.mark.parametrize(("version", "point_format"), [("1.2", 1), ("1.4", 6)])
def test_strips_are_read_where_there_are_several(tmp_path, name, version, point_format):
    make_cloud(tmp_path / name, version=version, point_format=point_format)
    cloud = laspy.read(tmp_path / name)
    rail = np.asarray(cloud.classification) == RAIL
    for ids in ([3, 3], [3, 12], [1, 40_000]):
        cloud.point_source_id = np.random.RandomState(0).choice(ids, len(rail))
        cloud.write(tmp_path / name)
        (points,) = read_rail_points(tmp_path / name, [RAIL])
        if ids[0] == ids[1]:
            assert points.strips is None
        else:
            np.testing.assert_array_equal(points.strips, np.asarray(cloud.point_source_id)[rail])


def test_source_ids_that_number_profiles_are_not_strips(tmp_path):
    make_cloud(tmp_path / "a.laz")
    cloud = laspy.read(tmp_path / "a.laz")
    cloud.point_source_id = np.arange(len(cloud)) % 60_000
    cloud.write(tmp_path / "a.laz")
    (points,) = read_rail_points(tmp_path / "a.laz", [RAIL])
    assert points.strips is None and not points.scanned


def test_files_with_source_ids_of_their_own_are_strips(tmp_path):
    for number in (1, 2):
        make_cloud(tmp_path / f"{number}.las")
        cloud = laspy.read(tmp_path / f"{number}.las")
        cloud.header.file_source_id = number
        cloud.write(tmp_path / f"{number}.las")
    (points,) = read_rail_points(tmp_path, [RAIL])
    assert sorted(set(points.strips.tolist())) == [1, 2] and (np.diff(points.strips.astype(int)) >= 0).all()


def test_files_that_cannot_be_read_do_not_say_whether_a_scanner_measured_the_points(tmp_path):
    """A tolerant run leaves them out when it reads them."""
    xyz = np.column_stack([np.arange(1000.0), np.zeros(1000), np.zeros(1000)])
    for name, times in (("a.laz", np.arange(1000.0)), ("b.laz", np.arange(1000.0)), ("c.laz", np.zeros(1000))):
        write_las(tmp_path / name, xyz, classification=RAIL, gps_time=times)
    content = bytearray((tmp_path / "a.laz").read_bytes())
    content[-600:-100] = bytes(500)
    (tmp_path / "a.laz").write_bytes(content)
    clouds = ("a.laz", "b.laz"), ("b.laz", "c.laz"), ("c.laz",)
    scanned, mixed, images = (ask([tmp_path / name for name in names], [RAIL]) for names in clouds)
    assert [one.is_scanned() for one in (scanned, mixed, images)] == [True, False, False]
    assert [one.is_of_images() for one in (scanned, mixed, images)] == [False, False, True]
