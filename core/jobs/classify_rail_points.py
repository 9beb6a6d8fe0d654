"""Classify Rail Points: finds the points on railheads in a raw cloud and writes a classified copy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import ParameterError
from ..parameters import DEFAULT_GUIDE_DISTANCE_M, Parameters
from ..progress import Estimating, Progress
from ..standards import SEARCHED_CLASSES
from . import inputs, methods, outputs
from .declaration import CLOUD_NEEDS, CLOUD_WORDS, RAIL_WORDS, RAW_CLOUDS, Flag, Number
from .result import Result
from .values import Job, Values

if TYPE_CHECKING:
    from ..clouds.points import Request
    from ..labelling.files import ClassifiedFiles


def _check(values: Values) -> None:
    """Check the rail, the guide, the classifier and the output."""
    from ..labelling.files import plan_output

    values.other_gauges(values.standard())
    if values.filled("GUIDE"):
        values.lines_along("GUIDE", values.cloud_crs())
    elif values["ONLY_GUIDED"]:
        raise ParameterError("ONLY_GUIDED needs lines to compare tracks with: choose GUIDE.")
    values.weights()
    plan_output(values.cloud().paths, values.path("OUTPUT"), values["RAIL_CLASS"])


def _run(values: Values, progress: Progress) -> Result:
    """Classify the cloud and write the copy."""
    from ..checks.standard import warn_of_raw
    from ..classify.settings import Settings
    from ..labelling.files import Content, classify_files, plan_output
    from ..labelling.finding import guide_of

    progress, standard = Estimating(progress), values.standard()
    gauges_m = (standard.gauge_m, *(gauge_m for gauge_m, _ in values.other_gauges(standard)))
    choice = Content(values["RAIL_CLASS"], values.rails_only(), values["RESET"])
    output = plan_output(values.cloud().paths, values.path("OUTPUT"), choice.class_code, progress)
    request, guide = values.request(SEARCHED_CLASSES, progress), None
    if values.filled("GUIDE"):
        lines = values.lines_along("GUIDE", values.cloud_crs())
        guide = guide_of(request, lines, values["GUIDE_DISTANCE"], values["ONLY_GUIDED"])
    settings = Settings(gauges_m, standard.head_width_m, values["KEEP_SINGLE"], guide, values.weights())
    with values.scratch() as folder, values.runner() as runner:
        found = classify_files(request, settings, choice, output, folder, runner, progress)
    parameters = Parameters(standard.gauge_m, standard.head_width_m).with_gauges(values.other_gauges(standard))
    warn_of_raw(request, found.figures, parameters, progress)
    return classified(found, request)


def classified(found: ClassifiedFiles, request: Request) -> Result:
    """Return the result of a job that writes a classified copy."""
    figures = {
        "OUTPUT": str(found.file),
        "POINT_COUNT": found.point_count,
        "RAIL_POINTS": found.figures.points,
        "PAIRED_LENGTH": found.figures.paired_m,
        "SINGLE_LENGTH": found.figures.single_m,
        "CELLS_PER_M": found.figures.cells_per_m,
    }
    said = f"{found.figures.points} of {found.point_count} points are on rails"
    return Result(figures, request.zero, sentences=(said,))


JOB = Job(
    "classifyrailpoints",
    "Classify rail points",
    "Finds the points on railheads in a lidar cloud that nobody has classified, and writes a classified copy.",
    "Rails are found by their shape: no classes of the ground, no trajectory and no training are needed. A "
    "classifier that you have trained can be used instead. Noise and withheld points are left "
    "out of the search.\n\n"
    "The copy has the same points in the same order with the same attributes; only classes differ. Where the "
    "input is a folder or a virtual point cloud, a folder of the same tiles is written, with a virtual point "
    "cloud (.vpc) of the same name next to it.\n\n"
    "The log states how many metres of rail were found with and without a partner. Below 10 cells with points "
    "per metre of rail, lines are less accurate and may have gaps. The method was tested on simulated clouds only.",
    (*RAIL_WORDS, *CLOUD_WORDS, "classification", "raw", "segmentation", "Klassifizierung"),
    CLOUD_NEEDS,
    (
        inputs.RAW_CLOUD,
        *inputs.RAIL,
        methods.OTHER_GAUGES,
        *inputs.AREA,
        inputs.GUIDE,
        Number(
            "GUIDE_DISTANCE",
            "Distance from the guide [m]",
            "Tracks whose middle is at most this far from a line of the guide are searched.",
            advanced=True,
            default=DEFAULT_GUIDE_DISTANCE_M,
            low=0.5,
            high=methods.MAX_LENGTH_M,
        ),
        Flag(
            "ONLY_GUIDED",
            "Only the tracks along the guide",
            "Keeps only tracks that have the guide within 0.5 m of their middle for more than half of their length.",
            advanced=True,
            default=False,
        ),
        *methods.METHOD,
        Flag(
            "KEEP_SINGLE",
            "Keep rails without a partner",
            "Straight rails of 5 m and more are kept although no other rail runs at the distance of the gauge, for "
            "example because it is hidden. Otherwise only pairs of rails are kept.",
            default=True,
        ),
        *methods.CONTENT,
        Flag(
            "RESET",
            "Reset the class of other points",
            "Points that already have the class of rail points, but are not found on rails, become class 1 "
            "(unclassified). Otherwise they keep it.",
            advanced=True,
            default=True,
        ),
        methods.WORKERS,
    ),
    outputs.CLASSIFIED,
    outputs.CLASSIFIED_FIGURES,
    RAW_CLOUDS,
    picture="gauge.svg",
    call="classify",
    check=_check,
    run=_run,
)
