"""Files of rail rasters as GDAL writes and reads them; `tests/core/files/test_rail_rasters.py` has the checks."""

import numpy as np
from rail_extract.core.clouds.crs import import_pyproj
from rail_extract.core.files.rail_rasters import RasterSource, header_for
from rail_extract.core.frame import LocalFrame
from rail_extract.core.raster import cell_size, rasterize
from rail_extract.core.standards import STANDARDS
from rail_extract.rail_extract_plugin.reading.rasters import open_with_gdal
from rail_extract.rail_extract_plugin.writing.geotiff import write_rasters

STANDARD = STANDARDS["EN_60E1_1435"]


def test_cells_of_a_sparse_file_keep_their_position(tmp_path):
    """Rails at both ends of 10 km, in a unit that is not the metre."""
    unit_m, path = 1200 / 3937, tmp_path / "räster 1.tif"
    wkt = import_pyproj().CRS.from_user_input("EPSG:2227+6360").to_wkt()
    frame = LocalFrame(np.array([500_100.0, 3_000_200.0, 100.0]), unit_m, unit_m, wkt)
    some = np.random.default_rng(0).uniform(0, 30, (200, 2))
    both = rasterize(np.concatenate([some, some + 7000]), cell_size(STANDARD.gauge_m, STANDARD.head_width_m))
    rasters = [both, both.with_cells(both.cells()[:50])]
    write_rasters(path, header_for(rasters, (10, 11), frame, STANDARD, (1.5, 2.0, 3.0, 4.25)), rasters)
    assert path.stat().st_size < 1_000_000
    source = RasterSource(path, open_with_gdal)
    found, header = source.read(), source.header
    assert (header.class_codes, header.model, header.extent) == ((10, 11), "fast", (1.5, 2.0, 3.0, 4.25))
    for before, after in zip(rasters, found):
        places = [
            here.to_crs(np.column_stack([raster.to_local(raster.cells()), np.zeros(raster.count())]))[:, :2]
            for raster, here in ((before, frame), (after, header.frame))
        ]
        np.testing.assert_allclose(*(np.sort(place, axis=0) for place in places), atol=1e-6)
    with open_with_gdal(path) as file:
        assert sum(height * width for _, _, height, width in file.filled_blocks(1)) < 1e7 < np.prod(file.shape)
