"""Copies of clouds with other classes."""

import laspy
import numpy as np
import pytest
from rail_extract.core.clouds.readers import read_header
from rail_extract.core.clouds.rewriting import rewrite
from rail_extract.laboratory.scenes.copc import write_copc

MINOR_VERSION_AT = 25


@pytest.mark.parametrize(("minor", "point_format", "new"), [(0, 1, "1.2"), (1, 1, "1.1"), (1, 4, "1.3"), (2, 3, "1.2")])
@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_a_version_that_is_not_written_becomes_one_that_has_the_point_format(
    tmp_path, minor, point_format, new, suffix
):
    cloud = laspy.LasData(laspy.LasHeader(version="1.3", point_format=point_format))
    cloud.header.scales = [0.001] * 3
    cloud.xyz = np.random.default_rng(1).uniform(0, 5, (100, 3))
    old, copy = tmp_path / "a.las", tmp_path / f"b{suffix}"
    cloud.write(old)
    data = bytearray(old.read_bytes())
    data[MINOR_VERSION_AT] = minor
    old.write_bytes(data)
    assert rewrite(old, copy, lambda codes, places: (np.full(len(codes), 10, np.uint8), codes == codes)) == 100
    written = laspy.read(copy)
    assert str(written.header.version) == new
    np.testing.assert_allclose(written.xyz, cloud.xyz, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(written.classification, 10)


def random_cloud(point_format, count):
    """Points whose fields, all but the coordinates, are random bytes, of several scanners, and extra bytes."""
    random = np.random.default_rng(point_format)
    header = laspy.LasHeader(version="1.4", point_format=point_format)
    header.add_extra_dim(laspy.ExtraBytesParams("amplitude", "u2"))
    header.scales = [0.001] * 3
    cloud = laspy.LasData(header)
    cloud.points = laspy.ScaleAwarePointRecord.zeros(count, header=header)
    cloud.xyz = random.uniform(0, 5, (count, 3))
    for name in set(cloud.point_format.dimension_names) - {"X", "Y", "Z"}:
        values = np.asarray(cloud[name])
        largest = np.iinfo(values.dtype).max if values.dtype.kind in "iu" else 1000
        largest = min(largest, cloud.point_format.dimension_by_name(name).max or largest)
        cloud[name] = random.integers(0, int(largest), count, endpoint=True)
    return cloud


def with_codes(codes_now):
    """What `rewrite` calls to give points these classes in turn."""
    done = 0

    def change(codes, places):
        nonlocal done
        done += len(codes)
        return codes_now[done - len(codes) : done], np.ones(len(codes), dtype=bool)

    return change


def assert_only_classes_differ(old, copy):
    """Give a cloud random classes, and take them back."""
    cloud = laspy.read(old)
    codes_now = np.random.default_rng(9).integers(0, 256, len(cloud)).astype(np.uint8)
    assert rewrite(old, copy, with_codes(codes_now), all_stay=True) == len(cloud)
    read_header(copy)  # checks it
    written = laspy.read(copy)
    np.testing.assert_array_equal(written.classification, codes_now)
    written.classification = cloud.classification
    assert written.points.array.tobytes() == cloud.points.array.tobytes()


@pytest.mark.parametrize("point_format", [6, 7, 8])
def test_all_but_the_classes_is_taken_from_the_file_as_it_is(tmp_path, point_format):
    random_cloud(point_format, 260_000).write(tmp_path / "a.laz")
    assert_only_classes_differ(tmp_path / "a.laz", tmp_path / "b.laz")


def test_chunks_of_several_sizes_keep_them(tmp_path):
    cloud, path = random_cloud(7, 30_000), tmp_path / "a.copc.laz"
    write_copc(cloud, path, cloud.header.mins, 5.0, 3)
    assert_only_classes_differ(path, tmp_path / "b.laz")
