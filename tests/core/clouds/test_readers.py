"""Formats by suffix, and the files that a path stands for."""

import json
import os

import laspy
import numpy as np
import pytest
from rail_extract.core.clouds import readers
from rail_extract.core.clouds.points import read_rail_points
from rail_extract.core.errors import CloudError
from rail_extract.laboratory.scenes.las import las_data

RAIL = 10


def write_cloud(path, count=100):
    """Write a cloud whose points are all rail, and return their coordinates as stored."""
    xyz = [578_123, 2_494_456, 0] + np.random.default_rng(1).uniform(0, 20, (count, 3))
    cloud = las_data(xyz, "EPSG:32643", classification=RAIL)
    cloud.write(path)
    return np.array(cloud.xyz)


def write_catalogue(path, *names):
    path.write_text(json.dumps({"features": [{"assets": {"data": {"href": name}}} for name in names]}))
    return path


def test_a_catalogue_may_begin_with_a_byte_order_mark(tmp_path):
    write_cloud(tmp_path / "a.las")
    catalogue = write_catalogue(tmp_path / "all.vpc", "a.las")
    catalogue.write_bytes(b"\xef\xbb\xbf" + catalogue.read_bytes())
    assert readers.list_files(catalogue) == (tmp_path / "a.las",)


def test_a_tile_that_a_catalogue_repeats_is_looked_up_once(tmp_path, monkeypatch):
    write_cloud(tmp_path / "a.las")
    looked_up, exists = [], os.path.exists
    monkeypatch.setattr("rail_extract.core.clouds.header.os.path.exists", lambda p: looked_up.append(p) or exists(p))
    assert readers.list_files(write_catalogue(tmp_path / "all.vpc", *["a.las"] * 1000)) == (tmp_path / "a.las",)
    assert looked_up.count(tmp_path / "a.las") == 1


def test_header_states_count_extent_and_coordinate_system(tmp_path):
    xyz = write_cloud(tmp_path / "a.laz")
    header = readers.read_header(tmp_path / "a.laz")
    assert (header.path, header.point_count) == (tmp_path / "a.laz", 100)
    assert header.extent == pytest.approx((*xyz[:, :2].min(axis=0), *xyz[:, :2].max(axis=0)), abs=1e-6)
    assert "UTM zone 43N" in header.crs_wkt


def test_files_are_absolute_and_listed_once(tmp_path, monkeypatch):
    for name in ("b.LAS", "a.copc.laz"):
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    expected = (tmp_path / "a.copc.laz", tmp_path / "b.LAS")
    assert readers.list_files([tmp_path, "a.copc.laz", tmp_path / "b.LAS"]) == expected
    assert readers.list_files("a.copc.laz") == expected[:1]


def test_folder_stands_for_its_tiles_without_hidden_and_other_files(tmp_path):
    for name in ("2.laz", "1.las", "._1.las", "notes.txt", "all.vpc"):
        (tmp_path / name).touch()
    assert [file.name for file in readers.list_files(tmp_path)] == ["1.las", "2.laz"]


def test_virtual_point_cloud_stands_for_its_tiles(tmp_path):
    for name, count in (("1.las", 10), ("2.laz", 200), ("3.las", 3000)):
        write_cloud(tmp_path / name, count)
    catalogue = write_catalogue(tmp_path / "all.VPC", "./1.las", str(tmp_path / "2.laz"))
    assert readers.list_files(catalogue) == (tmp_path / "1.las", tmp_path / "2.laz")
    (points,) = read_rail_points(catalogue, [RAIL])
    assert len(points.xyz) == 210


@pytest.mark.parametrize("name", ["cloud.dat", "cloud"])
def test_unknown_suffix_is_refused(tmp_path, name):
    (tmp_path / name).touch()
    sentence = f"^{name} has no suffix of a known cloud format: export the cloud as .las or .laz.$"
    for given in (tmp_path / name, write_catalogue(tmp_path / "all.vpc", name)):
        with pytest.raises(CloudError, match=sentence):
            readers.list_files(given)
    with pytest.raises(CloudError, match=sentence):
        readers.read_header(tmp_path / name)


def test_patterns_stand_for_files_and_folders(tmp_path, monkeypatch):
    names = ("a 1.laz", "b 1.las", "b/c.laz")
    (tmp_path / "b").mkdir()
    for name in names:
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    for pattern, expected in (("*1.la?", names[:2]), ("b*", names[1:][::-1]), (tmp_path / "?/*", names[2:])):
        assert readers.list_files(pattern) == tuple(tmp_path / name for name in expected)
    with pytest.raises(CloudError, match=r"^No file matches .*\*\.e57: check the folder and the pattern.$"):
        readers.list_files(tmp_path / "*.e57")


def test_no_path_is_refused():
    with pytest.raises(CloudError, match="^No point cloud was given"):
        readers.list_files([])


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no such pipes")
def test_a_pipe_is_refused_instead_of_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.laz")
    with pytest.raises(CloudError, match="is a pipe or a device"):
        readers.list_files([tmp_path / "a.laz"])


@pytest.mark.parametrize(("name", "what"), [("cloud.ply", "a PLY"), ("cloud.E57", "an E57")])
def test_other_formats_are_refused_with_the_remedy(tmp_path, name, what):
    (tmp_path / name).write_bytes(b"ply")
    with pytest.raises(CloudError, match=f"^{name} is {what} file, .* convert it to LAS or LAZ"):
        readers.list_files(tmp_path / name)


@pytest.mark.parametrize("measured", ["", "intensity", "gps_time", "number_of_returns"])
def test_what_only_a_scanner_measures_tells_clouds_from_those_of_images(tmp_path, measured):
    path = tmp_path / "cloud.laz"
    write_cloud(path)
    cloud = laspy.read(path)
    for name in ("intensity", "gps_time", "number_of_returns"):
        cloud[name] = np.arange(len(cloud)) % 3 + 1 if name == measured else np.ones(len(cloud), dtype=int)
    cloud.write(path)
    assert readers.shows_scanner(path) == bool(measured)
