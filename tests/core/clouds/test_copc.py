"""COPC files: only chunks that an extent touches are read, and the points are those of a full read."""

import struct

import laspy
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rail_extract.core.clouds import laz
from rail_extract.core.clouds.points import read_rail_points
from rail_extract.core.clouds.readers import read_classes
from rail_extract.core.errors import NoRailPointsError
from rail_extract.laboratory.scenes.copc import write_copc
from rail_extract.laboratory.scenes.las import las_data

RAIL, HALF_M, LOW = 10, 32.0, np.array([578000.0, 2494000.0, 500.0])
LEVELS = 4


def write_cloud(path, count=4000):
    """Write a cloud with an octree; return the position of its page and the number of its entries."""
    xyz = LOW + np.random.RandomState(1).uniform(0, 2 * HALF_M, (count, 3))
    cloud = las_data(xyz, offsets=LOW, classification=np.random.RandomState(3).choice([2, RAIL], count))
    return write_copc(cloud, path, LOW, 2 * HALF_M, LEVELS)


def read(path, extent=None, codes=(RAIL,)):
    parts = list(read_classes(path, codes, extent=extent))
    return np.concatenate([np.empty((0, 3)), *(xyz for xyz, *_ in parts)]), sum(
        int(census.sum()) for *_, census in parts
    )


def inside(xyz, extent):
    return xyz[((xyz[:, :2] >= extent[:2]) & (xyz[:, :2] <= extent[2:])).all(axis=1)]


@pytest.fixture(scope="module")
def cloud(tmp_path_factory):
    """Path, position of the page, number of its entries, and all points on rails."""
    path = tmp_path_factory.mktemp("copc") / "a.copc.laz"
    return path, *write_cloud(path), read(path)[0]


@settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(corner=st.tuples(*[st.floats(-5, 64)] * 2), size=st.tuples(*[st.floats(0.5, 40)] * 2))
def test_the_points_of_an_extent_are_those_of_a_full_read(cloud, corner, size):
    low = LOW[:2] + corner
    extent = (*low, *(low + size))
    np.testing.assert_array_equal(inside(read(cloud[0], extent)[0], extent), inside(cloud[3], extent))


def test_little_more_than_the_extent_is_read(cloud):
    """Of a corner, an eighth of the side: the root, and one node of 64 on the other levels or four."""
    low = LOW[:2]
    with laspy.open(cloud[0]) as reader:
        table = laz.read_chunk_table(cloud[0], reader.header)
        chunks = laz.chunks_in(cloud[0], reader.header, table, (*low, *(low + 8.0)))
    assert sum(one.points for one in chunks) < 0.4 * 4000
    assert len(chunks) < 0.1 * cloud[2]
    _, rails = read(cloud[0], (*low, *(low + 8.0)))
    assert 0 < rails <= sum(one.points for one in chunks)


@pytest.mark.parametrize("damage", ["endless", "a node is missing", "another size", "a deep level"])
def test_an_octree_that_does_not_fit_the_chunks_is_not_used(cloud, tmp_path, damage):
    path, root_at, count, _ = cloud
    data, last = bytearray(path.read_bytes()), root_at + 32 * (count - 1)
    place, new = {
        "endless": (last + 16, struct.pack("<Q2i", root_at, 32 * count, -1)),
        "a node is missing": (last + 28, struct.pack("<i", 0)),
        "another size": (last + 24, struct.pack("<i", 17)),
        "a deep level": (last, struct.pack("<i", 2000)),
    }[damage]
    data[place : place + len(new)] = new
    (tmp_path / "b.copc.laz").write_bytes(data)
    extent = (*LOW[:2], *(LOW[:2] + 8.0))
    with laspy.open(path) as reader:
        table = laz.read_chunk_table(path, reader.header)
        assert laz.chunks_in(tmp_path / "b.copc.laz", reader.header, table, extent) is None
    np.testing.assert_array_equal(read(tmp_path / "b.copc.laz", extent)[0], cloud[3])


def test_an_extent_without_rails_is_named_as_such(cloud):
    outside = LOW[:2] + 100.0
    with pytest.raises(NoRailPointsError, match="The extent contains no points of class 10: choose a larger extent"):
        read_rail_points(cloud[0], [RAIL], "EPSG:32643", (*outside, *(outside + 1.0)))
    with pytest.raises(NoRailPointsError, match="The extent contains no points of class 7: choose a larger extent"):
        read_rail_points(cloud[0], [7], "EPSG:32643", (*LOW[:2], *(LOW[:2] + 8.0)))
