"""Measure Track Geometry: gauge, cant, twist, radius and gradient by chainage, with their accuracy and support."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from qgis.core import QgsProcessingContext

from ...core.fields import QUALITY_FIELDS
from ...core.progress import Progress
from ..dialog import inputs, outputs
from ..dialog import parameters as groups
from ..dialog.parameter_values import ParameterValues
from ..reading.clouds import CloudSource, points_folder
from ..writing.layers import figures_of_stations, write_stations
from .base import RAIL_WORDS, TRACK_WORDS, RailAlgorithm

READING, MEASURING = 0.3, 0.9
"""Fractions of the progress bar at which lines and cloud are read, and at which the rails are measured."""


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    head_width_m: float
    cloud: CloudSource | None


class MeasureTrackGeometry(RailAlgorithm):
    """The algorithm ``railextract:measuretrackgeometry``."""

    NAME = "measuretrackgeometry"
    LABEL = "Measure track geometry"
    TAGS = (*RAIL_WORDS, *TRACK_WORDS, "twist", "radius", "curvature", "gradient", "quality", "chainage")
    NEEDS = (("numpy",), ("scipy",), ("laspy",), ("lazrs",), ("pyproj",))
    SUMMARY = "Measures gauge, cant, twist, radius and gradient along tracks, and their support by points."
    PICTURE = "gauge.svg"
    HELP = "\n\n".join(
        (
            "Takes the lines of Extract Rails, or lines drawn by hand, and returns points along each centerline.",
            "\n".join(f"{field.name}: {field.meaning}." for field in QUALITY_FIELDS),
            "With a point cloud, heights are measured again and smoothed over 1 m only, and sigma_mm, points and "
            "bridged apply to each station. Without one, the heights are those of the rails, each rail's sigma_mm and "
            "points are taken as uniform along it, and bridged is 1 only where a rail is missing.",
        )
    )

    def initAlgorithm(self, config: dict[str, Any] | None = None) -> None:
        """Declare the parameters and outputs in the order of the interface."""
        layers = (inputs.centerlines(), inputs.rails_of_tracks(), inputs.points_of_rails())
        for definition in (*layers, groups.step(), *groups.head(), outputs.quality()):
            self.addParameter(definition)
        for output in outputs.quality_figures():
            self.addOutput(output)

    def read(self, parameters: dict[str, Any], context: QgsProcessingContext) -> Job:
        """Read and check the parameters, in the main thread."""
        values = ParameterValues(self, parameters, context)
        for name in ("INPUT", "RAILS"):
            values.lines(name)
        return Job(values.head_width_m(), values.cloud("POINTS") if values.filled("POINTS") else None)

    def compute(
        self, job: Job, parameters: dict[str, Any], context: QgsProcessingContext, progress: Progress
    ) -> dict[str, Any]:
        """Measure each track, then write the points."""
        from ...core.squares.remeasuring import measure_rails
        from ...core.tasks import InTurn
        from ...core.tracks.geometry import measure_track_geometry
        from ..reading.track_inputs import check_gauges, read_inputs

        values = ParameterValues(self, parameters, context)
        lines = values.lines("INPUT"), values.lines("RAILS")
        with points_folder() as folder:
            tracks = read_inputs(*lines, job.cloud, folder, progress.span(0, READING))
            measuring = progress.span(READING, MEASURING)
            rails = measure_rails(tracks.rails, tracks.clouds, job.head_width_m, InTurn(), measuring)
        share = progress.span(MEASURING, 1)
        measured = measure_track_geometry(tracks.centerlines, rails, job.head_width_m, values.number("STEP"), share)
        check_gauges(tracks, measured, progress)
        progress.check()
        written = write_stations(self, "OUTPUT", measured, tracks.frame, parameters, context)
        return {**written, **figures_of_stations(measured)}
