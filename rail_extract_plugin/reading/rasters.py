"""Model and position of rail rasters from files."""

from __future__ import annotations

import math
from dataclasses import replace

from ...core.errors import RasterError
from ...core.files.raster_file import RasterHeader
from ...core.frame import LocalFrame
from ...core.frpdf.models import MODELS, Model, choose
from ...core.raster import RailRaster, cell_size
from ...core.standards import RailStandard

CELL_TOLERANCE = 0.03
"""Relative deviation allowed from the cell size that the network expects; its training covered such a deviation."""


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
        The cells do not have the size that the network expects for these rails.
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


def moved(raster: RailRaster, frame: LocalFrame, other: LocalFrame) -> RailRaster:
    """Return a raster in another local frame of the same coordinate system.

    Parameters
    ----------
    raster : RailRaster
    frame, other : LocalFrame
        Present frame and new frame.
    """
    right, up, _ = frame.shift_to(other)
    return replace(raster, x0=raster.x0 + float(right), y0=raster.y0 + float(up))
