"""The steps of an extraction as jobs of their own: chained, they give the lines of the whole extraction."""

import re

import numpy as np
import pytest
import rail_extract as rx
from heard import Heard
from rail_extract.laboratory.scenes.las import write_las

pyogrio, shapely = pytest.importorskip("pyogrio"), pytest.importorskip("shapely")
pytest.importorskip("rasterio")

from rail_extract.core.files.rail_rasters import RasterSource, open_with_rasterio  # noqa: E402

HOW = {"iterations": 1, "engine": "OPENCV"}
ROUNDED = 0.11
"""Numbers that differ by less than the last decimal may be rounded differently."""


def source(path):
    return RasterSource(path, open_with_rasterio)


def raster_cells(path):
    """Places of the rail cells, (n, 2)."""
    (raster,), header = source(path).read(), source(path).header
    return header.frame.to_crs(np.column_stack([raster.to_local(raster.cells()), np.zeros(raster.count())]))[:, :2]


def features(path):
    """Vertices, (n, 3), and values of each line."""
    meta, _, shapes, columns = pyogrio.raw.read(path)
    rows = zip(*(column.tolist() for column in columns))
    lines = (shapely.get_coordinates(shape, include_z=True) for shape in shapely.from_wkb(shapes))
    return [(line, dict(zip(meta["fields"].tolist(), row))) for line, row in zip(lines, rows)]


@pytest.fixture
def cloud(tmp_path):
    """Write railheads in a coordinate system."""

    def write(points, name="cloud.las", class_code=10, epsg=32643):
        where = {"offsets": np.floor(points.min(axis=0))}
        return write_las(tmp_path / name, points, f"EPSG:{epsg}", **where, classification=class_code)

    return write


def track(south_m=0.0):
    """Heads of two rails, 12 m long, at 100 m."""
    along, across = np.meshgrid(np.arange(0, 12, 0.02), np.linspace(-0.035, 0.035, 20))
    both = [np.column_stack([along.ravel(), side + across.ravel()]) for side in (-0.7535, 0.7535)]
    xy = np.concatenate(both) + [500_000, 3_000_000 - south_m]
    return np.column_stack([xy, np.full(len(xy), 100.0)])


def test_chained_steps_give_the_lines_of_an_extraction(cloud, tmp_path):
    points = track()
    left, x = points[:, 1] > 3_000_000, points[:, 0] - 500_000
    with_gaps = cloud(points[~((left & (np.abs(x - 4.5) < 1)) | (~left & (np.abs(x - 8) < 1)))])
    whole = {name: tmp_path / f"{name}.gpkg" for name in ("rails", "centerlines")}
    whole["cleaned"] = tmp_path / "whole.tif"
    rx.extract(with_gaps, **whole, **HOW, workers=1)
    raster, cleaned, rails, tracks = (tmp_path / name for name in ("räster 1.tif", "c.tif", "r.gpkg", "t.gpkg"))
    rx.rasterize(with_gaps, output=raster)
    rx.clean(raster, output=cleaned, **HOW)
    cells = [np.sort(raster_cells(path), axis=0) for path in (cleaned, whole["cleaned"])]
    assert len(cells[0]) > 500
    np.testing.assert_allclose(*cells, atol=1e-3)
    rx.vectorize(cleaned, points=with_gaps, output=rails)
    rx.build_track_centerlines(rails, output=tracks)
    for mine, theirs in zip(features(rails), features(whole["rails"])):
        np.testing.assert_allclose(mine[0], theirs[0], atol=0.001)
        # Rails know their tracks once they are paired: the centerlines step returns them with track_ids.
        assert (mine[1].pop("track_ids") or "", theirs[1].pop("track_ids")) == ("", "1")
        assert mine[1].pop("gaps") == theirs[1].pop("gaps")
        assert mine[1] == pytest.approx(theirs[1], rel=1e-6, abs=ROUNDED)
    ((mine, values),), ((theirs, expected),) = features(tracks), features(whole["centerlines"])
    np.testing.assert_allclose(mine, theirs, atol=0.001)
    assert values["bridged_m"] == pytest.approx(expected["bridged_m"], abs=2 * ROUNDED)
    assert values["bridged_m"] == pytest.approx(4.0, abs=0.2)


def test_cleanup_keeps_grid_and_tags_and_says_what_it_did(cloud, tmp_path):
    rx.rasterize(cloud(track()), output=tmp_path / "r.tif")
    heard = Heard()
    cleaned = rx.clean(tmp_path / "r.tif", output=tmp_path / "c.tif", progress=heard, **HOW)
    assert cleaned.figures["ENGINE_USED"].startswith("OpenCV") and heard.infos[0].startswith("Network fast, OpenCV ")
    assert re.fullmatch(r"Class 10: [\d,]+ rail cells before, [\d,]+ after\.", heard.infos[1])
    before, after = source(tmp_path / "r.tif"), source(tmp_path / "c.tif")
    np.testing.assert_array_equal(after.header.frame.origin, before.header.frame.origin)
    for name in ("class_codes", "cell_m", "window", "gauge_m", "head_width_m", "model", "extent"):
        assert getattr(after.header, name) == getattr(before.header, name)
    assert after.read()[0].count() == pytest.approx(before.read()[0].count(), rel=0.3)


def test_each_class_becomes_a_band(cloud, tmp_path):
    folder = tmp_path / "tiles"
    folder.mkdir()
    for code in (11, 10):
        cloud(track() + [0, 0.2 * code, 0], f"tiles/{code}.las", class_code=code)
    rx.rasterize(folder, output=tmp_path / "both.tif", rail_classes="10,11")
    both = source(tmp_path / "both.tif")
    y = [raster.to_local(raster.cells())[:, 1].mean() for raster in both.read()]
    assert both.header.class_codes == (10, 11)
    assert y[1] - y[0] == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize(("epsg", "unit_m", "south_m"), [(32643, 1.0, 0.0), (2263, 1200 / 3937, 2_940_000.0)])
def test_lines_follow_the_railheads_in_every_unit(cloud, tmp_path, epsg, unit_m, south_m):
    points = cloud(track(south_m) / unit_m, epsg=epsg)
    rx.rasterize(points, output=tmp_path / "r.tif")
    figures = rx.vectorize(tmp_path / "r.tif", points=points, output=tmp_path / "rails.gpkg").figures
    assert figures == {"RAIL_COUNT": 2, "RAIL_LENGTH": pytest.approx(24, abs=0.5)}
    found = sorted(
        ((line * unit_m, row) for line, row in features(tmp_path / "rails.gpkg")), key=lambda one: one[0][0, 1]
    )
    for (line, row), side in zip(found, (-0.7535, 0.7535)):
        assert np.abs(line[:, 1] + south_m - 3_000_000 - side).max() < 0.005  # at the ends, which points show less
        assert np.abs(line[:, 2] - 100).max() < 0.004
        assert row["class_code"] == 10
        assert row["points"] > 1000
