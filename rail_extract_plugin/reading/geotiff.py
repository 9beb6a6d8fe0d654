"""Reads and writes rail rasters: GeoTIFFs with one band per class; only blocks with rail cells are accessed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from osgeo import gdal

from ...core.clouds.crs import parse_crs, units
from ...core.errors import RasterError
from ...core.files.raster_file import BLOCK, EXTENT_TAG, GAUGE_TAG, HEAD_TAG, MODEL_TAG, NO_DATA, RasterHeader
from ...core.frame import LocalFrame
from ...core.progress import SILENT, Progress
from ...core.raster import RailRaster
from ...core.standards import RAIL_CLASS, is_class

CREATION = (
    "TILED=YES",
    f"BLOCKXSIZE={BLOCK}",
    f"BLOCKYSIZE={BLOCK}",
    "SPARSE_OK=TRUE",
    "INTERLEAVE=BAND",
    "COMPRESS=DEFLATE",
    "BIGTIFF=IF_SAFER",
)

SIDE_TOLERANCE = 1e-6
"""Relative difference allowed between the two sides of a cell, because writers round."""

PLACE_TOLERANCE = 1e-3
"""Share of a cell to which the coordinates of the raster must be exact: those of 1e13 m are not."""


MIN_CELL_M, MAX_CELL_M = 0.001, 0.5
"""Range of the sides of cells: smaller ones show the roughness of a head, and in larger ones two rails of the narrowest
gauge touch."""


MANY_CELLS, MAX_SHARE = 10_000_000, 0.3
"""Rail cells from which a raster needs gigabytes, and the largest share of rail in blocks with rail: that of railheads
is below a tenth, even in a yard. A file of 1 MB may state 400 million cells."""


def read_header(path: Path) -> RasterHeader:
    """Read and check everything except the cells.

    Raises
    ------
    RasterError
        The file is not a raster or is rotated, its cells are not square or too small or too large for rails, or the
        class of a band is unknown.
    CrsError
        Its coordinate system is not in units of length.
    """
    with _explained(path):
        dataset = _open(path)
        x, width, skew_x, y, skew_y, height = dataset.GetGeoTransform()
        if skew_x or skew_y or not math.isclose(width, -height, rel_tol=SIDE_TOLERANCE) or width <= 0:
            raise RasterError(f"{path.name} is rotated or its cells are not square: warp it to square cells, north up.")
        wkt = dataset.GetProjection() or None
        unit_m = units(parse_crs(wkt))[0] if wkt else 1.0
        if not MIN_CELL_M <= width * unit_m <= MAX_CELL_M:
            raise RasterError(
                f"{path.name} has cells of {width * unit_m:.3g} m, and rails are seen in cells of {MIN_CELL_M:g} to "
                f"{MAX_CELL_M:g} m: rasterize the points again, or check the coordinate system."
            )
        if not math.ulp(x) + math.ulp(y) < PLACE_TOLERANCE * width:
            raise RasterError(f"{path.name} begins at {x:g}, {y:g}, where no rails can be: rasterize the points again.")
        return RasterHeader(
            class_codes=_class_codes(dataset, path.name),
            frame=LocalFrame(np.array([x, y, 0.0]), unit_m, unit_m, wkt),
            cell_m=width * unit_m,
            window=(0, 0, dataset.RasterYSize, dataset.RasterXSize),
            gauge_m=_length_m(dataset, GAUGE_TAG),
            head_width_m=_length_m(dataset, HEAD_TAG),
            model=dataset.GetMetadataItem(MODEL_TAG),
            extent=_extent(dataset),
        )


def read_rasters(path: Path, header: RasterHeader, progress: Progress = SILENT) -> tuple[RailRaster, ...]:
    """Read the cells of all bands, block by block, skipping blocks that the file does not store.

    A cell is rail if its value is neither 0 nor the band's nodata value.

    Parameters
    ----------
    path : Path
    header : RasterHeader
        From `read_header`.
    progress : Progress

    Raises
    ------
    RasterError
        The file is damaged, has no rail cell, or shows something other than rails.
    """
    with _explained(path):
        dataset = _open(path)
        grid = RailRaster({}, header.cell_m, 0.0, 0.0)
        rasters = []
        for number in range(1, dataset.RasterCount + 1):
            band = dataset.GetRasterBand(number)
            share = progress.span((number - 1) / dataset.RasterCount, number / dataset.RasterCount)
            cells = [np.empty((0, 2), dtype=np.int64)]
            rail_count, count = 0, 0
            for row, column, height, width in share.follow(filled_blocks(dataset, number)):
                block = _read(band, row, column, height, width, path.name)
                rail_count, count = rail_count + np.count_nonzero(block), count + block.size
                if rail_count > max(MANY_CELLS, MAX_SHARE * count):
                    raise RasterError(
                        f"{path.name} is not a rail raster, because {rail_count / count:.0%} of its cells are rail: "
                        "give the output of Rasterize Rail Points."
                    )
                cells.append(np.argwhere(block) + np.array([row, column]))
            rasters.append(grid.with_cells(np.concatenate(cells)))
    if not any(raster.tiles for raster in rasters):
        raise RasterError(f"{path.name} has no rail cell: give a raster with 1 where there is rail.")
    return tuple(rasters)


def write_rasters(path: Path, header: RasterHeader, rasters: Sequence[RailRaster], progress: Progress = SILENT) -> None:
    """Write rasters on the header's grid into a new file; cells outside its window are dropped.

    Parameters
    ----------
    path : Path
    header : RasterHeader
    rasters : sequence of RailRaster
        One for each class of the header.
    progress : Progress

    Raises
    ------
    OSError
        The file cannot be written.
    Cancelled
        The user cancelled.
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


