"""GeoPackages: geometry and fields of each layer, and what happens to files that cannot be replaced."""

from dataclasses import replace

import numpy as np
import pytest

pyogrio = pytest.importorskip("pyogrio")
shapely = pytest.importorskip("shapely")

from rail_extract.core.disk import Destination  # noqa: E402
from rail_extract.core.errors import DiskError  # noqa: E402
from rail_extract.core.fields import CENTERLINE_FIELDS, CENTERLINES, QUALITY_FIELDS, RAIL_FIELDS, RAILS  # noqa: E402
from rail_extract.core.files.geopackage import tables_in  # noqa: E402
from rail_extract.core.files.layers import lines_layer, quality_layer  # noqa: E402
from rail_extract.core.files.writing import write_layers  # noqa: E402
from rail_extract.core.frame import LocalFrame  # noqa: E402
from rail_extract.core.rails import Centerline, RailLine, TrackGeometry  # noqa: E402

FRAME = LocalFrame(np.array([500.0, 7100.0, 30.0]), 0.5, 0.25, "EPSG:2227")
XYZ = np.array([[0.0, 0.0, 1.0], [3.0, 4.0, 1.0]])
RAIL = RailLine(XYZ, 3, 10, 417, 1.54, 0.416, np.nan)
TRACK = Centerline(XYZ, 1, 10, (3, 5), (4,), 1435.04, 0.26, -3.04, -7.11, 0.0)
STATIONS = TrackGeometry(
    *(1, XYZ, np.array([0.0, 5.0]), np.array([1435.04, np.nan]), np.array([-3.04, 2.0]), np.array([np.nan, 0.1])),
    *(np.array([350.26, np.nan]), np.array([1.234, 5.678]), np.array([0.416, 0.2]), np.array([12, 0])),
    *(np.array([False, True]), np.array([2, 1]), np.array([3.456, np.nan]), np.array([0.789, np.nan])),
)


def test_a_file_holds_lines_and_points_with_their_fields(tmp_path):
    path = tmp_path / "all.gpkg"
    destination = Destination.at(path)
    write_layers(
        [lines_layer(RAILS, [RAIL]), lines_layer(CENTERLINES, [TRACK]), quality_layer([STATIONS])], destination, FRAME
    )
    found = {name: pyogrio.raw.read(path, layer=name) for name, _ in pyogrio.list_layers(path)}
    assert list(found) == ["rails", "centerlines", "quality"]
    for (meta, _, geometry, _), fields, kind in zip(
        found.values(), (RAIL_FIELDS, CENTERLINE_FIELDS, QUALITY_FIELDS), ("LineString Z", "LineString Z", "Point Z")
    ):
        assert list(meta["fields"]) == [field.name for field in fields]
        assert (meta["geometry_type"], meta["crs"]) == (kind, "EPSG:2227")
        places = shapely.get_coordinates(shapely.from_wkb(geometry), include_z=True)
        np.testing.assert_array_equal(places, [[500.0, 7100.0, 34.0], [506.0, 7108.0, 34.0]])
    rail, track, quality = ([column.tolist() for column in values] for _, _, _, values in found.values())
    assert rail[:6] == [[3], [10], [5.0], [417], [1.5], [0.42]]
    assert np.isnan(rail[6][0])
    assert track[2:4] == [["3,5"], ["4"]]
    assert track[5:] == [[1435.0], [0.3], [-3.0], [-7.1], [0.0]]
    assert quality[:2] == [[1, 1], [0.0, 5.0]]
    np.testing.assert_array_equal(quality[2:6], [[1435.0, np.nan], [-3.0, 2.0], [np.nan, 0.1], [350.3, np.nan]])
    assert quality[6:11] == [[1.23, 5.68], [0.42, 0.2], [12, 0], [0, 1], [2, 1]]
    np.testing.assert_array_equal(quality[11], [3.5, np.nan])


def test_layers_without_features_keep_their_fields(tmp_path):
    path = tmp_path / "empty.gpkg"
    destination = Destination.at(path)
    write_layers([lines_layer(RAILS, []), quality_layer([])], destination, FRAME)
    assert [pyogrio.read_info(path, layer=name)["features"] for name in ("rails", "quality")] == [0, 0]
    assert list(pyogrio.read_info(path, layer="quality")["fields"]) == [field.name for field in QUALITY_FIELDS]


def test_a_file_in_use_is_left_alone_and_the_new_one_is_next_to_it(tmp_path):
    out = tmp_path / "out.gpkg"
    out.write_text("theirs")
    destination = Destination.at(out)
    (tmp_path / "out.gpkg-wal").write_text("pending")
    with pytest.raises(DiskError, match=r"The new file is .*out_new\.gpkg"):
        write_layers([lines_layer(RAILS, [])], destination, FRAME)
    assert out.read_text() == "theirs"
    assert pyogrio.read_info(tmp_path / "out_new.gpkg")["features"] == 0


def test_the_other_tables_of_a_file_stay(tmp_path):
    path = tmp_path / "all.gpkg"
    destination = Destination.at(path)
    write_layers([lines_layer(replace(RAILS, style="signals"), [RAIL] * 3)], destination, FRAME)
    write_layers([lines_layer(RAILS, [RAIL] * 2)], destination, FRAME)
    before = path.read_bytes()
    write_layers([lines_layer(RAILS, [RAIL]), quality_layer([STATIONS])], destination, FRAME)
    assert path.read_bytes() != before
    counts = {name: pyogrio.read_info(path, layer=name)["features"] for name, _ in pyogrio.list_layers(path)}
    assert counts == {"signals": 3, "rails": 1, "quality": 2}
    assert tables_in(path) == set(counts)
    assert [file.name for file in tmp_path.iterdir()] == ["all.gpkg"]
