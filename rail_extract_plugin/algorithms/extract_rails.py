"""Extract Rails: the whole way from a classified cloud to 3D rails and track centerlines."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.errors import ParameterError
from ...core.frpdf.models import choose as choose_model
from ...core.jobs.clouds import CloudSource, checked_crs, request_points
from ...core.jobs.extract_rails import JOB
from ...core.jobs.shared import figures_of, figures_of_stations
from ...core.parameters import LEARNED
from ...core.progress import Estimating, Progress
from ...core.standards import DEFAULT, SEARCHED_CLASSES, Gauge, RailStandard
from ..dialog.parameter_values import ParameterValues
from ..reading.clouds import points_folder
from ..writing.layers import layer_writers, write_raster
from ..writing.reports import write_report
from ..writing.run import properties_of
from ..writing.whole_files import write_each
from .base import RailAlgorithm

if TYPE_CHECKING:
    import numpy as np

    from ...core.alignment.placed_axes import PlacedAxes
    from ...core.clouds.points import Request
    from ...core.rails import RailNetwork
    from ...core.report import Origin


MEASURED = ("QUALITY", "FINDINGS", "REPORT")
"""Outputs for which the geometry of tracks is measured."""


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    cloud: CloudSource
    class_codes: tuple[int, ...]
    standard: RailStandard
    other_gauges: tuple[Gauge, ...]
    command: str
    weights: Path | None
    seeds: tuple[np.ndarray, ...]
    axes: PlacedAxes | None


class ExtractRails(RailAlgorithm):
    """The algorithm ``railextract:extractrails``."""

    JOB = JOB

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        names = [output.name() for output in self.destinationParameterDefinitions()]
        if not any(map(values.wanted, names)):
            raise ParameterError(f"No output is chosen: name at least one of {', '.join(names)}.")
        classify, grow = values.flag("CLASSIFY"), values.filled("SEEDS")
        if classify and grow:
            raise ParameterError("CLASSIFY finds all rails, and SEEDS those that are pointed at: choose one of them.")
        if grow and values.detects():
            raise ParameterError("STANDARD DETECT measures classified points, which SEEDS do not need: choose another.")
        if values.choice("METHOD") == LEARNED and not classify:
            raise ParameterError("METHOD LEARNED is for raw clouds: set CLASSIFY, or set METHOD to GEOMETRY.")
        weights = values.weights()
        standard = values.standard(DEFAULT if values.detects() else None)
        choose_model(standard.gauge_m, standard.head_width_m, values.choice("MODEL"))
        cloud = values.cloud("INPUT")
        return Job(
            cloud,
            SEARCHED_CLASSES if classify or grow else values.class_codes(),
            standard,
            values.other_gauges(standard),
            values.command,
            weights,
            tuple(values.seeds(checked_crs(cloud))) if grow else (),
            self._axes(cloud, values),
        )

    def _axes(self, cloud: CloudSource, values: ParameterValues) -> PlacedAxes | None:
        """Read the axes in the coordinate system of the cloud; None without any."""
        if not values.has_axis():
            return None
        if not any(map(values.wanted, MEASURED)):
            raise ParameterError("AXIS gives QUALITY, FINDINGS and REPORT kilometres: name at least one of these.")
        return values.axes(checked_crs(cloud))

    def _detected(self, job: Job, request: Request, values: ParameterValues, progress: Progress) -> Job:
        """Return the job with the rail standard that fits the points."""
        from ...core.checks.standard import detect_in_raw, detect_standard

        progress.status("Measuring gauge and railheads")
        detect = detect_in_raw if values.flag("CLASSIFY") else detect_standard
        standard = values.standard(detect(request, progress.span(0, 0)).name)
        choose_model(standard.gauge_m, standard.head_width_m, values.choice("MODEL"))
        return replace(job, standard=standard, other_gauges=values.other_gauges(standard))

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Extract the rails and tracks, then write the outputs."""
        from ...core.pipeline import extract_files
        from ...core.report import Origin, summary

        progress = Estimating(progress)
        request = request_points(job.cloud, job.class_codes, values.extent, progress)
        classify = values.flag("CLASSIFY")
        request = replace(request, merged=values.flag("MERGE_CLASSES") and not classify and not job.seeds)
        if values.detects():
            job = self._detected(job, request, values, progress)
        settings = replace(
            values.settings(job.standard, job.other_gauges),
            quality_step_m=values.number("STEP") if any(map(values.wanted, MEASURED)) else None,
            keep_cleaned=values.wanted("CLEANED"),
        )
        with points_folder() as folder, values.runner() as runner:
            network = extract_files(request, folder, settings, runner, progress, classify, job.weights, job.seeds)
        progress.check()
        if job.axes:
            network = replace(network, geometry=job.axes.along(network.geometry, network.frame, progress))
        for failure in network.failures:
            progress.warning(failure)
        origin = Origin(job.cloud.paths, job.standard, job.other_gauges, job.command, settings)
        self.remember(properties_of(job.cloud, job.class_codes, job.standard.head_width_m, network.frame))
        for sentence in summary(network, origin.gauges_m):
            progress.info(sentence)
        written = self._write(job, network, origin, values)
        figures = {**figures_of(network.rails, "RAIL"), **figures_of(network.centerlines, "CENTERLINE")}
        measured = figures_of_stations(network.geometry) if settings.quality_step_m else {}
        return {**written, **figures, **measured, "ENGINE_USED": network.engine}

    def _write(self, job: Job, network: RailNetwork, origin: Origin, values: ParameterValues) -> dict[str, str]:
        """Write all outputs."""
        from ...core.output.layers import network_makers

        makers = {name.upper(): make for name, make in network_makers(network, origin.gauges_m).items()}
        writers = {
            "CLEANED": lambda: self._write_cleaned(job, network, values),
            **layer_writers(values, makers, network.frame),
            "REPORT": lambda: write_report(values, network, origin),
        }
        return write_each(writers, values)

    def _write_cleaned(self, job: Job, network: RailNetwork, values: ParameterValues) -> dict[str, str]:
        """Write the network's output as Clean Rail Raster does; no file if no rail cell is left."""
        from ...core.output.raster_file import header_for, on_one_grid

        if not any(raster.tiles for raster in network.cleaned):
            return {}
        rasters, frame = on_one_grid(network.cleaned, network.frame)
        extent, model = values.extent(network.frame.crs_wkt), values.choice("MODEL")
        header = header_for(rasters, network.cleaned_classes, frame, job.standard, extent, model)
        return write_raster(values, "CLEANED", header, rasters)
