"""Compressed chunks: all are read in blocks of any size, and chunks with erased bytes are refused."""

import struct

import laspy
import numpy as np
import pytest
from fuzzing.clouds import chunks_of_any_size
from rail_extract.core.clouds import las, laz
from rail_extract.core.clouds.readers import read_points
from rail_extract.core.errors import CloudError
from rail_extract.laboratory.scenes.las import las_data


def write_cloud(path, point_format, count):
    """Write points whose GPS times advance steadily, as those of a scanner."""
    cloud = las_data(np.random.default_rng(1).uniform(0, 100, (count, 3)), point_format=point_format)
    if "gps_time" in cloud.point_format.dimension_names:
        cloud.gps_time = 1e8 + 1e-6 * np.arange(count)
    cloud.write(path)
    return np.asarray(cloud.xyz)


def first_chunk(path):
    """First chunk of a file."""
    with laspy.open(path) as reader:
        return laz.read_chunk_table(path, reader.header)[0]


def times_of(path, point_size):
    """Place of the layer of GPS times of the first chunk, and its bytes."""
    sizes_at = first_chunk(path).at + point_size + 4
    sizes = struct.unpack("<9I", path.read_bytes()[sizes_at : sizes_at + 36])
    return sizes_at + 36 + sum(sizes[: laz.TIMES_LAYER]), sizes[laz.TIMES_LAYER]


def erase(path, at, length):
    data = bytearray(path.read_bytes())
    data[at : at + length] = b"\xff" * length
    path.write_bytes(data)


def read(path):
    return np.concatenate([xyz for xyz, *_ in read_points(path)])


@pytest.mark.parametrize("point_format", [0, 3, 6, 7])
@pytest.mark.parametrize("most", [7_000, 50_000, 250_000])
def test_blocks_of_any_size_hold_all_points_in_order(tmp_path, monkeypatch, point_format, most):
    """The file has a whole chunk of 50,000 points and one of 1000."""
    monkeypatch.setattr(las, "CHUNK", most)
    xyz = write_cloud(tmp_path / "a.laz", point_format, 51_000)
    blocks = [block for block, *_ in read_points(tmp_path / "a.laz")]
    np.testing.assert_allclose(np.concatenate(blocks), xyz, rtol=0, atol=1e-9)
    assert max(map(len, blocks)) <= most


def test_chunks_of_several_sizes_hold_all_points_in_order(tmp_path):
    with chunks_of_any_size():
        xyz = write_cloud(tmp_path / "a.laz", 6, 3000)
    with laspy.open(tmp_path / "a.laz") as reader:
        assert [one.points for one in laz.read_chunk_table(tmp_path / "a.laz", reader.header)] == [70, 1930, 1000]
    np.testing.assert_allclose(read(tmp_path / "a.laz"), xyz, rtol=0, atol=1e-9)


@pytest.mark.parametrize("start", [0, 20])
def test_erased_gps_times_are_refused(tmp_path, start):
    """More of these bytes at the start of the layer end the program."""
    write_cloud(tmp_path / "a.laz", 6, 300)
    at, size = times_of(tmp_path / "a.laz", 30)
    assert size > 100
    erase(tmp_path / "a.laz", at + start, laz.MAX_ERASED_TIMES + 1)
    with pytest.raises(CloudError, match=r"^a\.laz is damaged: parts of its points are erased; copy or export it"):
        read(tmp_path / "a.laz")


@pytest.mark.parametrize("point_format", [1, 3])
def test_erased_points_without_layers_are_refused(tmp_path, point_format):
    write_cloud(tmp_path / "a.laz", point_format, 300)
    erase(tmp_path / "a.laz", first_chunk(tmp_path / "a.laz").at + 300, laz.MAX_ERASED + 1)
    with pytest.raises(CloudError, match="parts of its points are erased"):
        read(tmp_path / "a.laz")


@pytest.mark.parametrize("point_format", [1, 6])
def test_the_first_point_of_a_chunk_may_consist_of_such_bytes(tmp_path, point_format):
    """It is not compressed: a colour, a time or an extra byte of it may have any value."""
    write_cloud(tmp_path / "a.laz", point_format, 300)
    with laspy.open(tmp_path / "a.laz") as reader:
        size = reader.header.point_format.size
    erase(tmp_path / "a.laz", first_chunk(tmp_path / "a.laz").at + size - 10, 10)
    assert len(read(tmp_path / "a.laz")) == 300
