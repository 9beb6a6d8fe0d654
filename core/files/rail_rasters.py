"""Rail rasters in files: GeoTIFFs with one band per class, of which only blocks with rail cells are stored and read.

QGIS reads and writes them with GDAL, the command line and Python with rasterio; both provide a `RasterFile`.
"""

from __future__ import annotations

import math
import os
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..clouds.crs import parse_crs, units
from ..errors import ParameterError, RasterError
from ..frame import LocalFrame
from ..frpdf.models import choose
from ..parameters import Parameters
from ..progress import SILENT, Progress
from ..raster import TILE, RailRaster
from ..standards import CUSTOM, RAIL_CLASS, RailStandard, is_class, resolve

BLOCK = 4 * TILE
"""Cells along the side of a block in the file. Its table also lists empty blocks: 30,000 for 10 km at 4 cm."""

MAX_BLOCKS = 2**24
"""Largest number of blocks in a band: their table then takes 0.3 GB; a square of 167 km at 4 cm."""

NO_DATA = 0
"""Value of cells without rail, declared as no data; cells of rail have 1."""

GAUGE_TAG, HEAD_TAG, MODEL_TAG, EXTENT_TAG = "RAIL_GAUGE_MM", "RAIL_HEAD_MM", "RAIL_MODEL", "RAIL_EXTENT"

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

Block = tuple[int, int, int, int]
"""First row, first column, height and width of a part of a raster, in cells."""


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


class RasterFile(ABC):
    """A raster that is open for reading; its methods raise an `OSError` where the file is damaged.

    The transform is that of GDAL: x, cell width, skew, y, skew, negative cell height. The shape is in cells; `bands`
    has the description of each band.
    """

    transform: tuple[float, ...]
    crs_wkt: str | None
    shape: tuple[int, int]
    bands: tuple[str, ...]
    tags: Mapping[str, str]

    @abstractmethod
    def filled_blocks(self, number: int) -> list[Block]:
        """Return the blocks of a band, counted from 1, that the file stores."""

    @abstractmethod
    def read(self, number: int, block: Block) -> np.ndarray:
        """Return which cells of a block are rail, (height, width) bool: neither 0 nor nodata."""


@dataclass(frozen=True)
class RasterSource:
    """A file of rail rasters, and what opens it: a context with the open file, or an `OSError` if it is none."""

    path: Path
    open: Callable[[Path], AbstractContextManager[RasterFile]]

    @cached_property
    def header(self) -> RasterHeader:
        """Everything except the cells, checked.

        Raises RasterError if the file is not a raster or is rotated, its cells are not square or too small or too large
        for rails, or the class of a band is unknown; CrsError if its coordinate system is not in units of length.
        """
        with self._opened() as file:
            x, width, skew_x, y, skew_y, height = file.transform
            name, unit_m = self.path.name, units(parse_crs(file.crs_wkt))[0] if file.crs_wkt else 1.0
            if skew_x or skew_y or not math.isclose(width, -height, rel_tol=SIDE_TOLERANCE) or width <= 0:
                raise RasterError(f"{name} is rotated or its cells are not square: warp it to square cells, north up.")
            if not MIN_CELL_M <= width * unit_m <= MAX_CELL_M:
                raise RasterError(
                    f"{name} has cells of {width * unit_m:.3g} m, and rails are seen in cells of {MIN_CELL_M:g} to "
                    f"{MAX_CELL_M:g} m: rasterize the points again, or check the coordinate system."
                )
            if not math.ulp(x) + math.ulp(y) < PLACE_TOLERANCE * width:
                raise RasterError(f"{name} begins at {x:g}, {y:g}, where no rails can be: rasterize the points again.")
            return RasterHeader(
                class_codes=_class_codes(file.bands, name),
                frame=LocalFrame(np.array([x, y, 0.0]), unit_m, unit_m, file.crs_wkt),
                cell_m=width * unit_m,
                window=(0, 0, *file.shape),
                gauge_m=_length_m(file.tags, GAUGE_TAG),
                head_width_m=_length_m(file.tags, HEAD_TAG),
                model=file.tags.get(MODEL_TAG),
                extent=_extent(file.tags),
            )

    def read(self, progress: Progress = SILENT) -> tuple[RailRaster, ...]:
        """Read the cells of all bands.

        Raises RasterError if the file is damaged, has no rail cell, or shows something other than rails.
        """
        grid = RailRaster({}, self.header.cell_m, 0.0, 0.0)
        shares = progress.split(len(self.header.class_codes))
        with self._opened() as file:
            found = [
                grid.with_cells(self._cells_of(file, number, share)) for number, share in enumerate(shares, start=1)
            ]
        if not any(raster.tiles for raster in found):
            raise RasterError(f"{self.path.name} has no rail cell: give a raster with 1 where there is rail.")
        return tuple(found)

    @contextmanager
    def _opened(self) -> Iterator[RasterFile]:
        try:
            with self.open(self.path) as file:
                yield file
        except OSError as error:
            raise RasterError(
                f"{self.path} is not a readable raster: give the output of Rasterize Rail Points."
            ) from error

    def _cells_of(self, file: RasterFile, number: int, progress: Progress) -> np.ndarray:
        """Return row and column of the rail cells of a band, (n, 2)."""
        cells = [np.empty((0, 2), dtype=np.int64)]
        rail_count, count = 0, 0
        for block in progress.follow(file.filled_blocks(number)):
            try:
                is_rail = file.read(number, block)
            except OSError as error:
                place = f"row {block[0]}, column {block[1]}"
                raise RasterError(f"{self.path.name} is damaged at {place}: create it again.") from error
            rail_count, count = rail_count + np.count_nonzero(is_rail), count + is_rail.size
            if rail_count > max(MANY_CELLS, MAX_SHARE * count):
                raise RasterError(
                    f"{self.path.name} is not a rail raster, because {rail_count / count:.0%} of its cells are rail: "
                    "give the output of Rasterize Rail Points."
                )
            cells.append(np.argwhere(is_rail) + np.array(block[:2]))
        return np.concatenate(cells)


