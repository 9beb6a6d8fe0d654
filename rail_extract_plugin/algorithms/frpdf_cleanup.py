"""Clean Rail Raster (FRPDF): the network closes gaps in a rail raster and removes noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.frpdf.models import Model
from ...core.jobs.frpdf_cleanup import JOB
from ...core.progress import Progress
from ..dialog.parameter_values import ParameterValues
from ..writing.layers import write_raster
from .base import RailAlgorithm

if TYPE_CHECKING:
    from ...core.files.raster_file import RasterHeader

READING, WRITING = 0.05, 0.95
"""Fractions of the progress bar at which the network starts and ends."""


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    path: Path
    header: RasterHeader
    model: Model


class FrpdfCleanup(RailAlgorithm):
    """The algorithm ``railextract:frpdfcleanup``."""

    JOB = JOB

    def read(self, values: ParameterValues) -> Job:
        """Read the header of the raster and check that a model fits it."""
        from ..reading.rasters import choose_model

        path, header = values.raster("INPUT")
        standard = header.standard(values.optional_number("GAUGE"), values.optional_number("HEAD_WIDTH"))
        header = replace(header, gauge_m=standard.gauge_m, head_width_m=standard.head_width_m)
        model = choose_model(header, standard, values.choice("MODEL"))
        return Job(path, replace(header, model=model.name), model)

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Clean each band, then write the file."""
        from ...core.frpdf.cleanup import clean
        from ...core.frpdf.engines import make_engine
        from ...core.frpdf.weights import load_arrays
        from ..reading.geotiff import read_rasters

        engine = make_engine(load_arrays(job.model.path), values.choice("ENGINE"), values.choice("DEVICE"))
        rasters = read_rasters(job.path, job.header, progress.span(0, READING))
        passes = int(values.number("ITERATIONS"))
        progress.info(f"Network {job.model.name}, {engine.description}.")
        shares = progress.span(READING, WRITING).split(len(rasters))
        cleaned = [clean(raster, engine, passes, share) for raster, share in zip(rasters, shares)]
        for code, before, after in zip(job.header.class_codes, rasters, cleaned):
            progress.info(f"Class {code}: {before.count():,} rail cells before, {after.count():,} after.")
        written = write_raster(values, "OUTPUT", job.header, cleaned, progress.span(WRITING, 1))
        return {**written, "ENGINE_USED": engine.description}
