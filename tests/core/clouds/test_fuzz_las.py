"""Clouds with arbitrary damage are either read or refused in one sentence."""

import laspy
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rail_extract.core.clouds.points import read_rail_points
from rail_extract.core.errors import RailExtractError

RAIL, COUNT = 10, 200
HEADER, RECORD_HEADER = 375, 54

BOUNDED = settings(
    max_examples=150,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """The bytes of a LAS and of a LAZ file with a few points, a variable-length record and extra bytes."""
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales, header.offsets = [0.001] * 3, [500_000, 3_000_000, 0]
    header.vlrs.append(laspy.VLR("someone", 7, "a record", b"x" * 40))
    header.add_extra_dim(laspy.ExtraBytesParams(name="quality", type=np.float32))
    cloud = laspy.LasData(header)
    cloud.xyz = header.offsets + np.random.default_rng(1).uniform(0, 5, (COUNT, 3))
    cloud.classification = np.full(COUNT, RAIL, dtype=np.uint8)
    folder = tmp_path_factory.mktemp("good")
    for name in ("a.las", "a.laz"):
        cloud.write(folder / name)
    return {name: (folder / name).read_bytes() for name in ("a.las", "a.laz")}


def check_reading(path, data):
    """Check that the file gives finite points or an error of one sentence."""
    path.write_bytes(data)
    try:
        clouds = read_rail_points(path, [RAIL])
    except RailExtractError as error:
        assert str(error)
        assert "\n" not in str(error)
    else:
        assert all(np.isfinite(points.xyz).all() and len(points.xyz) for points in clouds)


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
@BOUNDED
@given(at=st.integers(4, HEADER + RECORD_HEADER), value=st.binary(min_size=1, max_size=8))
def test_any_bytes_in_the_header_and_its_records(good, tmp_path, name, at, value):
    data = good[name]
    check_reading(tmp_path / name, data[:at] + value + data[at + len(value) :])


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
@BOUNDED
@given(length=st.integers(0, 3000))
def test_any_length(good, tmp_path, name, length):
    check_reading(tmp_path / name, good[name][:length])


@BOUNDED
@given(at=st.integers(HEADER, 3000), value=st.binary(min_size=1, max_size=16))
def test_any_bytes_among_compressed_points(good, tmp_path, at, value):
    data = good["a.laz"]
    check_reading(tmp_path / "a.laz", data[:at] + value + data[at + len(value) :])


@BOUNDED
@given(data=st.binary(max_size=600))
def test_any_bytes_after_the_signature(tmp_path, data):
    check_reading(tmp_path / "a.las", b"LASF" + data)
