"""Rasterize Rail Points: marks the cells of a raster that contain rail points."""

from __future__ import annotations

from ..frpdf.models import choose
from ..progress import Progress
from . import inputs
from .declaration import CLOUD_WORDS, RAIL_WORDS, STEPS, RasterOutput
from .result import Result
from .values import Job, Values


def _check(values: Values) -> None:
    """Check that a network fits the rails."""
    standard = values.standard()
    choose(standard.gauge_m, standard.head_width_m)


def _run(values: Values, progress: Progress) -> Result:
    """Rasterize each class."""
    from ..checks.warnings import plausible
    from ..clouds.on_heads import heads_of
    from ..clouds.points import read_requested
    from ..files.rail_rasters import header_for
    from ..raster import cell_size, rasterize
    from ..tiles.grid import MemorySource
    from .track_inputs import SQUARE_M

    standard = values.standard()
    request = values.request(values.class_codes(), progress)
    clouds = [heads_of(points) for points in read_requested(request, progress)]
    dense = {source.class_code for source in plausible([MemorySource(one, SQUARE_M) for one in clouds], progress)}
    clouds = [points for points in clouds if points.class_code in dense]
    cell_m = cell_size(standard.gauge_m, standard.head_width_m)
    rasters = [rasterize(points.xyz, cell_m) for points in clouds]
    frame, codes = clouds[0].frame, [points.class_code for points in clouds]
    header = header_for(rasters, codes, frame, standard, values.extent(frame.crs_wkt))
    return Result({}, frame, rasters={"OUTPUT": lambda: (header, rasters)})


JOB = Job(
    "rasterizerailpoints",
    "Rasterize rail points",
    "Marks the cells of a raster that contain lidar points classified as rail.",
    "The raster has one band per class, with 1 where there is rail. The cell size is the one that the network "
    "expects for the gauge and railhead width: 4 cm for the commonest rails. Tags of the file state both.\n\n"
    "Empty areas take no space in the file, so a raster may cover a whole railway line.",
    (*RAIL_WORDS, *CLOUD_WORDS, "raster", "cells", "image"),
    (("numpy",), ("laspy",), ("lazrs",), ("pyproj",)),
    (inputs.CLOUD, inputs.RAIL_CLASSES, *inputs.RAIL, *inputs.AREA),
    (
        RasterOutput(
            "OUTPUT",
            "Rail raster",
            "A GeoTIFF; the input of Clean Rail Raster, which repairs it, or of Vectorize Rails.",
        ),
    ),
    group=STEPS,
    picture="raster.svg",
    call="rasterize",
    check=_check,
    run=_run,
)
