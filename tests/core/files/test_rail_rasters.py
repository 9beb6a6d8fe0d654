"""Files of rail rasters, read with rasterio: contents, sparse access, and invalid files."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.clouds.crs import import_pyproj
from rail_extract.core.errors import ModelError, ParameterError, RasterError
from rail_extract.core.files import rail_rasters
from rail_extract.core.files.rail_rasters import (
    RasterSource,
    header_for,
    on_one_grid,
    open_with_rasterio,
    write_rasters,
)
from rail_extract.core.frame import LocalFrame
from rail_extract.core.frpdf.cleanup import clean
from rail_extract.core.jobs.frpdf_cleanup import model_for
from rail_extract.core.jobs.vectorize_rails import moved
from rail_extract.core.raster import TILE, cell_size, rasterize
from rail_extract.core.standards import STANDARDS
from rail_extract.core.vectorize import vectorize

rasterio = pytest.importorskip("rasterio")

STANDARD = STANDARDS["EN_60E1_1435"]
CELL_M = cell_size(STANDARD.gauge_m, STANDARD.head_width_m)


def source(path):
    return RasterSource(path, open_with_rasterio)


def frame_in(code, unit_m=1.0):
    wkt = None if code is None else import_pyproj().CRS.from_user_input(code).to_wkt()
    return LocalFrame(np.array([500_100.0, 3_000_200.0, 100.0]), unit_m, unit_m, wkt)


def strokes(count=200, reach_m=30.0, seed=0):
    """Random points around the local origin, (n, 2)."""
    return np.random.default_rng(seed).uniform(-reach_m, reach_m, (count, 2))


def places(raster, frame):
    """Return the cell centres in CRS units, sorted."""
    xy = raster.to_local(raster.cells())
    crs = frame.to_crs(np.column_stack([xy, np.zeros(len(xy))]))[:, :2]
    return crs[np.lexsort(crs.round(4).T)]


@pytest.mark.parametrize(
    ("code", "unit_m"), [(None, 1.0), ("EPSG:32643", 1.0), ("EPSG:2227", 1200 / 3937), ("EPSG:2227+6360", 1200 / 3937)]
)
def test_cells_keep_their_position(tmp_path, code, unit_m):
    frame, path = frame_in(code, unit_m), tmp_path / "räster 1.tif"
    rasters = [rasterize(strokes(seed=seed), CELL_M) for seed in (1, 2)]
    extent = (500_000.1, 3_000_100.0, 500_200.123456789, 3_000_300.0)
    header = header_for(rasters, (10, 11), frame, STANDARD, extent)
    write_rasters(path, header, rasters)
    found = source(path).header
    assert found.bounds == extent
    assert (found.class_codes, found.model) == ((10, 11), "fast")
    assert (found.gauge_m, found.head_width_m) == pytest.approx((1.435, 0.072), abs=1e-9)
    assert found.cell_m == pytest.approx(CELL_M, rel=1e-12)
    assert found.frame.horizontal_unit_m == pytest.approx(unit_m, rel=1e-9)
    for before, after in zip(rasters, source(path).read()):
        np.testing.assert_allclose(places(after, found.frame), places(before, frame), atol=1e-8)
        back = moved(after, found.frame, frame)
        # The same cells, counted from a corner whole tiles away, so the windows of the network are the same.
        assert ((before.cells() - after.cells()) % TILE == 0).all()
        np.testing.assert_allclose(
            np.sort(back.to_local(back.cells()), axis=0), np.sort(before.to_local(before.cells()), axis=0), atol=1e-7
        )


def test_without_an_extent_the_bounds_are_those_of_the_file(tmp_path):
    raster = rasterize(strokes(), CELL_M)
    header = header_for([raster], (10,), frame_in("EPSG:2227", 1200 / 3937), STANDARD)
    write_rasters(tmp_path / "r.tif", header, [raster])
    with rasterio.open(tmp_path / "r.tif") as file:
        to_crs = file.transform  # `file.bounds` needs a newer attrs than Debian 12 has
        right, bottom = to_crs.c + to_crs.a * file.width, to_crs.f + to_crs.e * file.height
        expected = to_crs.c, bottom, right, to_crs.f
    for bounds in (header.bounds, source(tmp_path / "r.tif").header.bounds):
        np.testing.assert_allclose(bounds, expected, atol=1e-6)


def test_only_rail_cells_of_a_sparse_file_are_cleaned_and_vectorized(tmp_path):
    """Ten metres of rail at each end of 10 km."""
    along = np.arange(0, 10, 0.02)
    xy = np.concatenate([np.column_stack([along, along / 3]), np.column_stack([7000 + along, 7000 + along / 3])])
    raster, path = rasterize(xy, CELL_M), tmp_path / "ends.tif"
    write_rasters(path, header_for([raster], (10,), frame_in("EPSG:32643"), STANDARD), [raster])
    header = source(path).header
    (found,) = source(path).read()

    class Copy:
        description, max_cells, cells = "copy", 1 << 22, 0

        def sweep(self, seen, *_):
            self.cells += sum(piece.size for piece in seen)
            return seen

    engine = Copy()
    cleaned = clean(found, engine, passes=1)
    assert engine.cells <= 200 * found.count()
    write_rasters(path, header, [cleaned])
    assert path.stat().st_size < 500_000
    network = vectorize(source(path).read()[0], STANDARD.head_width_m)
    assert [round(line) for line in network.lengths()] == [11, 11]


def test_points_too_far_apart_for_a_file_are_refused():
    raster = rasterize(np.array([[0.0, 0.0], [1e6, 1e6]]), CELL_M)
    with pytest.raises(RasterError, match="spread over 1000 by 1000 km"):
        header_for([raster], (10,), frame_in("EPSG:32643"), STANDARD)


@pytest.fixture
def geotiff(tmp_path):
    """Write a raster as other programs may do."""

    def write(bands=1, tags=None, nodata=None):
        path = tmp_path / "other.tif"
        cells = np.full((bands, 30, 40), nodata or 0, np.uint8)
        cells[:, 7, 5:7] = 1
        how = {"transform": rasterio.Affine(0.04, 0, 0, 0, -0.04, 0), "crs": "EPSG:32643", "nodata": nodata}
        with rasterio.open(path, "w", "GTiff", 40, 30, bands, dtype="uint8", **how) as file:
            file.write(cells)
            file.update_tags(**(tags or {}))
        return path

    return write


@pytest.mark.parametrize("nodata", [None, 0, 255])
def test_raster_from_other_software(geotiff, nodata):
    path = geotiff(nodata=nodata)
    header = source(path).header
    assert (header.class_codes, header.gauge_m, header.model) == ((10,), None, None)
    assert source(path).read()[0].cells().tolist() == [[7, 5], [7, 6]]


def test_standard_comes_from_the_user_or_from_the_tags(geotiff):
    untold = source(geotiff()).header
    with pytest.raises(ParameterError, match="fill in GAUGE and HEAD_WIDTH"):
        untold.standard(None, None)
    with pytest.raises(ParameterError, match="fill in GAUGE and HEAD_WIDTH"):
        untold.standard(1435, None)
    assert untold.standard(1435, 72).gauge_m == pytest.approx(1.435)
    told = source(geotiff(tags={"RAIL_GAUGE_MM": "1000", "RAIL_HEAD_MM": "61.91"})).header
    assert (told.standard(None, None).gauge_m, told.standard(1067, None).gauge_m) == pytest.approx((1.0, 1.067))
    assert told.standard(1067, None).head_width_m == pytest.approx(0.06191)


def test_model_by_name_by_tag_and_by_ratio(geotiff):
    def chosen(name, gauge, head, **more):
        header = source(geotiff(tags={"RAIL_GAUGE_MM": gauge, "RAIL_HEAD_MM": head, **more})).header
        return model_for(header, header.standard(None, None), name)

    assert chosen("AUTO", "1435", "72").name == "fast"
    assert chosen("AUTO", "1435", "72", RAIL_MODEL="base").name == "base"
    assert chosen("base", "1435", "72", RAIL_MODEL="gone").name == "base"
    with pytest.raises(RasterError, match="cells are 40.0 mm wide, but .* needs 28.1 mm"):
        chosen("AUTO", "1000", "61.91")
    with pytest.raises(ModelError, match="models cover"):
        chosen("AUTO", "1460", "45")


def test_limit_counts_blocks(monkeypatch):
    raster = rasterize(strokes(), CELL_M)
    monkeypatch.setattr(rail_rasters, "MAX_BLOCKS", 3)
    with pytest.raises(RasterError, match="set EXTENT"):
        header_for([raster], (10,), frame_in("EPSG:32643"), STANDARD)


def test_rasters_of_two_classes_get_one_grid():
    """Two rasters whose origins differ by whole tiles, as those of two classes may."""
    side_m = TILE * CELL_M
    frame = frame_in("EPSG:32643")
    first = replace(rasterize(strokes(), CELL_M), x0=3 * side_m, y0=-2 * side_m)
    second = replace(rasterize(strokes(seed=1), CELL_M), x0=-side_m, y0=5 * side_m)
    aligned, common = on_one_grid([first, second], frame)
    assert {(raster.x0, raster.y0) for raster in aligned} == {(0.0, 0.0)}
    for raster, before in zip(aligned, (first, second)):
        np.testing.assert_allclose(places(raster, common), places(before, frame), atol=1e-6)


def test_a_file_that_is_no_raster_is_one_sentence(tmp_path):
    (tmp_path / "notes.tif").write_text("rails")
    with pytest.raises(RasterError, match="notes.tif is not a readable raster: give the output of Rasterize"):
        source(tmp_path / "notes.tif").header  # noqa: B018 - read only


def test_a_damaged_block_is_named(tmp_path):
    raster, path = rasterize(strokes(), CELL_M), tmp_path / "r.tif"
    write_rasters(path, header_for([raster], (10,), frame_in("EPSG:32643"), STANDARD), [raster])
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2] + bytes(len(whole) - len(whole) // 2))
    with pytest.raises(RasterError, match=r"r.tif (is damaged at row \d+, column \d+: create it again|.* readable)"):
        source(path).read()


def line(length_m, slope=0.5):
    along = np.arange(0, length_m, 0.02)
    return np.column_stack([along, slope * along])


@pytest.mark.parametrize(
    ("crs", "unit_m", "epsg"), [("EPSG:25832", 1.0, 25832), ("EPSG:2227", 1200 / 3937, 2227), (None, 1.0, None)]
)
def test_each_class_is_a_band_at_its_place(tmp_path, crs, unit_m, epsg):
    frame = LocalFrame(np.array([5000.0, 7000.0, 0.0]), unit_m, unit_m, crs)
    rasters = [rasterize(xy, CELL_M) for xy in (line(60), line(40, -0.3))]
    header = header_for(rasters, (10, 17), frame, STANDARD, (1.5, 2.0, 3.0, 4.25))
    write_rasters(tmp_path / "out.tif", header, rasters)
    with rasterio.open(tmp_path / "out.tif") as file:
        assert (file.crs and file.crs.to_epsg()) == epsg
        assert file.descriptions == ("10", "17")
        assert (file.nodata, file.dtypes, file.block_shapes) == (0, ("uint8",) * 2, [(1024, 1024)] * 2)
        tags = {name: text for name, text in file.tags().items() if name.startswith("RAIL")}
        extent = "1.5,2.0,3.0,4.25"
        assert tags == {"RAIL_GAUGE_MM": "1435", "RAIL_HEAD_MM": "72", "RAIL_MODEL": "fast", "RAIL_EXTENT": extent}
        for band, raster in enumerate(rasters, start=1):
            cells = np.argwhere(file.read(band) == 1)
            assert len(cells) == raster.count()
            place = file.transform
            y, x = place.f + place.e * (cells[:, 0] + 0.5), place.c + place.a * (cells[:, 1] + 0.5)
            expected = frame.to_crs(np.column_stack([raster.to_local(raster.cells()), np.zeros(len(cells))]))
            np.testing.assert_allclose(np.sort(x), np.sort(expected[:, 0]), rtol=0, atol=1e-6)
            np.testing.assert_allclose(np.sort(y), np.sort(expected[:, 1]), rtol=0, atol=1e-6)
