"""GeoTIFFs of rail rasters: cells, bands, tags and place, and a size that does not grow with the empty area."""

import numpy as np
import pytest

rasterio = pytest.importorskip("rasterio")

from rail_extract.core.files.raster_file import header_for, write_rasters  # noqa: E402
from rail_extract.core.frame import LocalFrame  # noqa: E402
from rail_extract.core.raster import TILE, cell_size, rasterize  # noqa: E402
from rail_extract.core.standards import STANDARDS  # noqa: E402

STANDARD = STANDARDS["EN_60E1_1435"]
CELL_M = cell_size(STANDARD.gauge_m, STANDARD.head_width_m)


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


def test_empty_blocks_take_no_space(tmp_path):
    ends = np.concatenate([line(10), [7000.0, 7000.0] + line(10)])
    raster = rasterize(ends, CELL_M)
    header = header_for([raster], (10,), LocalFrame(np.zeros(3), crs_wkt="EPSG:25832"), STANDARD)
    assert header.window[2] * header.window[3] > 30e9
    write_rasters(tmp_path / "out.tif", header, [raster])
    assert (tmp_path / "out.tif").stat().st_size < 1_000_000
    with rasterio.open(tmp_path / "out.tif") as file:
        last = rasterio.windows.Window(file.width - 4 * TILE, 0, 4 * TILE, 4 * TILE)
        assert np.count_nonzero(file.read(1, window=last)) > 100
