"""Compare Tracks: lines of two surveys, or of a survey and a design, metre by metre."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from typing import TYPE_CHECKING, Any

from ..errors import ParameterError
from ..fields import DIFFERENCE_FIELDS
from ..parameters import ComparisonParameters
from ..progress import Progress
from . import methods, outputs
from .declaration import (
    ALIGNMENT,
    LINE_NEEDS,
    MM_DECIMALS,
    POINT,
    RAIL_WORDS,
    TRACK_WORDS,
    Figure,
    Flag,
    LayerInput,
    LayerOutput,
    Number,
)
from .result import Result
from .values import Job, Values

if TYPE_CHECKING:
    from ..comparison import Survey, TrackComparison
    from ..frame import LocalFrame

SURVEYS = {"REFERENCE": ("REFERENCE_RAILS", "REFERENCE_SIGMA"), "INPUT": ("RAILS", "INPUT_SIGMA")}
"""Rails and standard error of each survey, by its lines."""

MAX_REACH_M = 2.0
"""Two tracks are further apart than this."""

_SIGMA = Number(
    "REFERENCE_SIGMA",
    "Standard error, reference [mm]",
    "Across and in height, where lines state none; 0 for a design. Empty: the scatter shows it.",
    advanced=True,
    optional=True,
    decimals=MM_DECIMALS,
)
_RAILS = LayerInput(
    "REFERENCE_RAILS",
    "Rails of the reference",
    "For centerlines: the rails of these tracks, for differences of gauge and cant.",
    advanced=True,
    optional=True,
)


def _check(values: Values) -> None:
    """Check that there are rails of both surveys, or of none."""
    rails = {name: values.filled(name) for name, _ in SURVEYS.values()}
    if len(set(rails.values())) > 1:
        other = next(name for name, is_given in rails.items() if not is_given)
        raise ParameterError(f"Gauge and cant are compared between the rails of both surveys: choose {other}, too.")


def _run(values: Values, progress: Progress) -> Result:
    """Read both surveys and compare them."""
    from ..comparison import compare_surveys, doubts_of
    from ..files.layers import differences_layer
    from ..report.comparison import build_comparison, describe_shift, verdict_on

    reading, comparing = progress.after_reading()
    earlier, later = reading.split(2)
    reference, frame = _survey(values, "REFERENCE", None, earlier)
    other, _ = _survey(values, "INPUT", frame, later)
    settings = ComparisonParameters(values["REACH"], values["STEP"], values["IGNORE_SHIFT"])
    found = compare_surveys(reference, other, settings, comparing)
    progress.check()
    for sentence in doubts_of(found):
        progress.warning(sentence)
    source = " against ".join(map(values.title, ("INPUT", "REFERENCE")))
    facts = {"Date": f"{datetime.now():%Y-%m-%d %H:%M}", "Command": values.command}
    return Result(
        _figures(found),
        frame,
        {"OUTPUT": lambda: differences_layer(found)},
        {"REPORT": lambda: build_comparison(found, source, facts)},
        (verdict_on(found), describe_shift(found)),
        found=found,
    )


def _survey(values: Values, name: str, frame: LocalFrame | None, progress: Progress) -> tuple[Survey, LocalFrame]:
    """Read one survey in a frame; without one, in its own, which is returned as well."""
    from ..comparison import Survey
    from .lines import way

    rails, sigma = SURVEYS[name]
    lines = values.lines(name, progress)
    frame = frame or lines.frame
    shift = way(name, lines.frame, "REFERENCE", frame)
    made = Survey([replace(line, xyz=line.xyz + shift) for line in lines.surveyed()])
    if values[sigma] is not None:
        made = replace(made, sigma_m=values[sigma] / 1000)
    if values.filled(rails):
        found = values.lines(rails, progress)
        shift = way(rails, found.frame, "REFERENCE", frame)
        made = replace(made, rails=[replace(rail, xyz=rail.xyz + shift) for rail in found.rails(progress)])
    return made, frame


def _figures(found: TrackComparison) -> dict[str, Any]:
    """Return lengths in metres, and root mean squares and the shift in millimetres; None if unknown."""
    import numpy as np

    from ..comparison import BOTH, EXTRA, MISSING
    from ..spread import rms

    across, height = (found.values(name) for name in ("across_mm", "height_mm"))
    east, north = 1000 * found.shift.plan_m if len(across) else (np.nan, np.nan)
    numbers = {
        "COMPARED_LENGTH": found.length_of(BOTH),
        "MOVED_LENGTH": found.moved_m,
        "MISSING_LENGTH": found.length_of(MISSING),
        "EXTRA_LENGTH": found.length_of(EXTRA),
        "ACROSS_RMS": rms(across),
        "HEIGHT_RMS": rms(height),
        "SHIFT_EAST": east,
        "SHIFT_NORTH": north,
        "SHIFT_UP": 1000 * found.shift.up_m,
    }
    return {name: round(float(value), 2) + 0.0 if np.isfinite(value) else None for name, value in numbers.items()}


JOB = Job(
    "comparetracks",
    "Compare tracks",
    "Compares the lines of two surveys, or of a survey and a design, metre by metre: what has moved, and where.",
    "The reference is the earlier survey, the design, or a control measurement. Its lines are rails or "
    "centerlines; the same kind of lines is compared with it. Between rails, gauge and cant are compared as "
    "well; for centerlines, give the rails of both surveys.\n\n"
    "Standard errors come from the fields sigma_mm and sigmaz_mm of the lines, else from the advanced "
    "parameters. Where neither states one, the scatter of the differences stands for it, and the run says so.\n\n"
    "A constant shift between the surveys, as from two positions of a base station, is estimated so that it "
    "is the same for most of the length, and stated apart.",
    (
        *(*RAIL_WORDS, *TRACK_WORDS, "compare", "difference", "deviation", "movement", "monitoring", "design"),
        "control",
    ),
    LINE_NEEDS,
    (
        LayerInput(
            "REFERENCE",
            "Reference",
            "Rails or centerlines of the earlier survey, of the design, or of a control measurement.",
        ),
        LayerInput(
            "INPUT",
            "Lines to compare",
            "The same kind of lines of the later survey, in the same coordinate system.",
        ),
        _RAILS,
        replace(_RAILS, name="RAILS", label="Rails to compare"),
        _SIGMA,
        replace(_SIGMA, name="INPUT_SIGMA", label="Standard error, lines [mm]"),
        Flag(
            "IGNORE_SHIFT",
            "Leave a constant shift out of account",
            "moved is judged without the shift that most of the length shares. Switch it off for a design.",
            default=ComparisonParameters.ignore_shift,
        ),
        Number(
            "REACH",
            "Greatest distance of the same line [m]",
            "Lines further from those of the reference are not the same line: missing and extra.",
            advanced=True,
            default=ComparisonParameters.reach_m,
            low=0.01,
            high=MAX_REACH_M,
        ),
        Number(
            "STEP",
            "Step of the comparison [m]",
            "Distance between the points along each line.",
            advanced=True,
            default=ComparisonParameters.step_m,
            low=0.1,
            high=methods.MAX_LENGTH_M,
        ),
    ),
    (
        LayerOutput(
            "OUTPUT",
            "Differences",
            "Points along the lines of the reference with the differences, and along lines that it does not have.",
            optional=True,
            kind=POINT,
        ),
        replace(outputs.REPORT, help="A web page with what has moved, the constant shift and the distribution."),
    ),
    (
        Figure("COMPARED_LENGTH", "Length on lines of both surveys [m]"),
        Figure("MOVED_LENGTH", "Length that has moved [m]"),
        Figure("MISSING_LENGTH", "Length of the reference without a line [m]"),
        Figure("EXTRA_LENGTH", "Length of lines that the reference does not have [m]"),
        Figure("ACROSS_RMS", "Differences across, root mean square [mm]"),
        Figure("HEIGHT_RMS", "Differences in height, root mean square [mm]"),
        Figure("SHIFT_EAST", "Constant shift east [mm]"),
        Figure("SHIFT_NORTH", "Constant shift north [mm]"),
        Figure("SHIFT_UP", "Constant shift up [mm]"),
    ),
    ALIGNMENT,
    DIFFERENCE_FIELDS,
    "comparison.svg",
    "comparison",
    ("comparison", "reference"),
    call="compare",
    check=_check,
    run=_run,
)
