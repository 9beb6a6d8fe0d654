"""Vectorize Rails: turns a cleaned rail raster into lines, in 3D if a point cloud is given."""

from __future__ import annotations

from dataclasses import replace

from . import shared
from .declaration import CLOUD_NEEDS, CLOUD_WORDS, RAIL_WORDS, STEPS, Job

JOB = Job(
    "vectorizerails",
    "Vectorize rails",
    "Turns a rail raster into lines of the railheads; a point cloud gives them their exact position and height.",
    "Takes the raster of Clean Rail Raster, or a similar one. With the cloud from which the raster was made, a "
    "line follows the top of the railhead on the axis of the head. Without the cloud, lines have no heights and "
    "are only as accurate as the raster.\n\n"
    "A raster from other software does not state its gauge and railhead width: fill them in.",
    (*RAIL_WORDS, *CLOUD_WORDS, "raster", "vectorize", "line", "3d"),
    CLOUD_NEEDS,
    (
        shared.RASTER,
        replace(
            shared.CLOUD,
            name="POINTS",
            help="The cloud from which the raster was made: it moves the lines onto the railheads and gives them "
            "heights.",
            optional=True,
        ),
        *shared.LINES,
        *shared.RASTER_RAIL,
        shared.LEFT_OUT,
    ),
    (replace(shared.RAILS_OUTPUT, name="OUTPUT", optional=False),),
    shared.RAIL_FIGURES,
    STEPS,
    picture="gauge.svg",
)