def filled_blocks(dataset: gdal.Dataset, number: int) -> list[tuple[int, int, int, int]]:
    """Find the blocks of a band that the file stores: row, column, height and width of each, in cells."""
    return list(_filled(dataset.GetRasterBand(number), 0, 0, dataset.RasterYSize, dataset.RasterXSize))


def _filled(band: gdal.Band, row: int, column: int, height: int, width: int) -> Iterator[tuple[int, int, int, int]]:
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


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Translate the exceptions that GDAL raises for a damaged file if QGIS or another plugin has enabled them."""
    try:
        yield
    except RuntimeError as error:
        raise _unreadable(path) from error


def _open(path: Path) -> gdal.Dataset:
    dataset = gdal.OpenEx(str(path), gdal.OF_RASTER | gdal.OF_READONLY)
    if dataset is None or dataset.RasterCount == 0:
        raise _unreadable(path)
    return dataset


def _unreadable(path: Path) -> RasterError:
    return RasterError(f"{path} is not a readable raster: give the output of Rasterize Rail Points.")


def _class_codes(dataset: gdal.Dataset, name: str) -> tuple[int, ...]:
    """Return the class of each band from its description."""
    texts = [dataset.GetRasterBand(number).GetDescription() for number in range(1, dataset.RasterCount + 1)]
    if texts and all(map(is_class, texts)):
        codes = tuple(int(text) for text in texts)
        if len(set(codes)) < len(codes):
            raise RasterError(f"{name} has several bands for one class ({', '.join(texts)}): give one band per class.")
        return codes
    if len(texts) == 1:
        return (RAIL_CLASS,)
    raise RasterError(
        f"{name} has {len(texts)} bands, and not every description is a class code: give a raster with one band, or "
        "with one band per class as from Rasterize Rail Points."
    )


def _numbers(dataset: gdal.Dataset, tag: str, count: int) -> tuple[float, ...] | None:
    """Return the numbers of a tag, or None if it is missing."""
    text = dataset.GetMetadataItem(tag)
    if not text:
        return None
    try:
        numbers = tuple(float(word) for word in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise RasterError(f"The tag {tag} of the raster can't be {text!r}: rasterize the points again.")
    return numbers


def _extent(dataset: gdal.Dataset) -> tuple[float, float, float, float] | None:
    """Return west, south, east and north from the tag, or None if it is missing."""
    numbers = _numbers(dataset, EXTENT_TAG, 4)
    if numbers is None:
        return None
    west, south, east, north = numbers
    return west, south, east, north


def _length_m(dataset: gdal.Dataset, tag: str) -> float | None:
    """Return the length of a tag in millimetres, or None if it is missing."""
    numbers = _numbers(dataset, tag, 1)
    return None if numbers is None else numbers[0] / 1000


def _read(band: gdal.Band, row: int, column: int, height: int, width: int, name: str) -> np.ndarray:
    """Read the rail cells of a block, (height, width) bool."""
    is_rail = np.ones((height, width), dtype=bool)
    for cells in (band, band.GetMaskBand()):  # the mask is 0 at nodata
        try:
            data = cells.ReadRaster(column, row, width, height, buf_type=gdal.GDT_Byte)
        except RuntimeError:
            data = None
        if data is None:
            raise RasterError(f"{name} is damaged at row {row}, column {column}: create it again.")
        is_rail &= np.frombuffer(data, dtype=np.uint8).reshape(height, width) != 0
    return is_rail


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
