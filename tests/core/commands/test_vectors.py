"""Vector files that are damaged, or that GDAL and GEOS disagree about."""

import os

import pytest
from rail_extract.core.errors import ParameterError

pytest.importorskip("pyogrio")

from rail_extract.core.commands import vectors  # noqa: E402

OPEN_RING = b'{"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 9]]]}'


@pytest.mark.parametrize("content", [b"", b"{}", OPEN_RING, b'{"type": "Polygon", "coordinates": [[[0, 0]]]}'])
def test_files_without_polygons_are_one_sentence(tmp_path, content):
    path = tmp_path / "mask.geojson"
    path.write_bytes(content)
    with pytest.raises(ParameterError, match=r"(can't be read as a vector file|has no polygons): give"):
        vectors.read_mask(path, None)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no such pipes")
def test_a_pipe_is_refused_instead_of_waited_for(tmp_path):
    os.mkfifo(tmp_path / "seeds.gpkg")
    with pytest.raises(ParameterError, match="is a pipe"):
        vectors.read_seeds(tmp_path / "seeds.gpkg", None)
