"""Build Track Centerlines: pairs rails to tracks and draws the line midway between the two rails of each track."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from qgis.core import QgsProcessingContext

from ...core.progress import Progress
from ...core.standards import Gauge, RailStandard
from ..dialog import inputs, outputs
from ..dialog import parameters as groups
from ..dialog.parameter_values import ParameterValues
from ..writing.destinations import is_wanted
from ..writing.layers import figures_of, write_layer
from .base import RAIL_WORDS, TRACK_WORDS, RailAlgorithm
from .toolbox_groups import STEPS

READING = 0.1
"""Fraction of the progress bar for reading the lines."""


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    standard: RailStandard
    other_gauges: tuple[Gauge, ...]


class BuildTrackCenterlines(RailAlgorithm):
    """The algorithm ``railextract:buildtrackcenterlines``."""

    NAME = "buildtrackcenterlines"
    LABEL = "Build track centerlines"
    GROUP = STEPS
    TAGS = (*RAIL_WORDS, *TRACK_WORDS, "centerline", "centreline", "axis")
    NEEDS = (("numpy",), ("scipy",), ("pyproj",))
    SUMMARY = "Pairs rails that are one gauge apart and draws the line midway between the two rails of each track."
    PICTURE = "gauge.svg"
    HELP = (
        "Takes the lines of Vectorize Rails, or rails drawn by hand: lines in any direction, also curved and "
        "multi-part ones. The fields rail_id and class_code are used if they exist. Both rails of a track have the "
        "same class.\n\n"
        "For mixed and dual gauge, fill in Other gauges: on track with three rails, the common rail belongs to both "
        "tracks. Lines without heights give centerlines without heights.\n\n"
        "RAILS, if asked for, has the rails again, with the tracks of each in track_ids. Lone lines that are too high "
        "or too low for a rail, compared with the tracks alongside, are left out of it."
    )

    def initAlgorithm(self, config: dict[str, Any] | None = None) -> None:
        """Declare the parameters and outputs in the order of the interface."""
        for definition in (
            inputs.rails(),
            *groups.rail(),
            *groups.pairing(),
            groups.max_gap(),
            groups.smoothing_xy(),
            *groups.simplification(),
            groups.min_length(),
        ):
            self.addParameter(definition)
        self.addParameter(outputs.centerlines())
        paired = outputs.rails("RAILS", optional=True)
        paired.setCreateByDefault(False)
        self.addParameter(paired)
        for output in outputs.centerline_figures():
            self.addOutput(output)

    def read(self, parameters: dict[str, Any], context: QgsProcessingContext) -> Job:
        """Read and check the parameters, in the main thread."""
        values = ParameterValues(self, parameters, context)
        standard = values.standard()
        values.lines("INPUT")
        return Job(standard, values.other_gauges(standard))

    def compute(
        self, job: Job, parameters: dict[str, Any], context: QgsProcessingContext, progress: Progress
    ) -> dict[str, Any]:
        """Pair the rails of each class, then write the centerlines."""
        from ...core.checks.lines import with_tracks
        from ...core.fields import CENTERLINES, RAILS
        from ...core.output.layers import lines_layer
        from ...core.tracks.centerlines import tracks_of
        from ..reading.line_layers import read_rails

        values = ParameterValues(self, parameters, context)
        rails, frame = read_rails(values.lines("INPUT"), progress.span(0, READING))
        settings = values.settings(job.standard, job.other_gauges)
        tracks = tracks_of(rails, settings, progress.span(READING, 1))
        progress.check()
        rest = (frame, parameters, context)
        written = write_layer(self, "OUTPUT", lines_layer(CENTERLINES, tracks), *rest)
        if is_wanted(parameters.get("RAILS"), context):
            paired = with_tracks(rails, tracks, progress)
            written.update(write_layer(self, "RAILS", lines_layer(RAILS, paired), *rest))
        return {**written, **figures_of(tracks, "CENTERLINE")}
