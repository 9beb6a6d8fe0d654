"""Grow Rail Points from Seeds: follows rails from places on them and writes a classified copy of the cloud."""

from __future__ import annotations

from dataclasses import replace

from ..errors import ParameterError
from ..parameters import GrowParameters
from ..progress import Estimating, Progress
from ..standards import SEARCHED_CLASSES
from . import inputs, methods, outputs
from .classify_rail_points import classified
from .declaration import (
    CLOUD_NEEDS,
    CLOUD_WORDS,
    POINT,
    RAIL_WORDS,
    RAW_CLOUDS,
    Flag,
    LayerOutput,
    Number,
    Parameter,
    Place,
)
from .result import Result
from .values import Job, Values

_GROWTH: tuple[Parameter, ...] = (
    Flag(
        "BOTH",
        "Follow both rails of the track",
        "The other rail of the track, at the gauge, is followed as well. Otherwise only the one with the seed.",
        advanced=True,
        default=GrowParameters.both,
    ),
    Number(
        "SEARCH",
        "Search distance [m]",
        "A seed finds the rail within this distance; a rail is lost further than this from its course.",
        advanced=True,
        default=GrowParameters.search_m,
        low=0.02,
        high=1.0,
    ),
    Number(
        "THICKNESS",
        "Width of the strip of rail points [m]",
        "Points within half of this width of the rail's axis belong to it, if they are at its height.",
        advanced=True,
        default=GrowParameters.thickness_m,
        low=0.02,
        high=0.5,
    ),
    Number(
        "WINDOW",
        "Length of a window [m]",
        "Length of rail that is looked at as one. In thin clouds, windows become longer by themselves.",
        advanced=True,
        default=GrowParameters.window_m,
        low=0.1,
        high=5.0,
    ),
    Number(
        "MIN_HEIGHT",
        "Least height above the bed [m]",
        "The bed beside a rail is lower than its top by this, except in pavements beside a groove.",
        advanced=True,
        default=GrowParameters.min_height_m,
        low=0.001,
        high=0.4,
    ),
    replace(
        methods.TOLERANCE_Z,
        help="Largest difference in height between points of a head, and from one window to the next.",
        default=GrowParameters.tolerance_z_m,
    ),
    Number(
        "MAX_OUTLIERS",
        "Most windows without the rail",
        "A rail that is not seen in more windows in a row than this is not followed further.",
        advanced=True,
        default=GrowParameters.max_outliers,
        high=1000,
        whole=True,
    ),
    Number(
        "MAX_LENGTH",
        "Longest run [m]",
        "Rails are followed for this length to either side of a seed; only these points are read.",
        advanced=True,
        default=GrowParameters.max_length_m,
        low=1.0,
        high=methods.MAX_LENGTH_M,
    ),
)


def _check(values: Values) -> None:
    """Check the rail, the seeds and the output."""
    from ..labelling.files import plan_output

    values.standard()
    if not values.filled("SEEDS") and not values.filled("SEED"):
        raise ParameterError("A rail is followed from seeds: choose a layer for SEEDS, or pick a point for SEED.")
    values.seeds(values.cloud_crs())
    plan_output(values.cloud().paths, values.path("OUTPUT"), values["RAIL_CLASS"])


def _run(values: Values, progress: Progress) -> Result:
    """Follow the rails and write the copy."""
    from ..files.layers import stops_layer
    from ..grow.heads import GrowSettings
    from ..labelling.files import Content, plan_output
    from ..labelling.growing import grow_files
    from ..run.tasks import Runner

    progress, standard = Estimating(progress), values.standard()
    choice = Content(values["RAIL_CLASS"], values.rails_only(), reset=False)
    output = plan_output(values.cloud().paths, values.path("OUTPUT"), choice.class_code, progress)
    request = values.request(SEARCHED_CLASSES, progress)
    settings = GrowSettings(standard.gauge_m, standard.head_width_m, values.growth())
    seeds = values.seeds(values.cloud_crs())
    with values.scratch() as folder:
        grown = grow_files(request, seeds, settings, choice, output, folder, Runner(), progress)
    return replace(classified(grown, request), layers={"STOPS": lambda: stops_layer(grown.stops)})


JOB = Job(
    "growrailpoints",
    "Grow rail points from seeds",
    "Follows rails in a lidar cloud from places that you point at, and classifies their points in a copy.",
    "Each rail is followed to both sides along its head, over crossings and through switches, up to the longest "
    "run. The log states where each rail stops, and why.\n\n"
    "The copy has the same points in the same order with the same attributes; points on these rails get the class "
    "of rail points. Where the input is a folder or a virtual point cloud, a folder of the same tiles is written, "
    "with a virtual point cloud (.vpc) next to it.\n\n"
    "The toolbar button Grow Rails lets you click rails on the map and shows at once what grows. The method was "
    "tested on simulated clouds only.",
    (*RAIL_WORDS, *CLOUD_WORDS, "classification", "raw", "seed", "interactive", "follow", "Klassifizierung"),
    CLOUD_NEEDS,
    (
        inputs.RAW_CLOUD,
        inputs.SEEDS,
        Place(
            "SEED",
            "Seed on the map",
            "A single place on a railhead, picked on the map, besides the layer or instead of it.",
            optional=True,
        ),
        *inputs.RAIL,
        *_GROWTH,
        inputs.CRS,
        inputs.LEFT_OUT,
        *methods.CONTENT,
    ),
    (
        *outputs.CLASSIFIED,
        LayerOutput(
            "STOPS",
            "Stops",
            "Points where a rail is not followed further, with the reason.",
            advanced=True,
            optional=True,
            kind=POINT,
        ),
    ),
    outputs.CLASSIFIED_FIGURES,
    RAW_CLOUDS,
    picture="gauge.svg",
    call="grow",
    check=_check,
    run=_run,
)
