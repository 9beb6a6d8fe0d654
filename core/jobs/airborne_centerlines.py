"""Track Centerlines from Airborne Lidar: fits the track of each guide in a cloud that shows no single railheads."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..errors import ParameterError
from ..fields import AIRBORNE
from ..parameters import AIRBORNE_CLASSES, AirborneParameters
from ..progress import Estimating, Progress
from ..standards import SEARCHED_CLASSES
from . import inputs, methods, outputs
from .declaration import (
    CLOUD_NEEDS,
    CLOUD_WORDS,
    POINT,
    RAIL_WORDS,
    RAW_CLOUDS,
    TRACK_WORDS,
    Figure,
    LayerOutput,
    Number,
    Text,
)
from .result import Result, ShownCloud
from .values import Job, Values, class_numbers

if TYPE_CHECKING:
    from ..airborne.survey import AirborneSurvey

MAX_GUIDE_REACH_M, MAX_FOOTPRINT_M, MAX_RAIL_M = 6.0, 2.0, 0.5
"""Beyond, a guide means another track, a footprint covers both rails, and a rail is not a rail."""

NOT_PROPOSED = "Guides are not proposed: draw them, or import them, such as railway=rail of OpenStreetMap."
"""What the output PROPOSED means: a search of the whole cloud found too few tracks and too many that are none."""


def _check(values: Values) -> None:
    """Check the rail, the classes and the guides."""
    values.airborne(values.standard())
    _class_codes(values)
    if not values.filled("GUIDE"):
        raise ParameterError(
            "GUIDE is empty: draw lines along the tracks, or import them, such as railway=rail of OpenStreetMap."
        )
    values.guides("GUIDE", values.cloud_crs())


def _class_codes(values: Values) -> tuple[int, ...]:
    """Return the classes to use; all but noise if none is named."""
    classes = (values["CLASSES"] or "").strip()
    return class_numbers(classes, "CLASSES") if classes else SEARCHED_CLASSES


def _run(values: Values, progress: Progress) -> Result:
    """Fit the tracks along the guides."""
    from ..airborne.files import Run, survey_files

    progress, standard, codes = Estimating(progress), values.standard(), _class_codes(values)
    if values.wanted("PROPOSED"):
        progress.warning(NOT_PROPOSED)
    request = values.request(codes, progress)
    with values.runner() as runner, values.scratch() as folder:
        run = Run(request, values.airborne(standard), folder / "points", runner, progress)
        made = _fitted(survey_files(run, values.guides("GUIDE", values.cloud_crs())), values)
    return replace(made, cloud=ShownCloud("INPUT", codes, standard.head_width_m))


def _fitted(survey: AirborneSurvey, values: Values) -> Result:
    """Return what was found along the guides as a result."""
    from ..files.layers import airborne_stations_layer, findings_layer, lines_layer
    from ..report.airborne import airborne_findings, airborne_page, airborne_summary

    facts = {"Rail": values.standard().label, "Command": values.command}
    figures: dict[str, Any] = {
        **outputs.figures_of(survey.lines, "CENTERLINE"),
        "GUIDE_LENGTH": survey.guides_m,
        "SEEN_LENGTH": survey.seen_m,
        "DENSITY": round(survey.density, 1),
    }
    return Result(
        figures,
        survey.frame,
        {
            "CENTERLINES": lambda: lines_layer(AIRBORNE, survey.lines),
            "STATIONS": lambda: airborne_stations_layer(survey.tracks),
            "FINDINGS": lambda: findings_layer(airborne_findings(survey)),
        },
        {"REPORT": lambda: airborne_page(survey, values.cloud().paths[0].resolve().name, facts)},
        tuple(airborne_summary(survey)),
    )


JOB = Job(
    "airbornecenterlines",
    "Track centerlines from airborne lidar",
    "Fits the centerlines of tracks in airborne lidar, along lines that say which tracks are meant.",
    "For the clouds of national surveys, with 5 to 100 points per square metre, which show no single railheads; "
    "for mobile lidar, use Extract Rails.\n\n"
    "A line ends where the track is not seen for more than 30 m; the stations state why. The standard error "
    "leaves out that of the flight against its datum, often 3 to 10 cm.",
    (*RAIL_WORDS, *CLOUD_WORDS, *TRACK_WORDS, "airborne", "ALS", "national", "OpenStreetMap", "centerline"),
    CLOUD_NEEDS,
    (
        replace(inputs.CLOUD, label="Airborne point cloud (layer, file or folder)"),
        Text(
            "CLASSES",
            "Classes",
            "Classes of the points to use: by default unclassified and ground. Empty uses all but noise.",
            advanced=True,
            optional=True,
            default=",".join(map(str, AIRBORNE_CLASSES)),
        ),
        replace(
            inputs.GUIDE,
            help="One line for each track of the railway, such as railway=rail of OpenStreetMap, up to 3 m off. Give "
            "every track its guide: they are fitted together.",
            advanced=False,
        ),
        *inputs.RAIL,
        Number(
            "REACH",
            "Reach [m]",
            "Largest distance of a track from its guide.",
            advanced=True,
            default=AirborneParameters.reach_m,
            low=0.5,
            high=MAX_GUIDE_REACH_M,
        ),
        Number(
            "FOOTPRINT",
            "Footprint [m]",
            "Diameter of the laser beam on the ground: flying height times divergence, such as 1000 m times 0.25 mrad. "
            "If it is not known, 0.3 m suits most flights; a warning says if the rails look wider.",
            default=AirborneParameters.footprint_m,
            low=0.01,
            high=MAX_FOOTPRINT_M,
        ),
        Number(
            "RAIL_HEIGHT",
            "Rails above the bed [m]",
            "Top of the rails above the bed between them, which the points show. It depends on the ballast.",
            advanced=True,
            default=AirborneParameters.rail_height_m,
            high=MAX_RAIL_M,
        ),
        *inputs.AREA,
        methods.WORKERS,
    ),
    (
        replace(
            outputs.CENTERLINES_OUTPUT,
            help="Lines in the middle of the tracks at the top of the rails, where they are seen, with standard "
            "errors.",
        ),
        LayerOutput(
            "STATIONS",
            "Stations",
            "A point every 10 m along each guide: whether the track is seen, or why not; bed, cant, radius, gradient "
            "and standard errors.",
            advanced=True,
            optional=True,
            kind=POINT,
        ),
        outputs.FINDINGS_OUTPUT,
        LayerOutput(
            "PROPOSED",
            "Proposed guides",
            NOT_PROPOSED,
            advanced=True,
            optional=True,
            on_demand=True,
        ),
        outputs.REPORT,
    ),
    (
        *outputs.CENTERLINE_FIGURES,
        Figure("GUIDE_LENGTH", "Length of the guides [m]"),
        Figure("SEEN_LENGTH", "Length on which tracks are seen [m]"),
        Figure("DENSITY", "Points per square metre along the guides"),
        Figure("PROPOSED_LENGTH", "Length of the proposed guides [m]: never stated, because none are proposed"),
    ),
    RAW_CLOUDS,
    picture="gauge.svg",
    guide="airborne",
    pages=("airborne", "parameters"),
    call="airborne",
    check=_check,
    run=_run,
)
