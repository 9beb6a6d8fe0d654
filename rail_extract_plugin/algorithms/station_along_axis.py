"""Station Along Axis: kilometre, offset and side of the features of any layer, from the axis of the railway."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingFeatureSource,
    QgsProcessingUtils,
    QgsWkbTypes,
)

from ...core.errors import RailExtractError
from ...core.jobs.station_along_axis import JOB
from ...core.progress import Progress
from ..dialog.parameter_values import ParameterValues
from ..systems import prepare_system
from ..writing.layers import copies, fields, write_copy
from .base import RailAlgorithm

if TYPE_CHECKING:
    from ...core.kilometres.axes import PlacedAxes

LOCATING = 0.9
"""Fraction of the progress bar at which the kilometres are known."""


@dataclass(frozen=True)
class Job:
    """The layer, and the axes in the plane in which kilometres are measured."""

    source: QgsProcessingFeatureSource
    plane: QgsCoordinateReferenceSystem
    axes: PlacedAxes


class StationAlongAxis(RailAlgorithm):
    """The algorithm ``railextract:stationalongaxis``."""

    JOB = JOB

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        from ..reading.axes import plane_of
        from ..reading.line_layers import wkt_of

        source = values.table("INPUT")
        if QgsWkbTypes.geometryType(source.wkbType()) == QgsWkbTypes.GeometryType.NullGeometry:
            raise RailExtractError("INPUT is a table without places: give a layer of points, lines or polygons.")
        prepare_system(wkt_of(source.sourceCrs()) or None)
        plane = plane_of(values.axis_crs(), source.sourceCrs())
        return Job(source, plane, values.axes(wkt_of(plane) or None))

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Locate the features, then write them with their kilometres."""
        from ..reading.places import kept_fields, locate_features, station_fields

        located = locate_features(job.source, job.axes, job.plane, values.context, progress.span(0, LOCATING))
        added = fields(station_fields(job.source))
        columns = QgsProcessingUtils.combineFields(kept_fields(job.source, progress), added)
        made = copies(located.features, columns, located.rows())
        shape, crs = job.source.wkbType(), job.source.sourceCrs()
        written = write_copy(values, "OUTPUT", columns, shape, made, crs)
        return {**written, **located.figures()}
