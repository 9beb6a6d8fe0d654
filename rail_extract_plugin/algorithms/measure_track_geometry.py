"""Measure Track Geometry: gauge, cant, twist, radius and gradient by chainage, with their accuracy and support."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.jobs.clouds import CloudSource
from ...core.jobs.measure_track_geometry import JOB
from ...core.parameters import Parameters
from ...core.progress import Progress, Recording
from ...core.standards import CUSTOM, Gauge, RailStandard, resolve
from ..dialog.parameter_values import ParameterValues
from ..reading.clouds import points_folder
from ..writing.layers import figures_of_stations, layer_writers
from ..writing.reports import write_report
from ..writing.run import properties_of
from ..writing.whole_files import write_each
from .base import RailAlgorithm

if TYPE_CHECKING:
    from ...core.alignment.placed_axes import PlacedAxes
    from ...core.rails import TrackGeometry

READING, MEASURING = 0.3, 0.9
"""Fractions of the progress bar at which lines and cloud are read, and at which the rails are measured."""


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    head_width_m: float
    standard: RailStandard | None
    """None if no gauge is stated."""
    other_gauges: tuple[Gauge, ...]
    cloud: CloudSource | None
    command: str
    axes: PlacedAxes | None

    @property
    def gauges(self) -> tuple[Gauge, ...]:
        """Gauges that tracks may have; the first one is that of the standard, 0 if none is stated."""
        return ((self.standard.gauge_m if self.standard else 0.0, self.head_width_m), *self.other_gauges)


class MeasureTrackGeometry(RailAlgorithm):
    """The algorithm ``railextract:measuretrackgeometry``."""

    JOB = JOB

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        for name in ("INPUT", "RAILS"):
            values.lines(name)
        head_width_m = values.head_width_m()
        gauge_mm, head_width_mm = values.optional_number("GAUGE"), values.optional_number("HEAD_WIDTH")
        unstated = gauge_mm is None and values.choice("STANDARD") == CUSTOM
        standard = None if unstated else resolve(values.choice("STANDARD"), gauge_mm, head_width_mm)
        return Job(
            head_width_m,
            standard,
            values.other_gauges(standard) if standard else (),
            values.cloud("POINTS") if values.filled("POINTS") else None,
            values.command,
            values.axes(values.lines("INPUT").sourceCrs()) if values.has_axis() else None,
        )

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Measure each track, then write the points."""
        from ...core.output.layers import network_makers
        from ...core.rails import RailNetwork
        from ...core.report import Origin, summary
        from ...core.squares.remeasuring import measure_rails
        from ...core.tracks.geometry import measure_track_geometry
        from ...core.tracks.parallels import widths_by_gauge
        from ..reading.track_inputs import check_gauges, read_inputs, with_measured_gauge

        progress = Recording(progress)
        lines = values.lines("INPUT"), values.lines("RAILS")
        with points_folder() as folder, values.runner() as runner:
            tracks = read_inputs(*lines, job.cloud, folder, progress.span(0, READING))
            measuring = progress.span(READING, MEASURING)
            heads_m = widths_by_gauge(tracks.rails, job.gauges, Parameters.centerline_tolerance_m)
            rails = measure_rails(tracks.rails, tracks.clouds, heads_m, runner, measuring)
        share = progress.span(MEASURING, 1)
        step_m = values.number("STEP")
        measured = measure_track_geometry(tracks.centerlines, rails, job.head_width_m, step_m, share, job.gauges)
        check_gauges(tracks, measured, progress)
        progress.check()
        frame = tracks.frame
        if job.axes:
            measured = job.axes.along(measured, frame, progress)
        if job.cloud:
            codes = tuple(cloud.class_code for cloud in tracks.clouds)
            self.layer_properties = properties_of(job.cloud, codes, job.head_width_m, frame)
        centerlines = with_measured_gauge(tracks.centerlines, measured)
        network = RailNetwork(tuple(rails), centerlines, frame, geometry=measured, warnings=progress.warnings)
        paths = job.cloud.paths if job.cloud else (Path(lines[0].sourceName()),)
        origin = Origin(paths, job.standard or _own_standard(measured, job), job.other_gauges, job.command)
        for sentence in summary(network, origin.gauges_m):
            progress.info(sentence)
        made = network_makers(network, origin.gauges_m)
        writers = {
            **layer_writers(values, {"OUTPUT": made["quality"], "FINDINGS": made["findings"]}, frame),
            "REPORT": lambda: write_report(values, network, origin),
        }
        return {**write_each(writers, values), **figures_of_stations(measured)}


def _own_standard(measured: Sequence[TrackGeometry], job: Job) -> RailStandard:
    """Return a standard with the median gauge of the tracks where no gauge is stated."""
    import numpy as np

    gauge_mm = round(float(np.nanmedian(np.concatenate([track.gauge_mm for track in measured]))))
    label = f"{1000 * job.head_width_m:g} mm head, {gauge_mm} mm as measured"
    return RailStandard(CUSTOM, label, gauge_mm / 1000, job.head_width_m)
