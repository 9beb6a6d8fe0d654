"""Clean Rail Raster (FRPDF): the network closes gaps in a rail raster and removes noise."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from ..errors import RasterError
from ..frpdf.models import MODELS, Model, choose
from ..progress import Progress
from . import inputs, methods, outputs
from .declaration import RAIL_WORDS, STEPS, RasterOutput
from .result import Result
from .values import Job, Values

if TYPE_CHECKING:
    from ..files.rail_rasters import RasterHeader
    from ..standards import RailStandard

CELL_TOLERANCE = 0.03
"""Relative deviation allowed from the cell size that the network expects; its training covered such a deviation."""


def _check(values: Values) -> None:
    """Check that a model fits the raster."""
    _planned(values)


def _planned(values: Values) -> tuple[RasterHeader, Model]:
    """Return the header of the result, and the model that makes it."""
    header = values.raster("INPUT").header
    standard = header.standard(values["GAUGE"], values["HEAD_WIDTH"])
    model = model_for(header, standard, values["MODEL"])
    gauge_m, head_width_m = standard.gauge_m, standard.head_width_m
    return replace(header, gauge_m=gauge_m, head_width_m=head_width_m, model=model.name), model


def model_for(header: RasterHeader, standard: RailStandard, name: str) -> Model:
    """Return the model that the user named, or that a raster names, or that fits its rails; check the cell size.

    Raises ModelError if no model fits, and RasterError if the network expects another cell size for these rails.
    """
    from ..raster import cell_size

    gauge_m, head_m = standard.gauge_m, standard.head_width_m
    expected_m = cell_size(gauge_m, head_m)
    if not math.isclose(header.cell_m, expected_m, rel_tol=CELL_TOLERANCE):
        raise RasterError(
            f"The raster's cells are {1000 * header.cell_m:.1f} mm wide, but a gauge of {1000 * gauge_m:.0f} mm with "
            f"a railhead of {1000 * head_m:.1f} mm needs {1000 * expected_m:.1f} mm: rasterize the points for these "
            "rails, or correct GAUGE and HEAD_WIDTH."
        )
    named = {model.name: model for model in MODELS}
    return named.get(name) or named.get(header.model or "") or choose(gauge_m, head_m)


def _run(values: Values, progress: Progress) -> Result:
    """Clean each band."""
    from ..frpdf.cleanup import clean, make_engine
    from ..frpdf.weights import load_arrays

    header, model = _planned(values)
    engine = make_engine(load_arrays(model.path), values["ENGINE"], values["DEVICE"])
    reading, cleaning = progress.after_reading()
    rasters = values.raster("INPUT").read(reading)
    progress.info(f"Network {model.name}, {engine.description}.")
    shares = cleaning.split(len(rasters))
    cleaned = [clean(raster, engine, values["ITERATIONS"], share) for raster, share in zip(rasters, shares)]
    for code, before, after in zip(header.class_codes, rasters, cleaned):
        progress.info(f"Class {code}: {before.count():,} rail cells before, {after.count():,} after.")
    figures = {"ENGINE_USED": engine.description}
    return Result(figures, header.frame, rasters={"OUTPUT": lambda: (header, cleaned)})


JOB = Job(
    "frpdfcleanup",
    "Clean rail raster (FRPDF)",
    "Closes gaps in a rail raster and removes cells that are not rail, with the neural network FRPDF.",
    "Takes the raster of Rasterize Rail Points, or a similar one. The result has the same grid, bands and tags. "
    "The network works in passes: each pass starts from the result of the pass before.\n\n"
    "A raster from other software does not state its gauge and railhead width: fill them in.",
    (*RAIL_WORDS, "raster", "neural network", "deep learning", "clean", "repair", "gaps", "noise"),
    (("numpy",), ("pyproj",), ("cv2", "torch")),
    (inputs.RASTER, methods.MODEL, *methods.CLEANUP, *inputs.RASTER_RAIL),
    (RasterOutput("OUTPUT", "Cleaned rail raster", "A GeoTIFF; the input of Vectorize Rails."),),
    (outputs.ENGINE_USED,),
    STEPS,
    picture="raster.svg",
    call="clean",
    check=_check,
    run=_run,
)
