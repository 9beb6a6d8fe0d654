"""The outputs and figures that several jobs share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..fields import BRIDGED, LENGTH, SIGMA
from .declaration import POINT, Figure, FileOutput, LayerOutput, Output

if TYPE_CHECKING:
    from ..rails import TrackGeometry

WEB_PAGES = "Web pages (*.html)"

RAILS_OUTPUT = LayerOutput(
    "RAILS",
    "Rails",
    "Lines along the top of the railheads, with length, support by points and standard error.",
    optional=True,
)
CENTERLINES_OUTPUT = LayerOutput(
    "CENTERLINES",
    "Track centerlines",
    "Lines midway between the two rails of each track, with gauge and cant.",
    optional=True,
)
QUALITY_OUTPUT = LayerOutput(
    "QUALITY",
    "Track geometry",
    "Points along each track with gauge, cant, twist, radius, gradient, standard error and support.",
    optional=True,
    kind=POINT,
)
FINDINGS_OUTPUT = LayerOutput(
    "FINDINGS",
    "Findings",
    "Places to look at, with the reason, the most harmful first: the table of the report as lines to review.",
    advanced=True,
    optional=True,
)
ELEMENTS_OUTPUT = LayerOutput(
    "ELEMENTS",
    "Elements",
    "The element table: a line for each element in plan, in height and of cant, with its figures.",
    optional=True,
)
DEVIATIONS_OUTPUT = LayerOutput(
    "DEVIATIONS",
    "Deviations",
    "Points along the design, one per metre, with slew, lift and difference of cant: measured minus design.",
    advanced=True,
    optional=True,
    kind=POINT,
)
REPORT = FileOutput(
    "REPORT",
    "Report",
    "A web page with an assessment of the result, a map, and plots of each track.",
    optional=True,
    kinds=WEB_PAGES,
)
ALIGNMENT_REPORT = replace(
    REPORT,
    help="A web page with a diagram of each track: curvature, cant, gradient, elements, slews and lifts, to print.",
    on_demand=True,
)
CLASSIFIED: tuple[Output, ...] = (
    FileOutput(
        "OUTPUT",
        "Classified point cloud",
        "A LAZ or LAS file. For a folder of tiles or a virtual point cloud, a virtual point cloud (.vpc) and, next to "
        "it, a folder of the same name with the tiles.",
        kinds="LAZ files (*.laz);;LAS files (*.las);;Virtual point clouds (*.vpc)",
    ),
)
CLASSIFIED_FIGURES = (
    Figure("POINT_COUNT", "Number of points in the cloud"),
    Figure("RAIL_POINTS", "Number of points on rails"),
    Figure("PAIRED_LENGTH", "Length of the rails with a partner [m]"),
    Figure("SINGLE_LENGTH", "Length of the rails without a partner [m]"),
    Figure("CELLS_PER_M", "Cells with points per metre of rail"),
)
RAIL_FIGURES = Figure("RAIL_COUNT", "Number of rails"), Figure("RAIL_LENGTH", "Length of the rails [m]")
CENTERLINE_FIGURES = (
    Figure("CENTERLINE_COUNT", "Number of track centerlines"),
    Figure("CENTERLINE_LENGTH", "Length of the track centerlines [m]"),
)
QUALITY_FIGURES = (
    Figure("STATION_COUNT", "Number of measured stations"),
    Figure("SIGMA", "Standard error of the centerlines, root mean square [mm]"),
    Figure("BRIDGED_LENGTH", "Length of track where a rail has no points [m]"),
)
ALIGNMENT_FIGURES = (
    Figure("ALIGNMENT_COUNT", "Number of alignments"),
    Figure("ELEMENT_COUNT", "Number of elements"),
)
ENGINE_USED = Figure("ENGINE_USED", "Engine that ran the network", "text")


def figures_of(lines: Sequence[Any], what: str) -> dict[str, Any]:
    """Return the number and length of lines: RAIL_COUNT and RAIL_LENGTH if `what` is RAIL."""
    return {f"{what}_COUNT": len(lines), f"{what}_LENGTH": LENGTH.value(sum(line.length_m for line in lines))}


def figures_of_stations(tracks: Sequence[TrackGeometry]) -> dict[str, Any]:
    """Return the number of stations, the standard error and the length without points, as outputs."""
    sigma = [value for track in tracks for value in track.sigma_mm if math.isfinite(value)]
    return {
        "STATION_COUNT": sum(len(track.chainage_m) for track in tracks),
        "SIGMA": SIGMA.value(math.sqrt(sum(value**2 for value in sigma) / len(sigma))) if sigma else None,
        "BRIDGED_LENGTH": BRIDGED.value(sum(track.bridged_m for track in tracks)),
    }
