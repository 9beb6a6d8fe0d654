"""What a file of rail rasters says besides its cells: grid, classes, coordinate system, and the rails it is of."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.errors import ParameterError, RasterError
from ...core.frame import LocalFrame
from ...core.frpdf.models import MODELS, Model, choose
from ...core.raster import TILE, RailRaster, cell_size
from ...core.standards import CUSTOM, RailStandard, resolve

BLOCK = 4 * TILE
"""Cells along the side of a block in the file. Its table lists the empty ones too: at 4 cm, 30,000 for 10 km."""

MOST_BLOCKS = 2**24
"""Blocks in a band, at most: their table then takes 0.3 GB; a square of 167 km at 4 cm."""

CELL_TOLERANCE = 0.03
"""Share by which cells may differ from what the network expects: between tracks that training gave it."""

GAUGE_TAG, HEAD_TAG, MODEL_TAG, EXTENT_TAG = "RAIL_GAUGE_MM", "RAIL_HEAD_MM", "RAIL_MODEL", "RAIL_EXTENT"


@dataclass(frozen=True)
class RasterHeader:
    """What a file of rail rasters says besides its cells.

    Attributes
    ----------
    class_codes : tuple of int
        One for each band.
    frame : LocalFrame
        Its origin is the corner of cell (0, 0) of the `RailRaster`s.
    cell_m : float
    window : tuple of int
        First row, first column, height and width of the file's part of the grid, in cells.
    gauge_m, head_width_m : float or None
        Of the rails that the raster was made for.
    model : str or None
        Name of the network's weights that fit it.
    extent : tuple of float or None
        Smallest x, smallest y, largest x, largest y of the points that were taken, in units of the coordinate system,
        where not all were: lines end there, and take no account of what lies beyond.
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
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, smallest y, largest x, largest y of what the raster may show, in units of its coordinates."""
        if self.extent is not None:
            return self.extent
        row, column, height, width = self.window
        corners = np.array([[column, -row - height, 0], [column + width, -row, 0]]) * self.cell_m
        (west, south, _), (east, north, _) = self.frame.to_crs(corners).tolist()
        return west, south, east, north

    def standard(self, gauge_mm: float | None, head_width_mm: float | None) -> RailStandard:
        """Find gauge and head width: what the user gives, else what the file says.

        Raises
        ------
        ParameterError
            Neither says, or the number is impossible.
        """
        gauge_mm = gauge_mm if gauge_mm is not None or self.gauge_m is None else 1000 * self.gauge_m
        head_width_mm = (
            head_width_mm if head_width_mm is not None or self.head_width_m is None else 1000 * self.head_width_m
        )
        if gauge_mm is None or head_width_mm is None:
            raise ParameterError(
                f"The raster does not say for which rails it was made (tags {GAUGE_TAG} and {HEAD_TAG}): "
                "fill GAUGE and HEAD_WIDTH."
            )
        return resolve(CUSTOM, gauge_mm, head_width_mm)


def header_for(
    rasters: Sequence[RailRaster],
    class_codes: Sequence[int],
    frame: LocalFrame,
    standard: RailStandard,
    extent: tuple[float, float, float, float] | None = None,
) -> RasterHeader:
    """Lay out a file that holds rasters of one grid and a margin of a tile, in which the network may close gaps.

    Raises
    ------
    RasterError
        The cells lie too far apart for a file.
    """
    tiles = np.array([tile for raster in rasters for tile in raster.tiles])
    first, last = tiles.min(axis=0) - 1, tiles.max(axis=0) + 2
    height, width = ((last - first) * TILE).tolist()
    cell_m = rasters[0].cell_m
    if math.ceil(height / BLOCK) * math.ceil(width / BLOCK) > MOST_BLOCKS:
        raise RasterError(
            f"The rail points are spread over {width * cell_m / 1000:.0f} by {height * cell_m / 1000:.0f} km, too far "
            "for a raster: set EXTENT, which also leaves out stray points."
        )
    window = (*(first * TILE).tolist(), height, width)
    model = choose(standard.gauge_m, standard.head_width_m).name
    return RasterHeader(
        tuple(class_codes), frame, cell_m, window, standard.gauge_m, standard.head_width_m, model, extent
    )


def choose_model(header: RasterHeader, standard: RailStandard, name: str) -> Model:
    """Find the model that the user named, or that the raster names, or that fits the rails; check the cell size.

    Parameters
    ----------
    header : RasterHeader
    standard : RailStandard
        The raster's rails.
    name : str
        Name of a model, or AUTO.

    Raises
    ------
    ModelError
        No model fits.
    RasterError
        The cells are not as large as the network expects for such rails.
    """
    expected_m = cell_size(standard.gauge_m, standard.head_width_m)
    if not math.isclose(header.cell_m, expected_m, rel_tol=CELL_TOLERANCE):
        raise RasterError(
            f"The raster's cells are {1000 * header.cell_m:.1f} mm wide, but a gauge of {1000 * standard.gauge_m:.0f} "
            f"mm with a railhead of {1000 * standard.head_width_m:.1f} mm needs {1000 * expected_m:.1f} mm: rasterize "
            "the points for these rails, or correct GAUGE and HEAD_WIDTH."
        )
    named = {model.name: model for model in MODELS}
    return named.get(name) or named.get(header.model or "") or choose(standard.gauge_m, standard.head_width_m)


def on_one_grid(rasters: Sequence[RailRaster], frame: LocalFrame) -> tuple[list[RailRaster], LocalFrame]:
    """Give rasters whose grids lie whole tiles apart the grid of the first, and the frame that it begins at."""
    first = rasters[0]
    side_m = TILE * first.cell_m
    aligned = []
    for raster in rasters:
        down, right = round((first.y0 - raster.y0) / side_m), round((raster.x0 - first.x0) / side_m)
        tiles = {(row + down, column + right): tile for (row, column), tile in raster.tiles.items()}
        aligned.append(replace(raster, tiles=tiles, x0=0.0, y0=0.0))
    return aligned, frame.with_origin(np.array([first.x0, first.y0, 0.0]))


def moved(raster: RailRaster, frame: LocalFrame, other: LocalFrame) -> RailRaster:
    """Give a raster's place in another local frame of the same coordinate system."""
    right, up, _ = frame.shift_to(other)
    return replace(raster, x0=raster.x0 + float(right), y0=raster.y0 + float(up))
