"""Clean Rail Raster (FRPDF): the network closes gaps in a rail raster and removes noise."""

from __future__ import annotations

from . import shared
from .declaration import RAIL_WORDS, STEPS, Job, RasterOutput

JOB = Job(
    "frpdfcleanup",
    "Clean rail raster (FRPDF)",
    "Closes gaps in a rail raster and removes cells that are not rail, with the neural network FRPDF.",
    "Takes the raster of Rasterize Rail Points, or a similar one. The result has the same grid, bands and tags. "
    "The network works in passes: each pass starts from the result of the pass before.\n\n"
    "A raster from other software does not state its gauge and railhead width: fill them in.",
    (*RAIL_WORDS, "raster", "neural network", "deep learning", "clean", "repair", "gaps", "noise"),
    (("numpy",), ("pyproj",), ("cv2", "torch")),
    (shared.RASTER, shared.MODEL, *shared.CLEANUP, *shared.RASTER_RAIL),
    (RasterOutput("OUTPUT", "Cleaned rail raster", "A GeoTIFF; the input of Vectorize Rails."),),
    (shared.ENGINE_USED,),
    STEPS,
    picture="raster.svg",
)
