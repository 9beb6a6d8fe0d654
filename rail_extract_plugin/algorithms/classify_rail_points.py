"""Classify Rail Points: finds the points on railheads in a raw cloud and writes a classified copy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.progress import Estimating, Progress
from ...core.standards import SEARCHED_CLASSES, Gauge, RailStandard
from ..dialog import inputs, outputs
from ..dialog import parameters as groups
from ..dialog.definitions import Definitions
from ..dialog.parameter_values import ParameterValues
from ..reading.clouds import CloudSource, points_folder, request_points
from .base import CLOUD_WORDS, RAIL_WORDS, RailAlgorithm
from .toolbox_groups import RAW_CLOUDS

if TYPE_CHECKING:
    import numpy as np

    from ...core.rails import SearchFigures


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    cloud: CloudSource
    standard: RailStandard
    other_gauges: tuple[Gauge, ...]
    class_code: int
    output: Path
    guide: tuple[np.ndarray, ...]
    weights: Path | None


class ClassifyRailPoints(RailAlgorithm):
    """The algorithm ``railextract:classifyrailpoints``."""

    NAME = "classifyrailpoints"
    LABEL = "Classify rail points"
    GROUP = RAW_CLOUDS
    TAGS = (*RAIL_WORDS, *CLOUD_WORDS, "classification", "raw", "segmentation", "Klassifizierung")
    PICTURE = "gauge.svg"
    NEEDS = (("numpy",), ("scipy",), ("laspy",), ("lazrs",), ("pyproj",))
    SUMMARY = "Finds the points on railheads in a lidar cloud that nobody has classified, and writes a classified copy."
    HELP = (
        "Rails are found by their shape: no classes of the ground, no trajectory and no training are needed. A "
        "classifier that you have trained can be used instead. Noise and withheld points are left "
        "out of the search.\n\n"
        "The copy has the same points in the same order with the same attributes; only classes differ. Where the "
        "input is a folder or a virtual point cloud, a folder of the same tiles is written, with a virtual point "
        "cloud (.vpc) of the same name next to it.\n\n"
        "The log states how many metres of rail were found with and without a partner. Below 10 cells with points "
        "per metre of rail, lines are less accurate and may have gaps. The method was tested on simulated clouds only."
    )

    def definitions(self) -> Definitions:
        """Return the parameters and outputs in the order of the interface."""
        return (
            inputs.raw_cloud(),
            *groups.rail(),
            groups.other_gauges(),
            *groups.area(),
            inputs.guide(),
            *groups.guide(),
            *groups.method(),
            *groups.labels(),
            groups.workers(),
            outputs.classified(),
            *outputs.classified_figures(),
        )

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        from ...core.labelling.files import plan_output

        standard = values.standard()
        output = Path(values.output_file("OUTPUT"))
        cloud = values.cloud("INPUT")
        job = Job(
            cloud,
            standard,
            values.other_gauges(standard),
            int(values.number("RAIL_CLASS")),
            output,
            values.guide(cloud),
            values.weights(),
        )
        plan_output(job.cloud.paths, output, job.class_code)
        return job

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Classify the cloud and write the copy."""
        from ...core.checks.standard import warn_of_raw
        from ...core.classify.settings import Settings
        from ...core.labelling.files import Choice, classify_files, plan_output
        from ...core.labelling.finding import guide_of

        progress = Estimating(progress)
        gauges_m = (job.standard.gauge_m, *(gauge_m for gauge_m, _ in job.other_gauges))
        choice = Choice(job.class_code, values.rails_only(), values.flag("RESET"))
        output = plan_output(job.cloud.paths, job.output, job.class_code, progress)
        request = request_points(job.cloud, SEARCHED_CLASSES, values.extent, progress)
        guide = None
        if job.guide:
            guide = guide_of(request, job.guide, values.number("GUIDE_DISTANCE"), values.flag("ONLY_GUIDED"))
        settings = Settings(gauges_m, job.standard.head_width_m, values.flag("KEEP_SINGLE"), guide, job.weights)
        with points_folder() as folder, values.runner() as runner:
            result = classify_files(request, settings, choice, output, folder, runner, progress)
        warn_of_raw(request, result.figures, values.settings(job.standard, job.other_gauges), progress)
        return classified_results(result.file, result.point_count, result.figures)


def classified_results(file: Path, point_count: int, figures: SearchFigures) -> dict[str, Any]:
    """Return the results of an algorithm that writes a classified copy."""
    return {
        "OUTPUT": str(file),
        "POINT_COUNT": point_count,
        "RAIL_POINTS": figures.points,
        "PAIRED_LENGTH": figures.paired_m,
        "SINGLE_LENGTH": figures.single_m,
        "CELLS_PER_M": figures.cells_per_m,
    }
