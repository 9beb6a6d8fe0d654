"""Build Track Centerlines: pairs rails to tracks and draws the line midway between the two rails of each track."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...core.progress import Progress
from ...core.standards import Gauge, RailStandard
from ..dialog import inputs, outputs
from ..dialog import parameters as groups
from ..dialog.definitions import Definitions
from ..dialog.parameter_values import ParameterValues
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

    def definitions(self) -> Definitions:
        """Return the parameters and outputs in the order of the interface."""
        return (
            inputs.rails(),
            *groups.rail(),
            *groups.pairing(),
            groups.max_gap(),
            groups.smoothing_xy(),
            *groups.simplification(),
            groups.min_length(),
            outputs.centerlines(),
            outputs.on_demand(outputs.rails("RAILS", optional=True)),
            *outputs.centerline_figures(),
        )

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
