"""Extract Rails: the whole walk from a classified cloud to 3D rails and track centerlines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessing,
    QgsProcessingContext,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterFeatureSink,
    QgsRectangle,
    QgsWkbTypes,
)

from ...core.frpdf.zoo import choose as choose_model
from ...core.progress import Progress
from ...core.standards import RailStandard, resolve
from .. import parameters as groups
from ..clouds import CloudSource, cloud_source
from ..i18n import tr
from ..layers import CENTERLINE_FIELDS, RAIL_FIELDS, add_features, features, fields, output_crs
from ..styling import style_on_load
from .base import RailAlgorithm

if TYPE_CHECKING:
    from ...core.pipeline import Parameters
    from ...core.points import RailPoints
    from ...core.rails import RailNetwork

READING = 0.2
"""Share of the progress bar for reading the cloud."""


@dataclass(frozen=True)
class Job:
    """What the parameters say."""

    cloud: CloudSource
    class_codes: tuple[int, ...]
    standard: RailStandard
    other_gauges_m: tuple[float, ...]
    crs_wkt: str | None


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
        cloud = cloud_source(parameters.get("INPUT"), context)
        crs = self.parameterAsCrs(parameters, "CRS", context)
        standard = resolve(
            self.parameterAsEnumString(parameters, "STANDARD", context),
            self._optional_number(parameters, "GAUGE", context),
            self._optional_number(parameters, "HEAD_WIDTH", context),
        )
        choose_model(standard.gauge_m, standard.head_width_m)
        return Job(
            cloud=cloud,
            class_codes=groups.whole_numbers(
                self.parameterAsString(parameters, "RAIL_CLASSES", context), "RAIL_CLASSES"
            ),
            standard=standard,
            other_gauges_m=groups.gauges_m(self.parameterAsString(parameters, "OTHER_GAUGES", context), "OTHER_GAUGES"),
            crs_wkt=crs.toWkt() if crs.isValid() else cloud.crs_wkt,
        )

    def compute(
        self, job: Job, parameters: dict[str, Any], context: QgsProcessingContext, progress: Progress
    ) -> dict[str, Any]:
        """Extract everything, then write it."""
        from ...core.pipeline import extract_rails

        clouds = self._read_points(job, parameters, context, progress.span(0, READING))
        network = extract_rails(clouds, self._settings(job, parameters, context), progress.span(READING, 1))
        progress.check()
        return {**self._write(network, parameters, context), **_figures(network)}

    def _read_points(
        self, job: Job, parameters: dict[str, Any], context: QgsProcessingContext, progress: Progress
    ) -> tuple[RailPoints, ...]:
        from ...core.points import read_headers, read_rail_points

        crs = QgsCoordinateReferenceSystem(read_headers(job.cloud.paths)[0].crs_wkt or job.crs_wkt or "")
        extent = _bounds(self.parameterAsExtent(parameters, "EXTENT", context, crs))
        return read_rail_points(job.cloud.paths, job.class_codes, job.crs_wkt, extent, progress)

    def _settings(self, job: Job, parameters: dict[str, Any], context: QgsProcessingContext) -> Parameters:
        from ...core.pipeline import Parameters

        def number(name: str) -> float:
            return self.parameterAsDouble(parameters, name, context)

        return Parameters(
            gauge_m=job.standard.gauge_m,
            head_width_m=job.standard.head_width_m,
            passes=self.parameterAsInt(parameters, "ITERATIONS", context),
            engine=self.parameterAsEnumString(parameters, "ENGINE", context),
            device=self.parameterAsEnumString(parameters, "DEVICE", context),
            smoothing_xy_m=number("SMOOTHING_XY"),
            smoothing_z_m=number("SMOOTHING_Z"),
            tolerance_xy_m=number("TOLERANCE_XY"),
            tolerance_z_m=number("TOLERANCE_Z"),
            crown_radius_m=number("CROWN_RADIUS"),
            centerline_tolerance_m=number("CENTERLINE_TOLERANCE"),
            max_gap_m=number("MAX_GAP"),
            gap_angle_deg=number("GAP_ANGLE"),
            simplify_xy_m=number("SIMPLIFY_XY"),
            simplify_z_m=number("SIMPLIFY_Z"),
            min_length_m=number("MIN_LENGTH"),
            other_gauges_m=job.other_gauges_m,
        )

    def _write(self, network: RailNetwork, parameters: dict[str, Any], context: QgsProcessingContext) -> dict[str, str]:
        outputs = (
            ("RAILS", "rails", network.rails, RAIL_FIELDS),
            ("CENTERLINES", "centerlines", network.centerlines, CENTERLINE_FIELDS),
        )
        written = {}
        for name, style, lines, columns in outputs:
            sink, layer_id = self.parameterAsSink(
                parameters,
                name,
                context,
                fields(columns),
                QgsWkbTypes.Type.LineStringZ,
                output_crs(network.frame.crs_wkt),
            )
            if sink is None:
                continue
            add_features(sink, features(lines, columns, network.frame))
            style_on_load(layer_id, style, context)
            written[name] = layer_id
        return written

    def _optional_number(self, parameters: dict[str, Any], name: str, context: QgsProcessingContext) -> float | None:
        empty = parameters.get(name) in (None, "")
        return None if empty else self.parameterAsDouble(parameters, name, context)


def _bounds(extent: QgsRectangle) -> tuple[float, float, float, float] | None:
    if extent.isNull():
        return None
    return extent.xMinimum(), extent.yMinimum(), extent.xMaximum(), extent.yMaximum()


def _figures(network: RailNetwork) -> dict[str, Any]:
    return {
        "RAIL_COUNT": len(network.rails),
        "RAIL_LENGTH": sum(rail.length_m for rail in network.rails),
        "CENTERLINE_COUNT": len(network.centerlines),
        "CENTERLINE_LENGTH": sum(line.length_m for line in network.centerlines),
        "ENGINE_USED": network.engine,
    }
