"""Vectorize Rails: from a cleaned rail raster to the lines of the railheads, with heights where points give them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import (
    QgsProcessingContext,
)

from ...core.progress import Progress
from ...core.standards import RailStandard
from ..dialog import inputs, outputs
from ..dialog import parameters as groups
from ..dialog.parameter_values import ParameterValues
from ..reading.clouds import CloudSource
from ..writing.layers import RAILS, figures_of, write_lines
from .base import CLOUD_WORDS, RAIL_WORDS, RailAlgorithm

if TYPE_CHECKING:
    from ...core.rails import RailLine
    from ..reading.rasters import RasterHeader

READING = 0.3
"""Share of the progress bar for reading raster and cloud."""


@dataclass(frozen=True)
class Job:
    """What the parameters say."""

    path: Path
    header: RasterHeader
    standard: RailStandard
    cloud: CloudSource | None


class VectorizeRails(RailAlgorithm):
    """The algorithm ``railextract:vectorizerails``."""

    NAME = "vectorizerails"
    LABEL = "Vectorize rails"
    TAGS = (*RAIL_WORDS, *CLOUD_WORDS, "raster", "vectorize", "line", "3d")
    PICTURE = "gauge.svg"
    NEEDS = (("numpy",), ("scipy",), ("laspy",), ("lazrs",), ("pyproj",))
    SUMMARY = "Turns a rail raster into the lines of the railheads, and points give them their exact place and height."
    HELP = (
        "Takes the raster of FRPDF Cleanup, or one like it. With the cloud that it was made from, a line is the top of "
        "the railhead on the head's own axis. Without it, lines are flat and lie where the raster shows them.\n\n"
        "A raster made elsewhere does not say for which rails it was made: fill the gauge and the railhead width then."
    )

    def initAlgorithm(self, config: dict[str, Any] | None = None) -> None:
        """Declare the parameters and outputs of the interface, in its order."""
        for definition in (inputs.raster(), inputs.points(), *groups.lines(), *groups.raster_rail()):
            self.addParameter(definition)
        self.addParameter(outputs.rails())
        for output in outputs.rail_figures():
            self.addOutput(output)

    def read(self, parameters: dict[str, Any], context: QgsProcessingContext) -> Job:
        """Read the raster's header, and find the cloud's files."""
        values = ParameterValues(self, parameters, context)
        path, header = values.raster("INPUT")
        standard = header.standard(values.optional_number("GAUGE"), values.optional_number("HEAD_WIDTH"))
        return Job(path, header, standard, values.cloud("POINTS") if values.filled("POINTS") else None)

    def compute(
        self, job: Job, parameters: dict[str, Any], context: QgsProcessingContext, progress: Progress
    ) -> dict[str, Any]:
        """Make the lines of every class, then write them."""
        from ...core.pipeline import lines_of
        from ..reading.area_points import Area, read_points_in
        from ..reading.geotiff import read_rasters
        from ..reading.rasters import moved

        rasters = read_rasters(job.path, job.header, progress.span(0, READING / 2))
        if job.cloud is None:
            progress.warning("Without POINTS the rails have no heights and lie where the raster shows them.")
            frame, clouds = job.header.frame, {}
        else:
            area = Area("raster", job.header.class_codes, job.header.bounds, job.header.frame)
            clouds = read_points_in(area, job.cloud, progress.span(READING / 2, READING))
            frame = clouds[job.header.class_codes[0]].frame
            rasters = tuple(moved(raster, job.header.frame, frame) for raster in rasters)
        settings = ParameterValues(self, parameters, context).settings(job.standard)
        rails: list[RailLine] = []
        shares = progress.span(READING, 1).split(len(rasters))
        for raster, code, share in zip(rasters, job.header.class_codes, shares):
            rails += lines_of(raster, code, clouds.get(code), settings, share, first_id=len(rails) + 1)
        progress.check()
        written = write_lines(self, "OUTPUT", RAILS, rails, frame, parameters, context)
        return {**written, **figures_of(rails, "RAIL")}
