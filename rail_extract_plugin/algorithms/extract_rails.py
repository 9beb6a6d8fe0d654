"""Extract Rails: the whole walk from a classified cloud to 3D rails and track centerlines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from qgis.core import (
    QgsProcessing,
    QgsProcessingContext,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterFeatureSink,
)

from ...core.frpdf.zoo import choose as choose_model
from ...core.progress import Progress
from ...core.standards import RailStandard
from .. import parameters as groups
from ..clouds import CloudSource, read_points
from ..i18n import tr
from ..layers import CENTERLINES, RAILS, figures_of, write_lines
from ..values import Values
from .base import RailAlgorithm

READING = 0.2
"""Share of the progress bar for reading the cloud."""


@dataclass(frozen=True)
class Job:
    """What the parameters say."""

    cloud: CloudSource
    class_codes: tuple[int, ...]
    standard: RailStandard
    other_gauges_m: tuple[float, ...]


class ExtractRails(RailAlgorithm):
    """The algorithm ``railextract:extractrails``."""

    NAME = "extractrails"
    LABEL = "Extract rails"
    TAGS = ("lidar", "las", "laz", "point cloud", "railway", "rail", "track", "centerline", "vectorize")
    NEEDS = (("numpy",), ("scipy",), ("laspy",), ("lazrs",), ("pyproj",), ("cv2", "torch"))
    SUMMARY = "Turns lidar points classified as rail into the 3D lines of the railheads and of the track centerlines."
    HELP = (
        "A rail line is the top of the railhead on the head's own axis. The gauge in the results is the distance in "
        "space between the two rail lines less the railhead width; it is not measured 14 mm below the top.\n\n"
        "Choose the rail standard, or fill gauge and railhead width. Results have the coordinate system of the cloud, "
        "which must be a projected one. Left and right are seen along the line, and cant is left minus right."
    )

    def initAlgorithm(self, config: dict[str, Any] | None = None) -> None:
        """Declare the parameters and outputs of the interface, in its order."""
        for definition in (
            *groups.cloud(),
            *groups.rail(),
            *groups.area(),
            *groups.cleanup(),
            *groups.lines(),
            *groups.pairing(),
        ):
            self.addParameter(definition)
        line = QgsProcessing.SourceType.TypeVectorLine
        self.addParameter(QgsProcessingParameterFeatureSink("RAILS", tr("Rails"), line, optional=True))
        self.addParameter(
            QgsProcessingParameterFeatureSink("CENTERLINES", tr("Track centerlines"), line, optional=True)
        )
        self.addOutput(QgsProcessingOutputNumber("RAIL_COUNT", tr("Number of rails")))
        self.addOutput(QgsProcessingOutputNumber("RAIL_LENGTH", tr("Length of the rails [m]")))
        self.addOutput(QgsProcessingOutputNumber("CENTERLINE_COUNT", tr("Number of track centerlines")))
        self.addOutput(QgsProcessingOutputNumber("CENTERLINE_LENGTH", tr("Length of the track centerlines [m]")))
        self.addOutput(QgsProcessingOutputString("ENGINE_USED", tr("Engine that ran the network")))

    def read(self, parameters: dict[str, Any], context: QgsProcessingContext) -> Job:
        """Read what has to be read in the main thread, and check it all."""
        values = Values(self, parameters, context)
        standard = values.standard()
        choose_model(standard.gauge_m, standard.head_width_m)
        return Job(values.cloud("INPUT"), values.class_codes(), standard, values.other_gauges_m(standard))

    def compute(
        self, job: Job, parameters: dict[str, Any], context: QgsProcessingContext, progress: Progress
    ) -> dict[str, Any]:
        """Extract everything, then write it."""
        from ...core.pipeline import extract_rails

        values = Values(self, parameters, context)
        clouds = read_points(job.cloud, job.class_codes, values.extent, progress.span(0, READING))
        settings = values.settings(job.standard, job.other_gauges_m)
        network = extract_rails(clouds, settings, progress.span(READING, 1))
        progress.check()
        written = {
            **write_lines(self, "RAILS", RAILS, network.rails, network.frame, parameters, context),
            **write_lines(self, "CENTERLINES", CENTERLINES, network.centerlines, network.frame, parameters, context),
        }
        figures = {**figures_of(network.rails, "RAIL"), **figures_of(network.centerlines, "CENTERLINE")}
        return {**written, **figures, "ENGINE_USED": network.engine}
