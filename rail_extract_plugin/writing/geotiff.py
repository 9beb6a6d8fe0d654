"""Writes rail rasters with GDAL: GeoTIFFs with one band per class, in which empty blocks take no space."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from osgeo import gdal

from ...core.files.rail_rasters import BLOCK, NO_DATA, RasterHeader
from ...core.progress import SILENT, Progress
from ...core.raster import RailRaster

CREATION = (
    "TILED=YES",
    f"BLOCKXSIZE={BLOCK}",
    f"BLOCKYSIZE={BLOCK}",
    "SPARSE_OK=TRUE",
    "INTERLEAVE=BAND",
    "COMPRESS=DEFLATE",
    "BIGTIFF=IF_SAFER",
)


def write_rasters(path: Path, header: RasterHeader, rasters: Sequence[RailRaster], progress: Progress = SILENT) -> None:
    """Write a raster for each class on the header's grid into a new file; cells outside its window are dropped.

    Raises OSError if the file cannot be written.
    """
    gdal.ErrorReset()
    try:
        _write(path, header, rasters, progress)
        if gdal.GetLastErrorType() >= gdal.CE_Failure:
            raise RuntimeError(gdal.GetLastErrorMsg())
    except RuntimeError as error:
        raise OSError(_cause(error)) from error


def _cause(error: Exception) -> str:
    """Return the first cause of an error: newer GDAL appends causes, one per line, the first cause last."""
    return str(error).rpartition("May be caused by: ")[2]


def _write(path: Path, header: RasterHeader, rasters: Sequence[RailRaster], progress: Progress) -> None:
    dataset = _create(path, header)
    if dataset is None:
        return
    try:
        for number, (raster, share) in enumerate(zip(rasters, progress.split(len(rasters))), start=1):
            band = dataset.GetRasterBand(number)
            for top, left in share.follow(header.filled_blocks(raster)):
                cells = header.block(raster, top, left)
                height, width = cells.shape
                band.WriteRaster(left, top, width, height, cells.tobytes())
        dataset.FlushCache()
    finally:
        del dataset  # otherwise the traceback of a cancel keeps the file open, and Windows cannot remove it


def _create(path: Path, header: RasterHeader) -> gdal.Dataset | None:
    """Create an empty file; None, with GDAL's error set, if that fails."""
    _, _, height, width = header.window
    driver = gdal.GetDriverByName("GTiff")
    dataset = driver.Create(str(path), width, height, len(header.class_codes), gdal.GDT_Byte, list(CREATION))
    if dataset is None:
        return None
    x, y = header.corner
    dataset.SetGeoTransform((x, header.cell, 0.0, y, 0.0, -header.cell))
    if header.frame.crs_wkt:
        dataset.SetProjection(header.frame.crs_wkt)
    dataset.SetMetadata(header.tags)
    for number, code in enumerate(header.class_codes, start=1):
        band = dataset.GetRasterBand(number)
        band.SetDescription(str(code))
        band.SetNoDataValue(NO_DATA)
    return dataset
