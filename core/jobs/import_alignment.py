"""Import Alignment: the alignments of a LandXML file as elements and axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..errors import CrsError, ParameterError
from ..progress import Progress
from . import inputs, outputs
from .declaration import (
    ALIGNMENT,
    ALIGNMENT_WORDS,
    LINE_NEEDS,
    POINT,
    RAIL_WORDS,
    FileInput,
    Flag,
    LayerInput,
    LayerOutput,
)
from .result import Result
from .values import Job, Values

if TYPE_CHECKING:
    from ..alignment.elements import Alignment
    from ..alignment.measured import Deviations


def _check(values: Values) -> None:
    """Check that tracks are given where they are needed, and the coordinate system of the file."""
    if not values.filled("TRACKS") and (values.filled("QUALITY") or values.filled("RAILS")):
        raise ParameterError("QUALITY and RAILS state the cant of measured tracks: choose TRACKS.")
    if not values.filled("TRACKS") and (values.wanted("DEVIATIONS") or values.wanted("REPORT")):
        raise ParameterError("DEVIATIONS and REPORT compare measured tracks with the alignments: choose TRACKS.")
    values.prepare(_system(values))


def _system(values: Values) -> str | None:
    """Return the coordinate system of the file as WKT: what it states, else CRS, else that of the tracks."""
    from ..clouds.crs import codes_and_names, parse_crs, units
    from ..files.landxml_reading import stated_system

    stated = stated_system(values["INPUT"]) or values["CRS"]
    if not stated and values.filled("TRACKS"):
        stated = values.system("TRACKS")
    crs = parse_crs(stated) if stated else None
    if crs is not None and units(crs)[0] != 1.0:
        code, name, _ = codes_and_names(crs)
        raise CrsError(
            f"{values['INPUT'].name} is in metres, but its coordinate system {f'EPSG:{code}' if code else name} is "
            "not: choose another CRS, or correct the file."
        )
    return crs.to_wkt() if crs is not None else None


def _run(values: Values, progress: Progress) -> Result:
    """Read the file, and compare the tracks with it."""
    from ..fields import DEVIATIONS
    from ..files.design_files import check_place
    from ..files.landxml_reading import read_landxml
    from ..files.layers import axes_layer, elements_layer, stations_layer
    from ..progress import Recording
    from ..report import build_alignment_page

    progress, path = Recording(progress), values["INPUT"]
    reading, comparing = progress.after_reading()
    read = read_landxml(path, values["EAST_FIRST"], reading)
    frame = replace(read[0].frame, crs_wkt=_system(values))
    alignments = [replace(one, frame=frame) for one in read]
    check_place(path.name, frame, values["EAST_FIRST"], progress)
    courses = _compared(values, alignments, comparing)
    facts = {"LandXML file": path.name, "Command": values.command}
    count = sum(len(alignment.elements) for alignment in alignments)
    layers = {"ELEMENTS": lambda: elements_layer(alignments, progress), "AXIS": lambda: axes_layer(alignments)}
    pages = {}
    if values.filled("TRACKS"):
        layers["DEVIATIONS"] = lambda: stations_layer(DEVIATIONS, [one for _, one in courses])
        pages["REPORT"] = lambda: build_alignment_page(courses, values.title("TRACKS"), facts, False, progress.warnings)
    return Result(
        {"ALIGNMENT_COUNT": len(alignments), "ELEMENT_COUNT": count},
        frame,
        layers,
        pages,
        (f"{len(alignments)} alignments, {count} elements",),
    )


def _compared(
    values: Values, alignments: Sequence[Alignment], progress: Progress
) -> list[tuple[Alignment, Deviations]]:
    """Return the deviations of each track with the alignment beside it; none without tracks."""
    from ..alignment.measured import compared_with
    from .clouds import check_same_plane
    from .track_inputs import read_tracks

    if not values.filled("TRACKS"):
        return []
    tracks, theirs = read_tracks(values, "TRACKS", progress)
    check_same_plane("TRACKS", theirs.crs_wkt, "INPUT", alignments[0].frame)
    shift = theirs.shift_to(alignments[0].frame)
    return compared_with(alignments, [replace(one, xyz=one.xyz + shift) for one in tracks], progress)


JOB = Job(
    "importalignment",
    "Import alignment",
    "Reads the alignments of a LandXML file as an element table and as axes with kilometres.",
    "Reads lines, arcs and clothoids, profiles with circles or parabolas, cant and station equations. Other "
    "transition curves are refused.\n\n"
    "The element table is that of Fit Alignment: it can be edited and exported. The axes have kilometres as M "
    "values: Station Along Axis takes them.\n\n"
    "With measured tracks that lie along the alignments, the run states how far they lie off them: slews, lifts, "
    "with track geometry or rails the cant, and a report with a diagram of each track.",
    (*RAIL_WORDS, *ALIGNMENT_WORDS, "LandXML", "import", "design", "axis", "tamping"),
    LINE_NEEDS,
    (
        FileInput(
            "INPUT",
            "LandXML file",
            "LandXML 1.0 to 1.2 in metres, with alignments of lines, arcs and clothoids.",
            kinds="LandXML files (*.xml *.landxml);;All files (*)",
        ),
        replace(
            inputs.CRS,
            label="CRS of a file without one",
            help="Projected coordinate system in metres for a file that does not state one; other files keep their "
            "own.",
        ),
        Flag(
            "EAST_FIRST",
            "Points are written easting first",
            "For files that, against the format, write the easting of points before their northing. All curves of "
            "such a file turn to the other side than it states.",
            advanced=True,
            default=False,
        ),
        LayerInput(
            "TRACKS",
            "Measured tracks",
            "Centerlines that lie along the alignments, for deviations and report; each is compared with the alignment "
            "beside it, up to 2 m away.",
            optional=True,
        ),
        LayerInput(
            "QUALITY",
            "Track geometry",
            "Points of Extract Rails or Measure Track Geometry for these tracks, with the cant.",
            advanced=True,
            optional=True,
            kinds=(POINT,),
        ),
        inputs.RAILS_OF_CANT,
    ),
    (
        outputs.ELEMENTS_OUTPUT,
        LayerOutput(
            "AXIS",
            "Axes",
            "A line for each alignment, less than a millimetre off the exact curve, with kilometres as M values.",
            optional=True,
        ),
        replace(outputs.DEVIATIONS_OUTPUT, on_demand=True),
        outputs.ALIGNMENT_REPORT,
    ),
    outputs.ALIGNMENT_FIGURES,
    ALIGNMENT,
    picture="alignment.svg",
    guide="alignment_files",
    call="import_alignment",
    check=_check,
    run=_run,
)
