"""Rail rasters as GeoTIFFs like those of QGIS, without QGIS."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import rasterio
from rasterio.windows import Window

from ..raster import RailRaster
from .raster_file import BLOCK, NO_DATA, RasterHeader


def write_rasters(path: Path, header: RasterHeader, rasters: Sequence[RailRaster]) -> None:
    """Write rasters of one grid, one band each; empty blocks take no space.

    Parameters
    ----------
    path : Path
        New file.
    header : RasterHeader
    rasters : sequence of RailRaster
        On the grid of the header.

    Raises
    ------
    OSError
        The file can't be written.
    """
    try:
        with _own_proj_data():
            _write(path, header, rasters)
    except rasterio.errors.RasterioError as error:
        raise OSError(str(error)) from error


@contextmanager
def _own_proj_data() -> Iterator[None]:
    """Let rasterio find the data of its own PROJ: the variables may name those of QGIS, which is another version."""
    hidden = {name: os.environ.pop(name) for name in ("PROJ_DATA", "PROJ_LIB") if name in os.environ}
    try:
        with rasterio.Env():
            yield
    finally:
        os.environ.update(hidden)


def _write(path: Path, header: RasterHeader, rasters: Sequence[RailRaster]) -> None:
    _, _, height, width = header.window
    x, y = header.corner
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        height=height,
        width=width,
        count=len(header.class_codes),
        dtype="uint8",
        crs=header.frame.crs_wkt,
        transform=rasterio.Affine(header.cell, 0.0, x, 0.0, -header.cell, y),
        nodata=NO_DATA,
        tiled=True,
        blockxsize=BLOCK,
        blockysize=BLOCK,
        sparse_ok=True,
        interleave="band",
        compress="deflate",
        bigtiff="IF_SAFER",
    ) as file:
        file.update_tags(**header.tags)
        for band, (code, raster) in enumerate(zip(header.class_codes, rasters), start=1):
            file.set_band_description(band, str(code))
            for top, left in header.filled_blocks(raster):
                cells = header.block(raster, top, left)
                file.write(cells, band, window=Window(left, top, cells.shape[1], cells.shape[0]))
