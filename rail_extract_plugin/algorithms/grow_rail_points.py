"""Grow Rail Points from Seeds: follows rails from places on them and writes a classified copy of the cloud."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.parameters import GrowParameters
from ...core.progress import Estimating, Progress
from ...core.standards import SEARCHED_CLASSES, RailStandard
from ..dialog import inputs, outputs
from ..dialog import parameters as groups
from ..dialog.definitions import Definitions
from ..dialog.parameter_values import ParameterValues
from ..reading.clouds import CloudSource, points_folder, request_points
from ..writing.layers import write_layer
from .base import CLOUD_WORDS, RAIL_WORDS, RailAlgorithm
from .classify_rail_points import ClassifyRailPoints, classified_results
from .toolbox_groups import RAW_CLOUDS

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

    NAME = "growrailpoints"
    LABEL = "Grow rail points from seeds"
    GROUP = RAW_CLOUDS
    TAGS = (*RAIL_WORDS, *CLOUD_WORDS, "classification", "raw", "seed", "interactive", "follow", "Klassifizierung")
    PICTURE = "gauge.svg"
    NEEDS = ClassifyRailPoints.NEEDS
    SUMMARY = "Follows rails in a lidar cloud from places that you point at, and classifies their points in a copy."
    HELP = (
        "Each rail is followed to both sides along its head, over crossings and through switches, up to the longest "
        "run. The log states where each rail stops, and why.\n\n"
        "The copy has the same points in the same order with the same attributes; points on these rails get the class "
        "of rail points. Where the input is a folder or a virtual point cloud, a folder of the same tiles is written, "
        "with a virtual point cloud (.vpc) next to it.\n\n"
        "The toolbar button Grow Rails lets you click rails on the map and shows at once what grows. The method was "
        "tested on simulated clouds only."
    )

    def definitions(self) -> Definitions:
        """Return the parameters and outputs in the order of the interface."""
        return (
            inputs.raw_cloud(),
            *inputs.seeds(),
            *groups.rail(),
            *groups.growth(),
            groups.crs(),
            groups.leave_out(),
            *groups.content(),
            outputs.classified(),
            outputs.further(outputs.stops()),
            *outputs.classified_figures(),
        )

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
        from ...core.run.loop import Runner

        progress = Estimating(progress)
        choice = Choice(job.class_code, values.rails_only(), reset=False)
        output = plan_output(job.cloud.paths, job.output, job.class_code, progress)
        request = request_points(job.cloud, SEARCHED_CLASSES, lambda crs: None, progress)
        settings = GrowSettings(job.standard.gauge_m, job.standard.head_width_m, job.parameters)
        with points_folder() as folder:
            grown = grow_files(request, job.seeds, settings, choice, output, folder, Runner(), progress)
        results = classified_results(grown.file, grown.point_count, grown.figures)
        return {**results, **write_layer(values, "STOPS", stops_layer(grown.stops), request.zero)}
