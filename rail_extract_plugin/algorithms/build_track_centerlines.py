"""Build Track Centerlines: pairs rails to tracks and draws the line midway between the two rails of each track."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...core.jobs.build_track_centerlines import JOB
from ...core.jobs.shared import figures_of
from ...core.progress import Progress
from ...core.standards import Gauge, RailStandard
from ..dialog.parameter_values import ParameterValues
from ..writing.layers import write_layer
from .base import RailAlgorithm

READING = 0.1
"""Fraction of the progress bar for reading the lines."""


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    standard: RailStandard
    other_gauges: tuple[Gauge, ...]


class BuildTrackCenterlines(RailAlgorithm):
    """The algorithm ``railextract:buildtrackcenterlines``."""

    JOB = JOB

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        standard = values.standard()
        values.lines("INPUT")
        return Job(standard, values.other_gauges(standard))

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Pair the rails of each class, then write the centerlines."""
        from ...core.checks.lines import with_tracks
        from ...core.fields import CENTERLINES, RAILS
        from ...core.output.layers import lines_layer
        from ...core.tracks.centerlines import tracks_of
        from ..reading.line_layers import read_rails

        rails, frame = read_rails(values.lines("INPUT"), progress.span(0, READING))
        settings = values.settings(job.standard, job.other_gauges)
        tracks = tracks_of(rails, settings, progress.span(READING, 1))
        progress.check()
        written = write_layer(values, "OUTPUT", lines_layer(CENTERLINES, tracks), frame)
        if values.wanted("RAILS"):
            paired = with_tracks(rails, tracks, progress)
            written.update(write_layer(values, "RAILS", lines_layer(RAILS, paired), frame))
        return {**written, **figures_of(tracks, "CENTERLINE")}
