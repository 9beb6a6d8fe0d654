"""Export Alignment: the elements of tracks as a file for design software, LandXML, IFC or DXF."""

from __future__ import annotations

from dataclasses import replace

from .. import VERSION
from ..progress import Progress
from . import inputs, outputs
from .declaration import (
    ALIGNMENT,
    ALIGNMENT_WORDS,
    LINE_NEEDS,
    RAIL_WORDS,
    TABLE,
    Choice,
    FileOutput,
    LayerInput,
)
from .result import Result
from .values import Job, Values

CIRCLES, PARABOLAS = VERTICAL_CURVES = ("CIRCLES", "PARABOLAS")


def _check(values: Values) -> None:
    """Check the rail and the name of the file."""
    from ..files.design_files import check_format

    values.standard()
    values.prepare(values.system("INPUT") or values["CRS"])
    check_format(values.path("OUTPUT"))


def _run(values: Values, progress: Progress) -> Result:
    """Read the table, check it and write the file."""
    from ..files.design_files import check_designs, left_out, write_designs
    from .track_inputs import read_elements

    reading, rest = progress.after_reading()
    checking, writing = rest.split(2)
    alignments = read_elements(values, "INPUT", values["CRS"], reading)
    check_designs(alignments, checking)
    circles, destination = values["VERTICAL_CURVES"] == CIRCLES, values.destination("OUTPUT")
    with destination.replacing() as new:
        write_designs(new, alignments, values.standard(), circles, VERSION, writing)
    count = sum(len(alignment.elements) for alignment in alignments)
    figures = {"OUTPUT": str(destination.path), "ALIGNMENT_COUNT": len(alignments), "ELEMENT_COUNT": count}
    said = f"{len(alignments)} alignments, {count} elements"
    return Result(figures, alignments[0].frame, sentences=(said, left_out(destination.path, alignments)))


JOB = Job(
    "exportalignment",
    "Export alignment",
    "Writes the elements of tracks as LandXML, IFC or DXF for design software.",
    "Takes the element table of Fit Alignment or Import Alignment. The name of the file decides the format:\n\n"
    ".xml: LandXML 1.2 with plan, profile, cant and station equations. Points are written northing first.\n\n"
    ".ifc: IFC 4.3 with the elements, the curves that viewers show, referents at the stations, and the place on "
    "the map.\n\n"
    ".dxf: a 3D polyline for each track, and a point with a text where each element begins, on layers by track.\n\n"
    "Heights are those of the centerline, midway between the rails. Coordinates must be in metres. Gauge and "
    "railhead width give the distance across which cant is measured.",
    (*RAIL_WORDS, *ALIGNMENT_WORDS, "LandXML", "IFC", "DXF", "export", "BIM", "CAD"),
    LINE_NEEDS,
    (
        LayerInput(
            "INPUT",
            "Elements",
            "Element table of Fit Alignment or Import Alignment; it may be edited. Its geometries are not used.",
            kinds=(TABLE,),
        ),
        replace(
            inputs.CRS,
            label="CRS of a table without one",
            help="Projected coordinate system in metres for a table without geometries; other tables keep their own.",
        ),
        *inputs.RAIL,
        Choice(
            "VERTICAL_CURVES",
            "Curves of the profile in LandXML",
            "CIRCLES writes circles, as railways state them; PARABOLAS writes parabolas of the same length. Between "
            "the same gradients they differ by less than a millimetre.",
            advanced=True,
            options=VERTICAL_CURVES,
            default=CIRCLES,
        ),
    ),
    (
        FileOutput(
            "OUTPUT",
            "File for design software",
            "The name decides the format: .xml is LandXML 1.2, .ifc is IFC 4.3, .dxf is DXF of release 12.",
            kinds="LandXML files (*.xml);;IFC files (*.ifc);;DXF files (*.dxf)",
        ),
    ),
    outputs.ALIGNMENT_FIGURES,
    ALIGNMENT,
    picture="alignment.svg",
    guide="alignment_files",
    call="export_alignment",
    check=_check,
    run=_run,
)
