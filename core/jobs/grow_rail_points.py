"""Grow Rail Points from Seeds: follows rails from places on them and writes a classified copy of the cloud."""

from __future__ import annotations

from dataclasses import replace

from ..parameters import GrowParameters
from . import shared
from .declaration import (
    CLOUD_NEEDS,
    CLOUD_WORDS,
    POINT,
    RAIL_WORDS,
    RAW_CLOUDS,
    Flag,
    Job,
    LayerOutput,
    Number,
    Parameter,
    Place,
)

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
        shared.TOLERANCE_Z,
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
        high=shared.MAX_LENGTH_M,
    ),
)

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
        shared.RAW_CLOUD,
        shared.SEEDS,
        Place(
            "SEED",
            "Seed on the map",
            "A single place on a railhead, picked on the map, besides the layer or instead of it.",
            optional=True,
        ),
        *shared.RAIL,
        *_GROWTH,
        shared.CRS,
        shared.LEFT_OUT,
        *shared.CONTENT,
    ),
    (
        *shared.CLASSIFIED,
        LayerOutput(
            "STOPS",
            "Stops",
            "Points where a rail is not followed further, with the reason.",
            advanced=True,
            optional=True,
            kind=POINT,
        ),
    ),
    shared.CLASSIFIED_FIGURES,
    RAW_CLOUDS,
    picture="gauge.svg",
)
