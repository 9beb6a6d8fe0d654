"""Files for design software as the last step of a run: which format, what a file states, and where its tracks are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..alignment.elements import Alignment
from ..clouds.crs import codes_and_names, lies_in_area, name_of, parse_crs
from ..errors import AlignmentFileError, CrsError, ParameterError
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from ..standards import RailStandard
from .design import Delivery, check_joined
from .exchange import write_alignments
from .ifc import write_ifc
from .landxml import write_landxml

FORMATS = {".xml": "LandXML", ".landxml": "LandXML", ".ifc": "IFC", ".dxf": "DXF"}
"""Format of a file by the ending of its name."""

_OF_FIT = "how well the elements fit the measured track: deviations and standard errors"

LEFT_OUT = {
    "LandXML": _OF_FIT,
    "IFC": _OF_FIT,
    "DXF": "the coordinate system, stations and deviations, nor elements: curves are polylines, and texts name them",
}
"""What the element table has and a file of a format has not."""


def check_format(path: Path) -> None:
    """Check that the name of a file states a format."""
    if path.suffix.lower() not in FORMATS:
        raise ParameterError(f"OUTPUT can't be {path.name}: let it end in .xml for LandXML, in .ifc or in .dxf.")


def check_designs(alignments: Sequence[Alignment], progress: Progress) -> None:
    """Check that alignments can be written; warn of what a format leaves out.

    Raises CrsError if they are in feet, and ParameterError if an element does not begin where the one before it ends.
    """
    frame = alignments[0].frame
    if (frame.horizontal_unit_m, frame.vertical_unit_m) != (1.0, 1.0):
        raise CrsError(
            "INPUT is in feet, and files for design software are written in metres: fit the lines in a coordinate "
            "system in metres."
        )
    for alignment in progress.follow(alignments):
        check_joined(alignment, progress)
        if alignment.cant and not alignment.vertical:
            progress.warning(f"Track {alignment.track_id} has cant but no profile: IFC files leave the cant out.")


def write_designs(
    path: Path,
    alignments: Sequence[Alignment],
    standard: RailStandard,
    circles: bool,
    version: str,
    progress: Progress = SILENT,
) -> None:
    """Write alignments in the format that the name of a file states; see `Delivery` and `write_landxml`."""
    kind = FORMATS[path.suffix.lower()]
    wkt = alignments[0].frame.crs_wkt
    epsg, system, heights = codes_and_names(parse_crs(wkt)) if wkt else (None, "", "")
    delivery = Delivery(standard.gauge_m, standard.head_width_m, epsg, system, heights, version)
    if kind == "LandXML":
        write_landxml(path, alignments, delivery, circles, progress)
    elif kind == "IFC":
        write_ifc(path, alignments, delivery, progress)
    else:
        write_alignments(path, alignments, progress)


def left_out(path: Path, alignments: Sequence[Alignment]) -> str:
    """Say what a file does not hold: what its format has no place for, and layouts that the table does not have."""
    said = [f"{path.name} does not hold {LEFT_OUT[FORMATS[path.suffix.lower()]]}."]
    for layout, name in (("vertical", "profile"), ("cant", "cant")):
        without = [str(one.track_id) for one in alignments if not getattr(one, layout)]
        if without:
            said.append(f"No {name} of {'track' if len(without) == 1 else 'tracks'} {', '.join(without)}.")
    return " ".join(said)


def check_place(name: str, frame: LocalFrame, east_first: bool, progress: Progress) -> None:
    """Refuse easting and northing that are exchanged, as the area of the system shows; warn of other places."""
    if frame.crs_wkt is None:
        progress.warning(f"{name} has no coordinate system: choose CRS to see its tracks in their place.")
        return
    crs, (x, y, _) = parse_crs(frame.crs_wkt), frame.origin
    if lies_in_area(crs, (x, y)):
        return
    if lies_in_area(crs, (y, x)):
        first, remedy = ("northing", "leave EAST_FIRST off") if east_first else ("easting", "set EAST_FIRST")
        raise AlignmentFileError(
            f"{name} is in the area of {name_of(crs)} if its points are written {first} first: {remedy}."
        )
    progress.warning(f"{name} is outside the area of {name_of(crs)}: check its coordinate system.")
