"""Rasterize Rail Points: marks the cells of a raster that contain rail points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from qgis.core import QgsProcessingParameterRasterDestination

from ...core.frpdf.models import choose as choose_model
from ...core.progress import Progress
from ...core.standards import RailStandard
from ..dialog import inputs
from ..dialog import parameters as groups
from ..dialog.definitions import Definitions, helped
from ..dialog.parameter_values import ParameterValues
from ..reading.clouds import CloudSource, read_points
from ..systems import system
from ..writing.layers import write_raster
from .base import CLOUD_WORDS, RAIL_WORDS, RailAlgorithm
from .toolbox_groups import STEPS

READING = 0.8
"""Fraction of the progress bar for reading the cloud."""


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    cloud: CloudSource
    class_codes: tuple[int, ...]
    standard: RailStandard


class RasterizeRailPoints(RailAlgorithm):
    """The algorithm ``railextract:rasterizerailpoints``."""

    NAME = "rasterizerailpoints"
    LABEL = "Rasterize rail points"
    GROUP = STEPS
    TAGS = (*RAIL_WORDS, *CLOUD_WORDS, "raster", "cells", "image")
    PICTURE = "raster.svg"
    NEEDS = (("numpy",), ("laspy",), ("lazrs",), ("pyproj",))
    SUMMARY = "Marks the cells of a raster that contain lidar points classified as rail."
    HELP = (
        "The raster has one band per class, with 1 where there is rail. The cell size is the one that the network "
        "expects for the gauge and railhead width: 4 cm for the commonest rails. Tags of the file state both.\n\n"
        "Empty areas take no space in the file, so a raster may cover a whole railway line."
    )

    def definitions(self) -> Definitions:
        """Return the parameters and outputs in the order of the interface."""
        return (
            *inputs.cloud(),
            *groups.rail(),
            *groups.area(),
            helped(
                QgsProcessingParameterRasterDestination("OUTPUT", "Rail raster"),
                "A GeoTIFF; the input of Clean Rail Raster, which repairs it, or of Vectorize Rails.",
            ),
        )

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        standard = values.standard()
        choose_model(standard.gauge_m, standard.head_width_m)
        return Job(values.cloud("INPUT"), values.class_codes(), standard)

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Rasterize each class, then write the file."""
        from ...core.output.raster_file import header_for
        from ...core.raster import cell_size, rasterize
        from ...core.squares.density import plausible
        from ...core.squares.grid import MemorySource
        from ..reading.track_inputs import SQUARE_M

        clouds = read_points(job.cloud, job.class_codes, values.extent, progress.span(0, READING))
        dense = {source.class_code for source in plausible([MemorySource(one, SQUARE_M) for one in clouds], progress)}
        clouds = tuple(points for points in clouds if points.class_code in dense)
        cell_m = cell_size(job.standard.gauge_m, job.standard.head_width_m)
        rasters = [rasterize(points.xyz, cell_m) for points in clouds]
        frame, codes = clouds[0].frame, [points.class_code for points in clouds]
        extent = values.extent(system(frame.crs_wkt))
        header = header_for(rasters, codes, frame, job.standard, extent)
        return write_raster(values, "OUTPUT", header, rasters, progress.span(READING, 1))
