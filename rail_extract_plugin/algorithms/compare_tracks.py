"""Compare Tracks: lines of two surveys, or of a survey and a design, metre by metre."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

from qgis.core import QgsProcessingFeatureSource

from ...core.errors import ParameterError
from ...core.fields import DIFFERENCE_FIELDS
from ...core.progress import Progress
from ..dialog import inputs, outputs
from ..dialog import parameters as groups
from ..dialog.definitions import Definitions
from ..dialog.parameter_values import ParameterValues
from ..writing.layers import write_layer
from ..writing.reports import write_shown
from ..writing.whole_files import write_each
from .base import RAIL_WORDS, TRACK_WORDS, RailAlgorithm
from .toolbox_groups import ALIGNMENT

if TYPE_CHECKING:
    from ...core.comparison.tracks import TrackComparison

READING, COMPARING = 0.3, 0.9
"""Fractions of the progress bar at which the lines are read, and at which they are compared."""

SURVEYS = {"REFERENCE": ("REFERENCE_RAILS", "REFERENCE_SIGMA"), "INPUT": ("RAILS", "INPUT_SIGMA")}
"""Rails and standard error of each survey, by its lines."""


@dataclass(frozen=True)
class Job:
    """The layers of both surveys by the name of their parameter, and the command that repeats the run."""

    sources: dict[str, QgsProcessingFeatureSource]
    command: str


class CompareTracks(RailAlgorithm):
    """The algorithm ``railextract:comparetracks``."""

    NAME = "comparetracks"
    LABEL = "Compare tracks"
    GROUP = ALIGNMENT
    TAGS = (
        *RAIL_WORDS,
        *TRACK_WORDS,
        "compare",
        "difference",
        "deviation",
        "movement",
        "monitoring",
        "design",
        "control",
    )
    NEEDS = (("numpy",), ("scipy",), ("pyproj",))
    SUMMARY = (
        "Compares the lines of two surveys, or of a survey and a design, metre by metre: what has moved, and where."
    )
    PICTURE = "comparison.svg"
    GUIDE = "comparison"
    FIELDS = DIFFERENCE_FIELDS
    PAGES = ("comparison", "reference")
    HELP = "\n\n".join(
        (
            "The reference is the earlier survey, the design, or a control measurement. Its lines are rails or "
            "centerlines; the same kind of lines is compared with it. Between rails, gauge and cant are compared as "
            "well; for centerlines, give the rails of both surveys.",
            "Standard errors come from the fields sigma_mm and sigmaz_mm of the lines, else from the advanced "
            "parameters. Where neither states one, the scatter of the differences stands for it, and the run says so.",
            "A constant shift between the surveys, as from two positions of a base station, is estimated so that it "
            "is the same for most of the length, and stated apart.",
        )
    )

    def definitions(self) -> Definitions:
        """Return the parameters and outputs in the order of the interface."""
        return (
            *inputs.surveys(),
            *groups.comparison(),
            outputs.differences(),
            outputs.comparison_report(),
            *outputs.comparison_figures(),
        )

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        rails = [name for name, _ in SURVEYS.values() if values.filled(name)]
        if len(rails) == 1:
            other = next(name for name, _ in SURVEYS.values() if name not in rails)
            raise ParameterError(f"Gauge and cant are compared between the rails of both surveys: choose {other}, too.")
        return Job(
            {name: values.lines(name) for name in (*SURVEYS, *rails)},
            values.command(),
        )

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Compare the lines, then write points and report."""
        from ...core.comparison.tracks import compare_surveys, doubts_of
        from ...core.output.layers import differences_layer
        from ...core.parameters import ComparisonParameters
        from ...core.report.comparison import build_comparison, describe_shift, verdict_on
        from ..reading.surveys import read_surveys

        stated = {name: values.optional_number(sigma) for name, (_, sigma) in SURVEYS.items()}
        surveys = read_surveys(job.sources, SURVEYS, stated, progress.span(0, READING))
        ignored = values.flag("IGNORE_SHIFT")
        settings = ComparisonParameters(values.number("REACH"), values.number("STEP"), ignored)
        found = compare_surveys(surveys.reference, surveys.other, settings, progress.span(READING, COMPARING))
        progress.check()
        for sentence in (verdict_on(found), describe_shift(found)):
            progress.info(sentence)
        for sentence in doubts_of(found):
            progress.warning(sentence)
        source = " against ".join(job.sources[name].sourceName() for name in ("INPUT", "REFERENCE"))
        facts = {"Date": f"{datetime.now():%Y-%m-%d %H:%M}", "Command": job.command}
        writers = {
            "OUTPUT": lambda: write_layer(values, "OUTPUT", differences_layer(found), surveys.frame),
            "REPORT": lambda: write_shown(values, lambda: build_comparison(found, not ignored, source, facts)),
        }
        return {**write_each(writers, values), **_figures(found)}


def _figures(found: TrackComparison) -> dict[str, Any]:
    """Return lengths in metres, and root mean squares and the shift in millimetres, as outputs; None if unknown."""
    import numpy as np

    from ...core.comparison.tracks import BOTH, EXTRA, MISSING

    across, height = (found.values(name) for name in ("across_mm", "height_mm"))
    east, north = 1000 * found.shift.plan_m if len(across) else (np.nan, np.nan)
    numbers = {
        "COMPARED_LENGTH": found.length_of(BOTH),
        "MOVED_LENGTH": found.moved_m,
        "MISSING_LENGTH": found.length_of(MISSING),
        "EXTRA_LENGTH": found.length_of(EXTRA),
        "ACROSS_RMS": np.sqrt(np.mean(across**2)) if len(across) else np.nan,
        "HEIGHT_RMS": np.sqrt(np.mean(height**2)) if len(height) else np.nan,
        "SHIFT_EAST": east,
        "SHIFT_NORTH": north,
        "SHIFT_UP": 1000 * found.shift.up_m,
    }
    return {name: round(float(value), 2) + 0.0 if np.isfinite(value) else None for name, value in numbers.items()}
