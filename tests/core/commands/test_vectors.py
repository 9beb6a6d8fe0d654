"""Vector files that are damaged, or that GDAL and GEOS disagree about."""

import json
import os

import numpy as np
import pytest
from rail_extract.core.clouds.crs import parse_crs
from rail_extract.core.errors import CrsError, ParameterError

pyogrio, shapely = pytest.importorskip("pyogrio"), pytest.importorskip("shapely")

from rail_extract.core.commands.vectors import read_features  # noqa: E402
from rail_extract.core.jobs.features import read_lines_along, read_mask  # noqa: E402

OPEN_RING = b'{"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 9]]]}'


@pytest.mark.parametrize("content", [b"", b"{}", OPEN_RING, b'{"type": "Polygon", "coordinates": [[[0, 0]]]}'])
def test_files_without_polygons_are_one_sentence(tmp_path, content):
    path = tmp_path / "mask.geojson"
    path.write_bytes(content)
    with pytest.raises(ParameterError, match=r"(can't be read as a vector file|has no polygons): give"):
        read_mask(read_features(path, "MASK"), None)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no such pipes")
def test_a_pipe_is_refused_instead_of_waited_for(tmp_path):
    os.mkfifo(tmp_path / "seeds.gpkg")
    with pytest.raises(ParameterError, match="is a pipe"):
        read_features(tmp_path / "seeds.gpkg", "SEEDS")


def test_a_layer_of_a_file_is_named(tmp_path):
    path, lines = tmp_path / "two.gpkg", shapely.linestrings([[(0, 0), (9, 0)], [(0, 5), (9, 5)]])
    for name, line in zip(("first", "second"), lines):
        shape = np.array([shapely.to_wkb(line)], object)
        pyogrio.raw.write(path, shape, [], [], layer=name, geometry_type="LineString", crs="EPSG:25832", append=False)
    for name, y in (("", 0), ("|layername=first", 0), ("|layername=second", 5)):
        (line,) = read_lines_along(read_features(f"{path}{name}", "GUIDE"), None)
        assert line[:, 1].tolist() == [y, y]


def test_a_line_that_has_no_place_in_the_system_of_the_cloud_is_refused_and_not_left_out(tmp_path):
    path = tmp_path / "guide.geojson"
    lines = [[[9.0, 52.0], [9.001, 52.0]], [[9.0, 95.0], [9.001, 95.0]]]
    path.write_text(json.dumps({"type": "MultiLineString", "coordinates": lines}))
    guide = read_features(path, "GUIDE")
    with pytest.raises(CrsError, match=r"GUIDE can't be transformed to the coordinate system of the cloud .EPSG:25832"):
        read_lines_along(guide, parse_crs("EPSG:25832").to_wkt())
    assert len(read_lines_along(guide, None)) == 2
