"""Vectorize Rails: turns a cleaned rail raster into lines, in 3D if a point cloud is given."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.jobs.clouds import CloudSource
from ...core.jobs.shared import figures_of
from ...core.jobs.vectorize_rails import JOB
from ...core.progress import Progress
from ...core.standards import RailStandard
from ..dialog.parameter_values import ParameterValues
from ..writing.layers import write_layer
from .base import RailAlgorithm

if TYPE_CHECKING:
    from ...core.files.raster_file import RasterHeader
    from ...core.rails import RailLine

READING = 0.3
"""Fraction of the progress bar for reading raster and cloud."""


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    path: Path
    header: RasterHeader
    standard: RailStandard
    cloud: CloudSource | None


class VectorizeRails(RailAlgorithm):
    """The algorithm ``railextract:vectorizerails``."""

    JOB = JOB

    def read(self, values: ParameterValues) -> Job:
        """Read the header of the raster, and find the files of the cloud."""
        path, header = values.raster("INPUT")
        standard = header.standard(values.optional_number("GAUGE"), values.optional_number("HEAD_WIDTH"))
        return Job(path, header, standard, values.cloud("POINTS") if values.filled("POINTS") else None)

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Vectorize each class, then write the lines."""
        from ...core.checks.lines import warn_of_rails
        from ...core.fields import RAILS
        from ...core.files.layers import lines_layer
        from ...core.jobs.area_points import Area, read_points_in
        from ...core.squares.steps import lines_of
        from ..reading.geotiff import read_rasters
        from ..reading.rasters import moved

        rasters = read_rasters(job.path, job.header, progress.span(0, READING / 2))
        if job.cloud is None:
            progress.warning("Without POINTS, the rails have no heights and are only as accurate as the raster.")
            frame, clouds = job.header.frame, {}
        else:
            area = Area("raster", job.header.class_codes, job.header.bounds, job.header.frame)
            clouds = read_points_in(area, job.cloud, progress.span(READING / 2, READING))
            frame = clouds[job.header.class_codes[0]].frame
            rasters = tuple(moved(raster, job.header.frame, frame) for raster in rasters)
        settings = values.settings(job.standard)
        rails: list[RailLine] = []
        shares = progress.span(READING, 1).split(len(rasters))
        for raster, code, share in zip(rasters, job.header.class_codes, shares):
            found = lines_of(raster, code, clouds.get(code), settings, share, first_id=len(rails) + 1)
            warn_of_rails(found, code, settings, progress)
            rails += found
        progress.check()
        written = write_layer(values, "OUTPUT", lines_layer(RAILS, rails), frame)
        return {**written, **figures_of(rails, "RAIL")}
