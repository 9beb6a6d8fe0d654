"""Fit Alignment: the design elements of tracks in plan, height and cant, and how far the tracks lie off them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..parameters import TRANSITIONS, FitParameters
from ..progress import Progress
from . import inputs, methods, outputs
from .declaration import (
    ALIGNMENT,
    LINE_NEEDS,
    MM_DECIMALS,
    POINT,
    RAIL_WORDS,
    TABLE,
    TRACK_WORDS,
    Choice,
    Figure,
    Flag,
    LayerInput,
    Number,
)
from .result import Result
from .values import Job, Values

if TYPE_CHECKING:
    from ..alignment.fit import Fit
    from ..alignment.measured import Deviations

MIN_FIT_TOLERANCE_MM, MAX_ELEMENT_M = 0.1, 1000.0
"""No scanner resolves a smaller tolerance, and no element that is left out on purpose is longer."""

DIRECTIONS = {
    "RMS": ("slew_mm", "across"),
    "LIFT_RMS": ("lift_mm", "in height"),
    "CANT_RMS": ("cant_diff_mm", "of cant"),
}
"""Attributes of the deviations by the figures that sum them up, and their directions in words."""


def _run(values: Values, progress: Progress) -> Result:
    """Fit each track."""
    from ..alignment.fit import fit_tracks
    from ..fields import DEVIATIONS
    from ..files.layers import elements_layer, stations_layer
    from ..progress import Recording
    from ..report import build_alignment_page
    from .track_inputs import read_elements, read_tracks

    progress = Recording(progress)
    reading, fitting = progress.after_reading()
    tracks, frame = read_tracks(values, "INPUT", reading)
    held = read_elements(values, "FIXED", frame.crs_wkt) if values.filled("FIXED") else []
    settings = FitParameters(values["TOLERANCE"] / 1000.0, values["MIN_LENGTH"], values["TRANSITIONS"], values["ROUND"])
    fits = fit_tracks(tracks, frame, settings, {one.track_id: one for one in held}, fitting)
    alignments, deviations = [one.alignment for one in fits], [one.deviations for one in fits]
    courses, facts = list(zip(alignments, deviations)), {"Command": values.command}
    return Result(
        _figures(fits),
        frame,
        {
            "ELEMENTS": lambda: elements_layer(alignments, progress),
            "DEVIATIONS": lambda: stations_layer(DEVIATIONS, deviations),
        },
        {"REPORT": lambda: build_alignment_page(courses, values.title("INPUT"), facts, True, progress.warnings)},
        tuple(
            f"Track {one.alignment.track_id}: {len(one.alignment.elements)} elements; root mean square "
            f"{_in_words(one.deviations)}"
            for one in fits
        ),
    )


def _figures(fits: Sequence[Fit]) -> dict[str, Any]:
    """Return the number of elements, and the root mean squares of slews, lifts and differences of cant, millimetres."""
    import numpy as np

    from ..spread import rms

    found = {
        figure: rms(np.concatenate([getattr(fit.deviations, name) for fit in fits]))
        for figure, (name, _) in DIRECTIONS.items()
    }
    rounded = {figure: None if math.isnan(one) else round(one, 3) for figure, one in found.items()}
    return {"ELEMENT_COUNT": sum(len(fit.alignment.elements) for fit in fits), **rounded}


def _in_words(deviations: Deviations) -> str:
    """Return the root mean squares of a track, each with its direction; unknown ones are left out."""
    from ..spread import rms

    found = ((rms(getattr(deviations, name)), where) for name, where in DIRECTIONS.values())
    return ", ".join(f"{one:.2f} mm {where}" for one, where in found if not math.isnan(one))


JOB = Job(
    "fitalignment",
    "Fit alignment",
    "Finds the straights, clothoids and arcs, grades and cant ramps that tracks were built to.",
    "Takes centerlines of Extract Rails or any other 3D lines of tracks. Number, type and ends of the elements "
    "are found, and all elements of a track are fitted at once. Cant is fitted if track geometry or rails "
    "are given.\n\n"
    "A fitted design is a proposal, not a record: an element that moves the track less than misalignment does "
    "can't be seen. The fields sigma_r_m, sigma_len_m and sigma_s_m state how well each is known.\n\n"
    "To correct it, edit the table, for example r1_m, s_from or type, delete rows, and give it back as FIXED: "
    "types and all values that you changed are held, and the rest is fitted again.",
    (*RAIL_WORDS, *TRACK_WORDS, "clothoid", "curve", "radius", "horizontal", "vertical", "Trassierung", "tracé"),
    LINE_NEEDS,
    (
        LayerInput(
            "INPUT",
            "Track centerlines",
            "3D lines of tracks, such as the centerlines of Extract Rails. A field track_id numbers them.",
        ),
        LayerInput(
            "QUALITY",
            "Track geometry",
            "Points of Extract Rails or Measure Track Geometry for these tracks: their cant gives elements, and "
            "sections without rail points do not count.",
            optional=True,
            kinds=(POINT,),
        ),
        inputs.RAILS_OF_CANT,
        Number(
            "TOLERANCE",
            "Tolerance [mm]",
            "How far the track may be off its design. Misalignment up to this standard deviation is told from "
            "design by its length; more is followed by elements.",
            default=1000.0 * FitParameters.tolerance_m,
            low=MIN_FIT_TOLERANCE_MM,
            high=1000.0 * methods.MAX_TOLERANCE_M,
            decimals=MM_DECIMALS,
        ),
        Number(
            "MIN_LENGTH",
            "Shortest element [m]",
            "Shorter elements are not sought.",
            advanced=True,
            default=FitParameters.min_length_m,
            low=1.0,
            high=MAX_ELEMENT_M,
        ),
        Choice(
            "TRANSITIONS",
            "Between two radii",
            "Jumps of the curvature, as in turnouts and sidings, or clothoids only.",
            advanced=True,
            options=TRANSITIONS,
            default=FitParameters.transitions,
        ),
        Flag(
            "ROUND",
            "Propose round radii",
            "States the roundest radius that the track allows, beside the fitted one.",
            advanced=True,
            default=FitParameters.rounded,
        ),
        LayerInput(
            "FIXED",
            "Corrected elements",
            "Elements of an earlier run that you have corrected. Their types are held, and radii and starts that you "
            "changed; the rest is fitted again.",
            advanced=True,
            optional=True,
            kinds=(TABLE,),
        ),
    ),
    (outputs.ELEMENTS_OUTPUT, outputs.DEVIATIONS_OUTPUT, outputs.ALIGNMENT_REPORT),
    (
        Figure("ELEMENT_COUNT", "Number of elements"),
        Figure("RMS", "Root mean square of the slews [mm]"),
        Figure("LIFT_RMS", "Root mean square of the lifts [mm]"),
        Figure("CANT_RMS", "Root mean square of the differences of cant [mm]"),
    ),
    ALIGNMENT,
    picture="alignment.svg",
    guide="alignment",
    pages=("alignment", "reference"),
    call="fit_alignment",
    run=_run,
)
