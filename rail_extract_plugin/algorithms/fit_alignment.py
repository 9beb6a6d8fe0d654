"""Fit Alignment: the design elements of tracks in plan, height and cant, and how far the tracks lie off them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from qgis.core import QgsProcessingFeatureSource

from ...core.parameters import FitParameters
from ...core.progress import Progress, Recording
from ..dialog import inputs, outputs
from ..dialog import parameters as groups
from ..dialog.definitions import Definitions
from ..dialog.parameter_values import ParameterValues
from ..writing.layers import figures_of_fits, layer_writers
from ..writing.reports import write_alignment_report
from ..writing.whole_files import write_each
from .base import RAIL_WORDS, TRACK_WORDS, RailAlgorithm
from .toolbox_groups import ALIGNMENT

READING, FITTING = 0.1, 0.95
"""Fractions of the progress bar at which lines are read, and at which they are fitted."""


@dataclass(frozen=True)
class Job:
    """The layers and the settings."""

    tracks: QgsProcessingFeatureSource
    quality: QgsProcessingFeatureSource | None
    rails: QgsProcessingFeatureSource | None
    fixed: QgsProcessingFeatureSource | None
    settings: FitParameters
    command: str


class FitAlignment(RailAlgorithm):
    """The algorithm ``railextract:fitalignment``."""

    NAME = "fitalignment"
    LABEL = "Fit alignment"
    GROUP = ALIGNMENT
    TAGS = (*RAIL_WORDS, *TRACK_WORDS, "clothoid", "curve", "radius", "horizontal", "vertical", "Trassierung", "tracé")
    NEEDS = (("numpy",), ("scipy",), ("pyproj",))
    SUMMARY = "Finds the straights, clothoids and arcs, grades and cant ramps that tracks were built to."
    PICTURE = "alignment.svg"
    GUIDE = "alignment"
    PAGES = ("alignment", "reference")
    HELP = "\n\n".join(
        (
            "Takes centerlines of Extract Rails or any other 3D lines of tracks. Number, type and ends of the elements "
            "are found, and all elements of a track are fitted at once. Cant is fitted if track geometry or rails "
            "are given.",
            "A fitted design is a proposal, not a record: an element that moves the track less than misalignment does "
            "can't be seen. The fields sigma_r_m, sigma_len_m and sigma_s_m state how well each is known.",
            "To correct it, edit the table, for example r1_m, s_from or type, delete rows, and give it back as FIXED: "
            "types and all values that you changed are held, and the rest is fitted again.",
        )
    )

    def definitions(self) -> Definitions:
        """Return the parameters and outputs in the order of the interface."""
        return (
            inputs.tracks_to_fit(),
            *inputs.cant_of_tracks(),
            *groups.alignment(),
            inputs.fixed(),
            outputs.elements(),
            outputs.further(outputs.deviations()),
            outputs.on_demand(outputs.alignment_report()),
            *outputs.fit_figures(),
        )

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        return Job(
            values.lines("INPUT"),
            values.table("QUALITY") if values.filled("QUALITY") else None,
            values.lines("RAILS") if values.filled("RAILS") else None,
            values.table("FIXED") if values.filled("FIXED") else None,
            FitParameters(
                values.number("TOLERANCE") / 1000.0,
                values.number("MIN_LENGTH"),
                values.choice("TRANSITIONS"),
                values.flag("ROUND"),
            ),
            values.command(),
        )

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Fit each track, then write elements and deviations."""
        from ...core.alignment.fit import fit_tracks
        from ...core.fields import DEVIATIONS
        from ...core.output.layers import elements_layer, stations_layer
        from ..reading.tracks_to_fit import read_fixed, read_tracks

        progress = Recording(progress)
        tracks, frame = read_tracks(job.tracks, job.quality, job.rails, progress.span(0, READING))
        fixed = read_fixed(job.fixed, frame) if job.fixed else {}
        fits = fit_tracks(tracks, frame, job.settings, fixed, progress.span(READING, FITTING))
        alignments, deviations = [one.alignment for one in fits], [one.deviations for one in fits]
        courses = list(zip(alignments, deviations))
        name, facts = job.tracks.sourceName(), {"Command": job.command}
        makers = {
            "ELEMENTS": lambda: elements_layer(alignments, progress),
            "DEVIATIONS": lambda: stations_layer(DEVIATIONS, deviations),
        }
        writers = {
            **layer_writers(values, makers, frame),
            "REPORT": lambda: write_alignment_report(values, courses, name, facts, True, progress.warnings),
        }
        return {**write_each(writers, values), **figures_of_fits(fits)}
