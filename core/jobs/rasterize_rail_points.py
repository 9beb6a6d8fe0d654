"""Rasterize Rail Points: marks the cells of a raster that contain rail points."""

from __future__ import annotations

from . import shared
from .declaration import CLOUD_WORDS, RAIL_WORDS, STEPS, Job, RasterOutput

JOB = Job(
    "rasterizerailpoints",
    "Rasterize rail points",
    "Marks the cells of a raster that contain lidar points classified as rail.",
    "The raster has one band per class, with 1 where there is rail. The cell size is the one that the network "
    "expects for the gauge and railhead width: 4 cm for the commonest rails. Tags of the file state both.\n\n"
    "Empty areas take no space in the file, so a raster may cover a whole railway line.",
    (*RAIL_WORDS, *CLOUD_WORDS, "raster", "cells", "image"),
    (("numpy",), ("laspy",), ("lazrs",), ("pyproj",)),
    (shared.CLOUD, shared.RAIL_CLASSES, *shared.RAIL, *shared.AREA),
    (
        RasterOutput(
            "OUTPUT",
            "Rail raster",
            "A GeoTIFF; the input of Clean Rail Raster, which repairs it, or of Vectorize Rails.",
        ),
    ),
    group=STEPS,
    picture="raster.svg",
)
