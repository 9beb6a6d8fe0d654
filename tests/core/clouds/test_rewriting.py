"""Copies of clouds with other classes."""

import laspy
import numpy as np
import pytest
from rail_extract.core.clouds.rewriting import rewrite
from rail_extract.laboratory.scenes.las import las_data

MINOR_VERSION_AT = 25


@pytest.mark.parametrize(("minor", "point_format", "new"), [(0, 1, "1.2"), (1, 1, "1.1"), (1, 4, "1.3"), (2, 3, "1.2")])
@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_a_version_that_is_not_written_becomes_one_that_has_the_point_format(
    tmp_path, minor, point_format, new, suffix
):
    cloud = las_data(np.random.default_rng(1).uniform(0, 5, (100, 3)), version="1.3", point_format=point_format)
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
