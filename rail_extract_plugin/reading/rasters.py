"""Rasters that GDAL reads, for the checks of `core.files.rail_rasters`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from osgeo import gdal

from ...core.files.rail_rasters import BLOCK, Block, RasterFile


@contextmanager
def open_with_gdal(path: Path) -> Iterator[RasterFile]:
    """Open a raster; newer versions of GDAL raise errors for a damaged file, as QGIS or another plugin may enable."""
    try:
        dataset = gdal.OpenEx(str(path), gdal.OF_RASTER | gdal.OF_READONLY)
        if dataset is None or dataset.RasterCount == 0:
            raise OSError(gdal.GetLastErrorMsg())
        yield _GdalFile(dataset)
    except RuntimeError as error:
        raise OSError(str(error)) from error


class _GdalFile(RasterFile):
    """A raster that GDAL has opened."""

    def __init__(self, dataset: gdal.Dataset) -> None:
        self._dataset = dataset
        self.transform, self.crs_wkt = dataset.GetGeoTransform(), dataset.GetProjection() or None
        self.shape, self.tags = (dataset.RasterYSize, dataset.RasterXSize), dataset.GetMetadata()
        self.bands = tuple(dataset.GetRasterBand(one).GetDescription() for one in range(1, dataset.RasterCount + 1))

    def filled_blocks(self, number: int) -> list[Block]:
        """Return the blocks of a band that the file stores."""
        return list(_filled(self._dataset.GetRasterBand(number), 0, 0, *self.shape))

    def read(self, number: int, block: Block) -> np.ndarray:
        """Return which cells of a block are rail."""
        row, column, height, width = block
        band = self._dataset.GetRasterBand(number)
        is_rail = np.ones((height, width), dtype=bool)
        for cells in (band, band.GetMaskBand()):  # the mask is 0 at nodata
            try:
                data = cells.ReadRaster(column, row, width, height, buf_type=gdal.GDT_Byte)
            except RuntimeError:
                data = None
            if data is None:
                raise OSError(gdal.GetLastErrorMsg())
            is_rail &= np.frombuffer(data, dtype=np.uint8).reshape(height, width) != 0
        return is_rail


def _filled(band: gdal.Band, row: int, column: int, height: int, width: int) -> Iterator[Block]:
    status, _ = band.GetDataCoverageStatus(column, row, width, height, gdal.GDAL_DATA_COVERAGE_STATUS_DATA)
    if not status & gdal.GDAL_DATA_COVERAGE_STATUS_DATA:
        return
    if height <= BLOCK and width <= BLOCK:
        yield row, column, height, width
        return
    for top, rows in _halves(row, height):
        for left, columns in _halves(column, width):
            yield from _filled(band, top, left, rows, columns)


def _halves(start: int, length: int) -> tuple[tuple[int, int], ...]:
    """Split a range of cells at a block border near its middle."""
    if length <= BLOCK:
        return ((start, length),)
    first = BLOCK * math.ceil(length / BLOCK / 2)
    return (start, first), (start + first, length - first)
