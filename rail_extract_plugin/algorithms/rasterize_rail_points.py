"""Rasterize Rail Points: marks the cells of a raster that contain rail points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...core.frpdf.models import choose as choose_model
from ...core.jobs.clouds import CloudSource, read_points
from ...core.jobs.rasterize_rail_points import JOB
from ...core.progress import Progress
from ...core.standards import RailStandard
from ..dialog.parameter_values import ParameterValues
from ..writing.layers import write_raster
from .base import RailAlgorithm

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

    JOB = JOB

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        standard = values.standard()
        choose_model(standard.gauge_m, standard.head_width_m)
        return Job(values.cloud("INPUT"), values.class_codes(), standard)

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Rasterize each class, then write the file."""
        from ...core.files.raster_file import header_for
        from ...core.jobs.track_inputs import SQUARE_M
        from ...core.raster import cell_size, rasterize
        from ...core.squares.density import plausible
        from ...core.squares.grid import MemorySource

        clouds = read_points(job.cloud, job.class_codes, values.extent, progress.span(0, READING))
        dense = {source.class_code for source in plausible([MemorySource(one, SQUARE_M) for one in clouds], progress)}
        clouds = tuple(points for points in clouds if points.class_code in dense)
        cell_m = cell_size(job.standard.gauge_m, job.standard.head_width_m)
        rasters = [rasterize(points.xyz, cell_m) for points in clouds]
        frame, codes = clouds[0].frame, [points.class_code for points in clouds]
        extent = values.extent(frame.crs_wkt)
        header = header_for(rasters, codes, frame, job.standard, extent)
        return write_raster(values, "OUTPUT", header, rasters, progress.span(READING, 1))
