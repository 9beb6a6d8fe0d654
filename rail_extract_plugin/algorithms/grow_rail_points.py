"""Grow Rail Points from Seeds: follows rails from places on them and writes a classified copy of the cloud."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.jobs.grow_rail_points import JOB
from ...core.parameters import GrowParameters
from ...core.progress import Estimating, Progress
from ...core.standards import SEARCHED_CLASSES, RailStandard
from ..dialog.parameter_values import ParameterValues
from ..reading.clouds import CloudSource, points_folder, request_points
from ..writing.layers import write_layer
from .base import RailAlgorithm
from .classify_rail_points import classified_results

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    cloud: CloudSource
    standard: RailStandard
    parameters: GrowParameters
    class_code: int
    output: Path
    seeds: tuple[np.ndarray, ...]


class GrowRailPoints(RailAlgorithm):
    """The algorithm ``railextract:growrailpoints``."""

    JOB = JOB

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        from ...core.labelling.files import plan_output

        standard = values.standard()
        output = Path(values.output_file("OUTPUT"))
        cloud = values.cloud("INPUT")
        job = Job(cloud, standard, values.growth(), int(values.number("RAIL_CLASS")), output, values.seeds(cloud))
        plan_output(job.cloud.paths, output, job.class_code)
        return job

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Follow the rails and write the copy."""
        from ...core.grow.settings import GrowSettings
        from ...core.labelling.files import Choice, plan_output
        from ...core.labelling.growing import grow_files
        from ...core.output.layers import stops_layer
        from ...core.tasks import InTurn

        progress = Estimating(progress)
        choice = Choice(job.class_code, values.rails_only(), reset=False)
        output = plan_output(job.cloud.paths, job.output, job.class_code, progress)
        request = request_points(job.cloud, SEARCHED_CLASSES, lambda crs: None, progress)
        settings = GrowSettings(job.standard.gauge_m, job.standard.head_width_m, job.parameters)
        with points_folder() as folder:
            grown = grow_files(request, job.seeds, settings, choice, output, folder, InTurn(), progress)
        results = classified_results(grown.file, grown.point_count, grown.figures)
        return {**results, **write_layer(values, "STOPS", stops_layer(grown.stops), request.zero)}
