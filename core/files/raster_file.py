"""Layout of the files that hold rail rasters: GeoTIFFs with one band per class, of which only filled blocks are stored.

The plugin writes these files with GDAL, the command line with rasterio; `rail_rasters` reads them.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..errors import ParameterError, RasterError
from ..frame import LocalFrame
from ..frpdf.models import choose
from ..parameters import Parameters
from ..raster import TILE, RailRaster
from ..standards import CUSTOM, RailStandard, resolve

BLOCK = 4 * TILE
"""Cells along the side of a block in the file. Its table also lists empty blocks: 30,000 for 10 km at 4 cm."""

MAX_BLOCKS = 2**24
"""Largest number of blocks in a band: their table then takes 0.3 GB; a square of 167 km at 4 cm."""

NO_DATA = 0
"""Value of cells without rail, declared as no data; cells of rail have 1."""

GAUGE_TAG, HEAD_TAG, MODEL_TAG, EXTENT_TAG = "RAIL_GAUGE_MM", "RAIL_HEAD_MM", "RAIL_MODEL", "RAIL_EXTENT"


@dataclass(frozen=True)
class RasterHeader:
    """Everything that a file of rail rasters states except its cells; a band for each class.

    The origin of the frame is the north-western corner of cell (0, 0) of the rasters. `window` is the first row, first
    column, height and width of the part of the grid that the file covers, in cells. Gauge and width of the heads are
    those for which the raster was made; `model` names the weights that fit them.

    `extent` (smallest x and y, largest x and y, in units of the coordinate system) is that to which the points were
    restricted: lines end there and ignore what is beyond.
    """

    class_codes: tuple[int, ...]
    frame: LocalFrame
    cell_m: float
    window: tuple[int, int, int, int]
    gauge_m: float | None = None
    head_width_m: float | None = None
    model: str | None = None
    extent: tuple[float, float, float, float] | None = None

    @property
    def tags(self) -> dict[str, str]:
        """Metadata of the file."""
        texts = {
            GAUGE_TAG: _millimetres(self.gauge_m),
            HEAD_TAG: _millimetres(self.head_width_m),
            MODEL_TAG: self.model or "",
            EXTENT_TAG: ",".join(map(repr, self.extent or ())),
        }
        return {tag: text for tag, text in texts.items() if text}

    @property
    def corner(self) -> tuple[float, float]:
        """North-western corner of the file, in units of its coordinates."""
        row, column, _, _ = self.window
        x, y, _ = self.frame.to_crs(np.array([column * self.cell_m, -row * self.cell_m, 0.0])).tolist()
        return x, y

    @property
    def cell(self) -> float:
        """Side of a cell in units of the file's coordinates."""
        return self.cell_m / self.frame.horizontal_unit_m

    def filled_blocks(self, raster: RailRaster) -> list[tuple[int, int]]:
        """List the first row and column, in the file, of the blocks in which a raster has tiles."""
        row, column, height, width = self.window
        corners = {
            ((down * TILE - row) // BLOCK * BLOCK, (right * TILE - column) // BLOCK * BLOCK)
            for down, right in raster.tiles
        }
        return sorted((top, left) for top, left in corners if 0 <= top < height and 0 <= left < width)

    def block(self, raster: RailRaster, top: int, left: int) -> np.ndarray:
        """Read the cells of a block of the file, (height, width) uint8; blocks at the edge are smaller."""
        row, column, height, width = self.window
        size = min(BLOCK, height - top), min(BLOCK, width - left)
        return raster.read(row + top, column + left, *size).astype(np.uint8)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, smallest y, largest x, largest y of the area that the raster can show, in its coordinates."""
        if self.extent is not None:
            return self.extent
        row, column, height, width = self.window
        corners = np.array([[column, -row - height, 0], [column + width, -row, 0]]) * self.cell_m
        (west, south, _), (east, north, _) = self.frame.to_crs(corners).tolist()
        return west, south, east, north

    def standard(self, gauge_mm: float | None, head_width_mm: float | None) -> RailStandard:
        """Return the gauge and the railhead width: those that the user gives, otherwise those of the file.

        Raises ParameterError if neither states them, or the number is impossible.
        """
        gauge_mm = gauge_mm if gauge_mm is not None or self.gauge_m is None else 1000 * self.gauge_m
        head_width_mm = (
            head_width_mm if head_width_mm is not None or self.head_width_m is None else 1000 * self.head_width_m
        )
        if gauge_mm is None or head_width_mm is None:
            raise ParameterError(
                f"The raster does not state its gauge and railhead width (tags {GAUGE_TAG} and {HEAD_TAG}): "
                "fill in GAUGE and HEAD_WIDTH."
            )
        return resolve(CUSTOM, gauge_mm, head_width_mm)


def header_for(
    rasters: Sequence[RailRaster],
    class_codes: Sequence[int],
    frame: LocalFrame,
    standard: RailStandard,
    extent: tuple[float, float, float, float] | None = None,
    model: str = Parameters.model,
) -> RasterHeader:
    """Lay out a file for rasters of one grid, with a margin of a tile in which the network can close gaps.

    One of them, at least, has a rail cell. The frame has its origin in the corner of cell (0, 0). Raises RasterError if
    the cells are too far apart for a file.
    """
    tiles = np.array([tile for raster in rasters for tile in raster.tiles])
    first, last = tiles.min(axis=0) - 1, tiles.max(axis=0) + 2
    height, width = ((last - first) * TILE).tolist()
    cell_m = rasters[0].cell_m
    if math.ceil(height / BLOCK) * math.ceil(width / BLOCK) > MAX_BLOCKS:
        raise RasterError(
            f"The rail points are spread over {width * cell_m / 1000:.0f} by {height * cell_m / 1000:.0f} km, too "
            "large an area for a raster: set EXTENT, which also excludes stray points."
        )
    window = (*(first * TILE).tolist(), height, width)
    model = choose(standard.gauge_m, standard.head_width_m, model).name
    return RasterHeader(
        tuple(class_codes), frame, cell_m, window, standard.gauge_m, standard.head_width_m, model, extent
    )


def on_one_grid(rasters: Sequence[RailRaster], frame: LocalFrame) -> tuple[list[RailRaster], LocalFrame]:
    """Move rasters whose grids differ by whole tiles to the grid of the first; returns them and its frame."""
    first = rasters[0]
    side_m = TILE * first.cell_m
    aligned = []
    for raster in rasters:
        down, right = round((first.y0 - raster.y0) / side_m), round((raster.x0 - first.x0) / side_m)
        tiles = {(row + down, column + right): tile for (row, column), tile in raster.tiles.items()}
        aligned.append(replace(raster, tiles=tiles, x0=0.0, y0=0.0))
    return aligned, frame.with_origin(np.array([first.x0, first.y0, 0.0]))


def write_rasters(path: Path, header: RasterHeader, rasters: Sequence[RailRaster]) -> None:
    """Write rasters of one grid into a new file without QGIS, one band each; empty blocks take no space."""
    import rasterio

    _, _, height, width = header.window
    x, y = header.corner
    layout = {
        "driver": "GTiff",
        "height": height,
        "width": width,
        "count": len(header.class_codes),
        "dtype": "uint8",
        "crs": header.frame.crs_wkt,
        "transform": rasterio.Affine(header.cell, 0.0, x, 0.0, -header.cell, y),
        "nodata": NO_DATA,
        "tiled": True,
        "blockxsize": BLOCK,
        "blockysize": BLOCK,
        "sparse_ok": True,
        "interleave": "band",
        "compress": "deflate",
        "bigtiff": "IF_SAFER",
    }
    try:
        with own_proj_data(), rasterio.Env(), rasterio.open(path, "w", **layout) as file:
            file.update_tags(**header.tags)
            for band, (code, raster) in enumerate(zip(header.class_codes, rasters), start=1):
                file.set_band_description(band, str(code))
                for top, left in header.filled_blocks(raster):
                    cells = header.block(raster, top, left)
                    window = rasterio.windows.Window(left, top, cells.shape[1], cells.shape[0])
                    file.write(cells, band, window=window)
    except rasterio.errors.RasterioError as error:
        raise OSError(str(error)) from error


@contextmanager
def own_proj_data() -> Iterator[None]:
    """Let rasterio find the data of its own PROJ: the variables may name those of QGIS, which is another version."""
    hidden = {name: os.environ.pop(name) for name in ("PROJ_DATA", "PROJ_LIB") if name in os.environ}
    try:
        yield
    finally:
        os.environ.update(hidden)


def _millimetres(length_m: float | None) -> str:
    return "" if length_m is None else f"{1000 * length_m:.6g}"
