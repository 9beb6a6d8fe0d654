"""Export Alignment: the elements of tracks as a file for design software, LandXML, IFC or DXF."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from qgis.core import QgsCoordinateReferenceSystem, QgsProcessingFeatureSource

from ...core import VERSION
from ...core.disk import Destination
from ...core.progress import Progress
from ...core.standards import RailStandard
from ..dialog import inputs, outputs
from ..dialog import parameters as groups
from ..dialog.definitions import Definitions
from ..dialog.parameter_values import ParameterValues
from ..systems import prepare_system
from .base import ALIGNMENT_WORDS, RAIL_WORDS, RailAlgorithm
from .toolbox_groups import ALIGNMENT

READING, CHECKED = 0.5, 0.7
"""Fractions of the progress bar at which the table is read, and checked."""


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    source: QgsProcessingFeatureSource
    crs: QgsCoordinateReferenceSystem
    standard: RailStandard
    path: Path
    circles: bool


class ExportAlignment(RailAlgorithm):
    """The algorithm ``railextract:exportalignment``."""

    NAME = "exportalignment"
    LABEL = "Export alignment"
    GROUP = ALIGNMENT
    TAGS = (*RAIL_WORDS, *ALIGNMENT_WORDS, "LandXML", "IFC", "DXF", "export", "BIM", "CAD")
    NEEDS = (("numpy",), ("scipy",), ("pyproj",))
    SUMMARY = "Writes the elements of tracks as LandXML, IFC or DXF for design software."
    PICTURE = "alignment.svg"
    GUIDE = "alignment_files"
    HELP = (
        "Takes the element table of Fit Alignment or Import Alignment. The name of the file decides the format:\n\n"
        ".xml: LandXML 1.2 with plan, profile, cant and station equations. Points are written northing first.\n\n"
        ".ifc: IFC 4.3 with the elements, the curves that viewers show, referents at the stations, and the place on "
        "the map.\n\n"
        ".dxf: a 3D polyline for each track, and a point with a text where each element begins, on layers by track.\n\n"
        "Heights are those of the centerline, midway between the rails. Coordinates must be in metres. Gauge and "
        "railhead width give the distance across which cant is measured."
    )

    def definitions(self) -> Definitions:
        """Return the parameters and outputs in the order of the interface."""
        return (
            *inputs.elements(),
            *groups.rail(),
            groups.vertical_curves(),
            outputs.alignment_file(),
            *outputs.alignment_figures(),
        )

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        from ...core.output.design_files import check_format
        from ..reading.line_layers import wkt_of

        source = values.table("INPUT")
        crs = source.sourceCrs() if source.sourceCrs().isValid() else values.projected_crs()
        prepare_system(wkt_of(crs) or None)
        path = Path(values.output_file("OUTPUT"))
        check_format(path)
        circles = values.choice("VERTICAL_CURVES") == groups.VERTICAL_CURVES[0]
        return Job(source, crs, values.standard(), path, circles)

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Read the table, check it and write the file."""
        from ...core.output.design_files import check_designs, write_designs
        from ..reading.element_tables import read_elements

        alignments, _ = read_elements(job.source, job.crs, progress.span(0, READING))
        check_designs(alignments, progress.span(READING, CHECKED))
        destination = self.destinations.get("OUTPUT") or Destination.at(job.path)
        with destination.replacing() as new:
            write_designs(new, alignments, job.standard, job.circles, VERSION, progress.span(CHECKED, 1))
        count = sum(len(alignment.elements) for alignment in alignments)
        return {"OUTPUT": str(job.path), "ALIGNMENT_COUNT": len(alignments), "ELEMENT_COUNT": count}
