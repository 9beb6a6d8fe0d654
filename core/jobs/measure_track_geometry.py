"""Measure Track Geometry: gauge, cant, twist, radius and gradient by chainage, with their accuracy and support."""

from __future__ import annotations

from dataclasses import replace

from ..fields import QUALITY_FIELDS
from . import shared
from .declaration import CLOUD_NEEDS, RAIL_WORDS, TRACK_WORDS, Job, LayerInput

JOB = Job(
    "measuretrackgeometry",
    "Measure track geometry",
    "Measures gauge, cant, twist, radius and gradient along tracks, and their support by points.",
    "Takes the lines of Extract Rails, or lines drawn by hand, and returns points along each centerline.\n\n"
    "With a point cloud, heights are measured again and smoothed over 1 m only, and sigma_mm, points and "
    "bridged apply to each station. Without one, the heights are those of the rails, each rail's sigma_mm and "
    "points are taken as uniform along it, and bridged is 1 where a rail is missing or its field gaps names "
    "the place.\n\n"
    "The findings and the report compare the gauge with that of the standard, with Gauge and with Other "
    "gauges, whichever is nearest.\n\n"
    "With an axis, points, findings and report have kilometres as well.",
    (*RAIL_WORDS, *TRACK_WORDS, "twist", "radius", "curvature", "gradient", "quality", "chainage"),
    CLOUD_NEEDS,
    (
        LayerInput(
            "INPUT",
            "Track centerlines",
            "Lines midway between rails, from Build Track Centerlines or drawn by hand. Chainage is measured along "
            "them.",
        ),
        LayerInput(
            "RAILS",
            "Rails",
            "The rails of these tracks: those named in left_ids and right_ids, otherwise the nearest.",
        ),
        replace(
            shared.CLOUD,
            name="POINTS",
            help="The cloud from which the rails were extracted: it gives heights, sigma_mm and points for each "
            "station.",
            optional=True,
        ),
        shared.STEP,
        replace(
            shared.STANDARD,
            help="Rail profile, which gives the railhead width, and the gauge that findings compare with.",
        ),
        replace(shared.GAUGE, help="Gauge that findings compare with, instead of that of the standard."),
        shared.HEAD_WIDTH,
        shared.OTHER_GAUGES,
        shared.LEFT_OUT,
        shared.WORKERS,
        *shared.axis(optional=True),
    ),
    (
        replace(shared.QUALITY_OUTPUT, name="OUTPUT"),
        replace(shared.FINDINGS_OUTPUT, on_demand=True),
        shared.REPORT,
    ),
    shared.QUALITY_FIGURES,
    fields=QUALITY_FIELDS,
    picture="gauge.svg",
    pages=("parameters", "reference"),
)
