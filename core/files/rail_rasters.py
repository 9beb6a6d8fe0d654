"""Rail rasters in files: GeoTIFFs with one band per class, of which only blocks with rail cells are read.

QGIS reads them with GDAL, the command line and Python with rasterio; both provide a `RasterFile`.
"""

from __future__ import annotations

import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..clouds.crs import parse_crs, units
from ..errors import RasterError
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from ..raster import RailRaster
from ..standards import RAIL_CLASS, is_class
from .raster_file import EXTENT_TAG, GAUGE_TAG, HEAD_TAG, MODEL_TAG, RasterHeader, own_proj_data

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
