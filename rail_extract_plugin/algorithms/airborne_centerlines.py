"""Track Centerlines from Airborne Lidar: fits the track of each guide in a cloud that shows no single railheads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...core.errors import ParameterError
from ...core.fields import AIRBORNE, PROPOSED
from ...core.parameters import AirborneParameters
from ...core.progress import Estimating, Progress
from ...core.standards import SEARCHED_CLASSES, RailStandard
from ..dialog import inputs, outputs
from ..dialog import parameters as groups
from ..dialog.definitions import Definitions
from ..dialog.parameter_values import ParameterValues, class_numbers
from ..reading.clouds import CloudSource, points_folder, request_points
from ..writing.layers import figures_of, layer_writers, write_layer
from ..writing.reports import write_shown
from ..writing.run import properties_of
from ..writing.whole_files import write_each
from .base import CLOUD_WORDS, RAIL_WORDS, TRACK_WORDS, RailAlgorithm
from .toolbox_groups import RAW_CLOUDS

if TYPE_CHECKING:
    from ...core.airborne.proposals import Proposals
    from ...core.airborne.survey import Guide, Survey


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    cloud: CloudSource
    class_codes: tuple[int, ...]
    standard: RailStandard
    parameters: AirborneParameters
    guides: tuple[Guide, ...]
    command: str


class AirborneCenterlines(RailAlgorithm):
    """The algorithm ``railextract:airbornecenterlines``."""

    NAME = "airbornecenterlines"
    LABEL = "Track centerlines from airborne lidar"
    GROUP = RAW_CLOUDS
    TAGS = (*RAIL_WORDS, *CLOUD_WORDS, *TRACK_WORDS, "airborne", "ALS", "national", "OpenStreetMap", "centerline")
    NEEDS = (("numpy",), ("scipy",), ("laspy",), ("lazrs",), ("pyproj",))
    SUMMARY = "Fits the centerlines of tracks in airborne lidar, along lines that say which tracks are meant."
    PICTURE = "gauge.svg"
    GUIDE = "airborne"
    PAGES = ("airborne", "parameters")
    HELP = (
        "For the clouds of national surveys, with 5 to 100 points per square metre, which show no single railheads; "
        "for mobile lidar, use Extract Rails.\n\n"
        "A line ends where the track is not seen for more than 30 m; the stations state why. The standard error "
        "leaves out that of the flight against its datum, often 3 to 10 cm.\n\n"
        "Without a guide, the whole cloud is searched, in minutes per square kilometre. Correct the guides that are "
        "proposed, and run again with them."
    )

    def definitions(self) -> Definitions:
        """Return the parameters and outputs in the order of the interface."""
        return (
            *inputs.airborne_cloud(),
            inputs.tracks_meant(),
            *groups.rail(),
            *groups.airborne(),
            *groups.area(),
            groups.workers(),
            outputs.airborne_centerlines(),
            outputs.further(outputs.airborne_stations()),
            outputs.further(outputs.findings()),
            outputs.further(outputs.proposed_guides()),
            outputs.report(),
            *outputs.airborne_figures(),
        )

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        standard, cloud, classes = values.standard(), values.cloud("INPUT"), values.text("CLASSES").strip()
        codes = class_numbers(classes, "CLASSES") if classes else SEARCHED_CLASSES
        command = values.command()
        guides = values.tracks_meant(cloud)
        if not guides and not values.wanted("PROPOSED"):
            raise ParameterError("GUIDE is empty: choose lines along the tracks, or PROPOSED to have some proposed.")
        return Job(cloud, codes, standard, values.airborne(standard), guides, command)

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Fit the tracks, or propose guides where there are none, then write the outputs."""
        from ...core.airborne.files import survey_files
        from ...core.airborne.proposals import propose_guides
        from ...core.airborne.run import Run

        progress = Estimating(progress)
        request = request_points(job.cloud, job.class_codes, values.extent, progress)
        with values.runner() as runner, points_folder() as folder:
            run = Run(request, job.parameters, folder / "points", runner, progress)
            found: Any = survey_files(run, job.guides) if job.guides else propose_guides(run)
        progress.check()
        self.remember(properties_of(job.cloud, job.class_codes, job.standard.head_width_m, found.frame))
        write = self._write_survey if job.guides else self._write_proposals
        return write(found, job, values, progress)

    def _write_proposals(
        self, found: Proposals, job: Job, values: ParameterValues, progress: Progress
    ) -> dict[str, Any]:
        """Write the proposed guides."""
        from ...core.output.layers import lines_layer

        progress.info(found.summary)
        guides = lines_layer(PROPOSED, found.guides)
        written = write_layer(values, "PROPOSED", guides, found.frame)
        return {**written, "PROPOSED_LENGTH": found.length_m, "DENSITY": round(found.density, 1)}

    def _write_survey(self, survey: Survey, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Write what was found along the guides."""
        from ...core.output.layers import airborne_stations_layer, findings_layer, lines_layer
        from ...core.report.airborne import airborne_findings, airborne_summary

        for sentence in airborne_summary(survey):
            progress.info(sentence)
        frame = survey.frame
        makers = {
            "CENTERLINES": lambda: lines_layer(AIRBORNE, survey.lines),
            "STATIONS": lambda: airborne_stations_layer(survey.tracks),
            "FINDINGS": lambda: findings_layer(airborne_findings(survey)),
        }
        writers = {
            **layer_writers(values, makers, frame),
            "REPORT": lambda: write_shown(values, lambda: _page(job, survey)),
        }
        written = write_each(writers, values)
        lengths_m = {"GUIDE_LENGTH": survey.guides_m, "SEEN_LENGTH": survey.seen_m, "DENSITY": round(survey.density, 1)}
        return {**written, **figures_of(survey.lines, "CENTERLINE"), **lengths_m}


def _page(job: Job, survey: Survey) -> str:
    """Build the report."""
    from ...core.report.airborne import airborne_page

    return airborne_page(
        survey, job.cloud.paths[0].resolve().name, {"Rail": job.standard.label, "Command": job.command}
    )
