"""Parameters of several jobs for what they read: clouds, rasters, rails and gauges, area, guides, and the axis."""

from __future__ import annotations

from dataclasses import replace

from ..design_numbers import KM
from ..kilometres.text import HECTOMETRES, NOTATIONS
from ..parameters import (
    LEAVE_OUT,
)
from ..standards import CUSTOM, DEFAULT, DETECT, RAIL_CLASS, STANDARDS
from .declaration import (
    LINE,
    MM_DECIMALS,
    POINT,
    POLYGON,
    TABLE,
    Choice,
    Cloud,
    Extent,
    FieldInput,
    LayerInput,
    Number,
    Parameter,
    RasterInput,
    System,
    Text,
)

INCREASING, DECREASING = DIRECTIONS = ("INCREASING", "DECREASING")
"""Whether kilometres increase from the first vertex of an axis."""

CLOUD = Cloud(
    "INPUT",
    "Point cloud (layer, file or folder)",
    "A loaded point cloud layer, or the path of a LAS, LAZ or COPC file, of a folder of such files, or of "
    "a virtual point cloud (.vpc).",
)

RAW_CLOUD = replace(CLOUD, help=f"{CLOUD.help} It needs no classes.")

RAIL_CLASSES = Text(
    "RAIL_CLASSES",
    "Rail classes",
    "Classes of the points on rails, such as 10 or 10,11. Each class is processed separately.",
    default=str(RAIL_CLASS),
)

RASTER = RasterInput(
    "INPUT",
    "Rail raster",
    "One band per class, with 1 where there is rail, as from Rasterize Rail Points. North up, square cells.",
)

STANDARD = Choice(
    "STANDARD",
    "Rail standard",
    "Rail profile and gauge, which give the rail spacing and the railhead width. CUSTOM takes both from GAUGE and "
    "HEAD_WIDTH.",
    options=(*STANDARDS, CUSTOM),
    default=DEFAULT,
)

DETECTED_STANDARD = replace(
    STANDARD,
    help=f"{STANDARD.help} DETECT measures the rails in part of the points, and says how sure it is.",
    options=(*STANDARD.options, DETECT),
)

GAUGE = Number(
    "GAUGE",
    "Gauge [mm]",
    "Distance between the inner faces of the two railheads. Leave empty to use the value of the standard.",
    advanced=True,
    optional=True,
    low=1.0,
    decimals=MM_DECIMALS,
)

HEAD_WIDTH = replace(
    GAUGE,
    name="HEAD_WIDTH",
    label="Railhead width [mm]",
    help="Width of the head of one rail. Leave empty to use the value of the standard.",
)

RAIL = (STANDARD, GAUGE, HEAD_WIDTH)

_UNSTATED = "Needed for a raster from other software, which does not state {}. Overrides the tag of the raster."

RASTER_RAIL = (
    replace(GAUGE, help=_UNSTATED.format("its gauge")),
    replace(HEAD_WIDTH, help=_UNSTATED.format("the width")),
)
"""Gauge and railhead width for a raster without tags."""

CRS = System(
    "CRS",
    "CRS of a cloud without one",
    "Projected coordinate system for files that do not state one; other files keep their own.",
    advanced=True,
    optional=True,
)

LEFT_OUT = Choice(
    "LEAVE_OUT",
    "Points to leave out",
    "OVERLAP leaves out points that are marked as overlap of strips, SYNTHETIC those that are marked as computed, not "
    "measured. Withheld points are always left out.",
    advanced=True,
    optional=True,
    options=LEAVE_OUT,
    several=True,
)

AREA: tuple[Parameter, ...] = (
    Extent(
        "EXTENT",
        "Extent",
        "Only points inside this rectangle are read. Leave empty to read all points.",
        advanced=True,
        optional=True,
    ),
    LayerInput(
        "MASK",
        "Mask",
        "Only points inside these polygons are read, for example a strip along the line.",
        advanced=True,
        optional=True,
        transformed=True,
        kinds=(POLYGON,),
    ),
    CRS,
    LEFT_OUT,
)

GUIDE = LayerInput(
    "GUIDE",
    "Guide",
    "Lines along the tracks, from a map such as OpenStreetMap or drawn by hand. Rails are searched near them only. "
    "Lines in another coordinate system are transformed.",
    advanced=True,
    optional=True,
    transformed=True,
)

SEEDS = LayerInput(
    "SEEDS",
    "Seeds",
    "Points on railheads, or lines along them, one for each rail or track to follow. In another coordinate system they "
    "are transformed. The map tool Grow Rails makes such a layer.",
    optional=True,
    transformed=True,
    kinds=(POINT, LINE),
)

RAILS_OF_CANT = LayerInput(
    "RAILS",
    "Rails",
    "3D lines of both rails, for the cant where there is no track geometry.",
    advanced=True,
    optional=True,
)


def axis(optional: bool) -> tuple[Parameter, ...]:
    """Return the axis and what states its kilometres: the line, its start and posts in sight unless it is optional."""
    return (
        LayerInput(
            "AXIS",
            "Axis",
            "Line that carries the kilometres: with M values in kilometres or metres, or with the fields below. In "
            "another coordinate system it is transformed.",
            advanced=optional,
            optional=optional,
            transformed=True,
        ),
        Number(
            "START_KM",
            "Start of the axis [km]",
            "Kilometre at the first vertex of the axis, for an axis that is a single line. It overrides M values.",
            advanced=optional,
            optional=True,
            low=KM.low,
            high=KM.high,
            decimals=6,
        ),
        Choice(
            "DIRECTION",
            "Kilometres along the axis",
            "Whether kilometres increase or decrease from the start of the axis; used with its start kilometre.",
            advanced=True,
            options=DIRECTIONS,
            default=INCREASING,
        ),
        LayerInput(
            "POSTS",
            "Kilometre posts",
            "Points of kilometre or hectometre posts up to 50 m beside the axis. Kilometres are interpolated between "
            "them. They override the start and M values.",
            advanced=optional,
            optional=True,
            transformed=True,
            kinds=(POINT,),
        ),
        *_NOTATION,
    )


_NOTATION: tuple[Parameter, ...] = (
    FieldInput(
        "POST_FIELD",
        "Field of the posts with the kilometre",
        "Numbers, or texts such as 12.3+45. Empty means the first of km, kilometre, km_text, station.",
        advanced=True,
        optional=True,
        of="POSTS",
    ),
    LayerInput(
        "JUMPS",
        "Jumps of the kilometres",
        "Table with the fields km_back, the kilometre before each jump, and km_ahead, the one behind it, in the order "
        "of increasing kilometres.",
        advanced=True,
        optional=True,
        kinds=(TABLE,),
    ),
    Choice(
        "FORMAT",
        "Kilometres as text",
        "HECTOMETRES writes 12.3+45.67, KILOMETRES 12+345.67, GERMAN 12,3 + 46, and MILES 7 mi 1181.39 yd, in miles "
        "and yards.",
        advanced=True,
        options=tuple(NOTATIONS),
        default=HECTOMETRES,
    ),
)
