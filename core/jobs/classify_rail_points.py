"""Classify Rail Points: finds the points on railheads in a raw cloud and writes a classified copy."""

from __future__ import annotations

from ..parameters import DEFAULT_GUIDE_DISTANCE_M
from . import shared
from .declaration import CLOUD_NEEDS, CLOUD_WORDS, RAIL_WORDS, RAW_CLOUDS, Flag, Job, Number

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
        shared.RAW_CLOUD,
        *shared.RAIL,
        shared.OTHER_GAUGES,
        *shared.AREA,
        shared.GUIDE,
        Number(
            "GUIDE_DISTANCE",
            "Distance from the guide [m]",
            "Tracks whose middle is at most this far from a line of the guide are searched.",
            advanced=True,
            default=DEFAULT_GUIDE_DISTANCE_M,
            low=0.5,
            high=shared.MAX_LENGTH_M,
        ),
        Flag(
            "ONLY_GUIDED",
            "Only the tracks along the guide",
            "Keeps only tracks that have the guide within 0.5 m of their middle for more than half of their length.",
            advanced=True,
            default=False,
        ),
        *shared.METHOD,
        Flag(
            "KEEP_SINGLE",
            "Keep rails without a partner",
            "Straight rails of 5 m and more are kept although no other rail runs at the distance of the gauge, for "
            "example because it is hidden. Otherwise only pairs of rails are kept.",
            default=True,
        ),
        *shared.CONTENT,
        Flag(
            "RESET",
            "Reset the class of other points",
            "Points that already have the class of rail points, but are not found on rails, become class 1 "
            "(unclassified). Otherwise they keep it.",
            advanced=True,
            default=True,
        ),
        shared.WORKERS,
    ),
    shared.CLASSIFIED,
    shared.CLASSIFIED_FIGURES,
    RAW_CLOUDS,
    picture="gauge.svg",
)
