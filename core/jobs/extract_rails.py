"""Extract Rails: the whole way from a classified cloud to 3D rails and track centerlines."""

from __future__ import annotations

from dataclasses import replace

from ..parameters import STRIPS, Parameters
from . import shared
from .declaration import CLOUD_NEEDS, CLOUD_WORDS, RAIL_WORDS, TRACK_WORDS, Choice, Flag, Job, RasterOutput

JOB = Job(
    "extractrails",
    "Extract rails",
    "Turns lidar points classified as rail into the 3D lines of the railheads and of the track centerlines.",
    "Choose the cloud and press Run; everything else has a default. If nobody has classified the cloud, tick the "
    "box that finds the rail points. The coordinate system must be a projected one.\n\n"
    "A rail line follows the top of the railhead on the axis of the head. Gauge is the distance between the two rail "
    "lines minus the railhead width; it is not measured 14 mm below the top. Cant is left minus right, as seen along "
    "the line.\n\n"
    "The report says where the lines are good and where not. Findings are the places to look at.",
    (*RAIL_WORDS, *CLOUD_WORDS, *TRACK_WORDS, "centerline", "centreline", "axis", "vectorize", "line", "3d"),
    (*CLOUD_NEEDS, ("cv2", "torch")),
    (
        shared.CLOUD,
        shared.RAIL_CLASSES,
        Flag(
            "MERGE_CLASSES",
            "Take all rail classes for one",
            "For tracks whose rails, or parts of rails, are of different classes. The results have the first class.",
            advanced=True,
            default=False,
        ),
        Flag(
            "CLASSIFY",
            "Find the rail points of a raw cloud",
            "For clouds that nobody has classified: finds the rail points first, as Classify Rail Points does. The "
            "rail classes are ignored.",
            default=False,
        ),
        *shared.METHOD,
        replace(
            shared.SEEDS,
            label="Seeds in a raw cloud",
            help="Points on railheads, or lines along them: only the rails that grow from these are extracted, as Grow "
            "Rail Points from Seeds follows them. The rail classes are ignored.",
            advanced=True,
        ),
        shared.DETECTED_STANDARD,
        shared.GAUGE,
        shared.HEAD_WIDTH,
        *shared.AREA,
        replace(shared.MODEL, advanced=True),
        *shared.CLEANUP,
        *shared.LINES,
        *shared.PAIRING,
        Choice(
            "STRIPS",
            "Strips of the scanner",
            "What happens where passes of the scanner differ. AS_THEY_ARE uses their points together and states the "
            "difference in strip_mm and sigma_mm. ALIGNED moves each pass onto the mean of all that show the same "
            "rail, which removes steps. Passes are told apart by the source ids and GPS times of the points.",
            advanced=True,
            options=STRIPS,
            default=Parameters.strips,
        ),
        shared.STEP,
        shared.WORKERS,
        *shared.axis(optional=True),
    ),
    (
        shared.RAILS_OUTPUT,
        replace(shared.CENTERLINES_OUTPUT, advanced=True),
        replace(shared.QUALITY_OUTPUT, advanced=True, on_demand=True),
        shared.FINDINGS_OUTPUT,
        RasterOutput(
            "CLEANED",
            "Cleaned rail raster",
            "The raster after the network, as from Clean Rail Raster.",
            advanced=True,
            optional=True,
            on_demand=True,
        ),
        shared.REPORT,
    ),
    (*shared.RAIL_FIGURES, *shared.CENTERLINE_FIGURES, *shared.QUALITY_FIGURES, shared.ENGINE_USED),
    picture="gauge.svg",
    pages=("parameters", "tutorial", "limits", "troubleshooting"),
)
