"""Station Along Axis: kilometre, offset and side of the features of any layer, from the axis of the railway."""

from __future__ import annotations

from ..fields import EXTENT_FIELDS, STATION_FIELDS
from . import shared
from .declaration import ALIGNMENT, LINE_NEEDS, PLACES, RAIL_WORDS, Figure, Job, LayerInput, LayerOutput

JOB = Job(
    "stationalongaxis",
    "Station along axis",
    "Gives the features of any layer their kilometre along the axis of the railway, with offset and side.",
    "The axis is the line that carries the kilometres, often that of one track or the middle between two. Its "
    "kilometres come from posts, from the kilometre at its start, or from its M values, in this order.\n\n"
    "The copy has the fields km, km_text, offset_m (positive to the left), side and further ones; lines and "
    "polygons also get km_from and km_to. The kilometre comes from the axis at right angles, never "
    "from the length of a parallel track. Where numbers are missing or twice, piece tells the sections apart.",
    (*RAIL_WORDS, "kilometre", "chainage", "stationing", "linear referencing", "mileage", "Kilometrierung"),
    LINE_NEEDS,
    (
        LayerInput(
            "INPUT",
            "Layer",
            "Points, lines or polygons. A line counts where it is half way, a polygon at a place inside.",
            kinds=(PLACES,),
        ),
        *shared.axis(optional=False),
    ),
    (
        LayerOutput(
            "OUTPUT",
            "Layer with kilometres",
            "The features of the layer with all their fields, and with axis, kilometre, offset and side.",
            kind=PLACES,
        ),
    ),
    (
        Figure("PLACE_COUNT", "Number of features with a kilometre"),
        Figure("BEYOND_COUNT", "Number of features without a kilometre"),
        Figure("AMBIGUOUS_COUNT", "Number of features with an ambiguous kilometre"),
    ),
    ALIGNMENT,
    (*STATION_FIELDS, *EXTENT_FIELDS),
    "stationing.svg",
    "stationing",
    ("stationing", "reference"),
)
