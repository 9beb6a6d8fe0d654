"""Fit Alignment: the design elements of tracks in plan, height and cant, and how far the tracks lie off them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..parameters import TRANSITIONS, FitParameters
from . import shared
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
    Job,
    LayerInput,
    Number,
)

if TYPE_CHECKING:
    from ..alignment.fit import Fit
    from ..progress import Progress
    from .result import Result
    from .values import Values

READING, FITTING = 0.1, 0.95
"""Fractions of the progress bar at which lines are read, and at which they are fitted."""

MIN_FIT_TOLERANCE_MM, MAX_ELEMENT_M = 0.1, 1000.0
"""No scanner resolves a smaller tolerance, and no element that is left out on purpose is longer."""


def _run(values: Values, progress: Progress) -> Result:
    """Fit each track."""
    from ..alignment.fit import fit_tracks
    from ..fields import DEVIATIONS
    from ..output.layers import elements_layer, stations_layer
    from ..progress import Recording
    from ..report import build_alignment_page
    from .reading import read_elements, read_tracks
    from .result import Result

    progress = Recording(progress)
    tracks, frame = read_tracks(values, "INPUT", progress.span(0, READING))
    held = read_elements(values, "FIXED", frame.crs_wkt) if values.filled("FIXED") else []
    settings = FitParameters(values["TOLERANCE"] / 1000.0, values["MIN_LENGTH"], values["TRANSITIONS"], values["ROUND"])
    fits = fit_tracks(tracks, frame, settings, {one.track_id: one for one in held}, progress.span(READING, FITTING))
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
            f"Track {one.alignment.track_id}: {len(one.alignment.elements)} elements, root mean square "
            f"{one.rms_mm:.2f} mm"
            for one in fits
        ),
    )


def _figures(fits: Sequence[Fit]) -> dict[str, Any]:
    """Return the number of elements, and the root mean square of the slews in millimetres."""
    squares = sum(float((fit.deviations.slew_mm**2).sum()) for fit in fits)
    count = sum(len(fit.deviations.s) for fit in fits)
    elements = sum(len(fit.alignment.elements) for fit in fits)
    return {"ELEMENT_COUNT": elements, "RMS": round(math.sqrt(squares / count), 3)}


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
        shared.RAILS_OF_CANT,
        Number(
            "TOLERANCE",
            "Tolerance [mm]",
            "How far the track may be off its design. Misalignment up to this standard deviation is told from "
            "design by its length; more is followed by elements.",
            default=1000.0 * FitParameters.tolerance_m,
            low=MIN_FIT_TOLERANCE_MM,
            high=1000.0 * shared.MAX_TOLERANCE_M,
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
    (shared.ELEMENTS_OUTPUT, shared.DEVIATIONS_OUTPUT, shared.ALIGNMENT_REPORT),
    (Figure("ELEMENT_COUNT", "Number of elements"), Figure("RMS", "Root mean square of the slews [mm]")),
    ALIGNMENT,
    picture="alignment.svg",
    guide="alignment",
    pages=("alignment", "reference"),
    call="fit_alignment",
    run=_run,
)