def _class_codes(texts: tuple[str, ...], name: str) -> tuple[int, ...]:
    """Return the class of each band from its description."""
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


def _numbers(tags: Mapping[str, str], tag: str, count: int) -> tuple[float, ...] | None:
    """Return the numbers of a tag, or None if it is missing."""
    text = tags.get(tag)
    if not text:
        return None
    try:
        numbers = tuple(float(word) for word in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise RasterError(f"The tag {tag} of the raster can't be {text!r}: rasterize the points again.")
    return numbers


def _extent(tags: Mapping[str, str]) -> tuple[float, float, float, float] | None:
    """Return west, south, east and north from the tag, or None if it is missing."""
    numbers = _numbers(tags, EXTENT_TAG, 4)
    if numbers is None:
        return None
    west, south, east, north = numbers
    return west, south, east, north


def _length_m(tags: Mapping[str, str], tag: str) -> float | None:
    """Return the length of a tag in millimetres, or None if it is missing."""
    numbers = _numbers(tags, tag, 1)
    return None if numbers is None else numbers[0] / 1000


@contextmanager
def open_with_rasterio(path: Path) -> Iterator[RasterFile]:
    """Open a raster with rasterio."""
    import rasterio

    with own_proj_data(), warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        with rasterio.Env(), rasterio.open(path) as file:
            yield _RasterioFile(file)


class _RasterioFile(RasterFile):
    """A raster that rasterio has opened."""

    def __init__(self, file: Any) -> None:
        self._file = file
        self.transform, self.shape = file.transform.to_gdal(), (file.height, file.width)
        self.crs_wkt = file.crs.to_wkt() if file.crs else None
        self.bands, self.tags = tuple(text or "" for text in file.descriptions), file.tags()

    def filled_blocks(self, number: int) -> list[Block]:
        """Return the blocks that a GeoTIFF stores, or all of another file."""
        return [
            (window.row_off, window.col_off, window.height, window.width)
            for place, window in self._file.block_windows(number)
            if self._file.driver != "GTiff" or self._is_stored(number, *place)
        ]

    def _is_stored(self, number: int, row: int, column: int) -> bool:
        return self._file.get_tag_item(f"BLOCK_OFFSET_{column}_{row}", "TIFF", bidx=number) is not None

    def read(self, number: int, block: Block) -> np.ndarray:
        """Return which cells of a block are rail."""
        import rasterio

        row, column, height, width = block
        window = rasterio.windows.Window(column, row, width, height)
        is_known = self._file.read_masks(number, window=window) != 0
        return is_known & (self._file.read(number, window=window, out_dtype="uint8") != 0)
