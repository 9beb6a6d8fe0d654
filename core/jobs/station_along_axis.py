"""Station Along Axis: kilometre, offset and side of the features of any layer, from the axis of the railway."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import CrsError, RailExtractError
from ..fields import EXTENT_FIELDS, STATION_FIELDS
from ..progress import Progress
from . import inputs
from .declaration import ALIGNMENT, LINE_NEEDS, PLACES, RAIL_WORDS, Figure, LayerInput, LayerOutput
from .result import Result
from .values import Job, Values

if TYPE_CHECKING:
    import numpy as np

    from ..kilometres.axes import PlacedAxes
    from .features import PlacedFeatures


def _check(values: Values) -> None:
    """Check that the layer has places, and read the axis."""
    if not values.source("INPUT").kinds:
        raise RailExtractError("INPUT is a table without places: give a layer of points, lines or polygons.")
    values.prepare(values.system("INPUT"))
    values.axes(_plane(values))


def _plane(values: Values) -> str | None:
    """Return the coordinate system in which kilometres are measured: that of the axis, else that of the places."""
    from ..clouds.crs import is_geographic, parse_crs
    from ..kilometres.axes import AXIS_IN_DEGREES

    known = [crs_wkt for crs_wkt in map(values.system, ("AXIS", "INPUT")) if crs_wkt]
    plane = next((crs_wkt for crs_wkt in known if not is_geographic(parse_crs(crs_wkt))), None)
    if known and plane is None:
        raise CrsError(AXIS_IN_DEGREES)
    return plane


def _run(values: Values, progress: Progress) -> Result:
    """Give the features their kilometres."""
    import numpy as np

    from ..clouds.crs import unit_in_plan
    from ..files.layers import Copy
    from ..frame import LocalFrame
    from ..rails import Kilometres

    reading, rest = progress.after_reading()
    locating, reaching = rest.split(2)
    plane = _plane(values)
    axes = values.axes(plane)
    places = values.places("INPUT", plane, reading)
    known = axes.on_map(places.xy, places.ids, progress)
    found = Kilometres.empty(len(places.ids))
    found.put(known, axes.locate(places.xy[known], locating))
    columns = [getattr(found, one.name) for one in STATION_FIELDS]
    if not places.are_points:
        columns += _extents_km(places, known, axes, reaching)
    fields = (*STATION_FIELDS, *EXTENT_FIELDS)[: len(columns)]
    count = int(np.isfinite(found.km).sum())
    figures = {
        "PLACE_COUNT": count,
        "BEYOND_COUNT": len(found.km) - count,
        "AMBIGUOUS_COUNT": sum(map(bool, found.ambiguous)),
    }
    crs_wkt = values.system("INPUT")
    return Result(
        figures,
        LocalFrame(np.zeros(3), unit_in_plan(crs_wkt), crs_wkt=crs_wkt),
        {"OUTPUT": lambda: Copy(places.originals, fields, columns)},
        sentences=(f"{count} of {len(found.km)} features have a kilometre.",),
    )


def _extents_km(places: PlacedFeatures, known: np.ndarray, axes: PlacedAxes, progress: Progress) -> list[np.ndarray]:
    """Return the smallest and the largest kilometre of the vertices of features, (n,) each; NaN without any."""
    import numpy as np

    mine = known[places.owner]
    km = axes.kilometres(places.vertices[mine], progress).km
    first, last = np.full((2, len(known)), np.nan)
    np.fmin.at(first, places.owner[mine], km)
    np.fmax.at(last, places.owner[mine], km)
    return [first, last]


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
        *inputs.axis(optional=False),
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
    call="station",
    check=_check,
    run=_run,
)
