"""Import Alignment: the alignments of a LandXML file as elements and axes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import QgsProcessingContext

from ...core.errors import AlignmentFileError, CrsError
from ...core.progress import Progress
from ..dialog import inputs, outputs
from ..dialog.parameter_values import ParameterValues
from ..systems import prepare_system
from ..writing.layers import write_axes, write_elements
from ..writing.whole_files import write_each
from .base import ALIGNMENT_WORDS, RAIL_WORDS, RailAlgorithm
from .toolbox_groups import ALIGNMENT

if TYPE_CHECKING:
    from ...core.frame import LocalFrame

READING = 0.7
"""Fraction of the progress bar at which the file is read."""


@dataclass(frozen=True)
class Job:
    """The file, its coordinate system as WKT, None without one, and whether its points are written easting first."""

    path: Path
    crs_wkt: str | None
    east_first: bool


class ImportAlignment(RailAlgorithm):
    """The algorithm ``railextract:importalignment``."""

    NAME = "importalignment"
    LABEL = "Import alignment"
    GROUP = ALIGNMENT
    TAGS = (*RAIL_WORDS, *ALIGNMENT_WORDS, "LandXML", "import", "design", "axis", "tamping")
    NEEDS = (("numpy",), ("scipy",), ("pyproj",))
    SUMMARY = "Reads the alignments of a LandXML file as an element table and as axes with kilometres."
    PICTURE = "alignment.svg"
    HELP = (
        "Reads lines, arcs and clothoids, profiles with circles or parabolas, cant and station equations. Other "
        "transition curves are refused.\n\n"
        "The element table is that of Fit Alignment: it can be edited and exported. The axes have kilometres as M "
        "values: Station Along Axis takes them."
    )

    def initAlgorithm(self, config: dict[str, Any] | None = None) -> None:
        """Declare the parameters and outputs in the order of the interface."""
        for definition in (*inputs.landxml(), outputs.elements(), outputs.axes()):
            self.addParameter(definition)
        for output in outputs.alignment_figures():
            self.addOutput(output)

    def read(self, parameters: dict[str, Any], context: QgsProcessingContext) -> Job:
        """Read and check the parameters and the coordinate system of the file, in the main thread."""
        from ...core.alignment.landxml_reading import stated_system
        from ...core.clouds.crs import parse_crs, units
        from ..reading.line_layers import wkt_of

        values = ParameterValues(self, parameters, context)
        path, crs = Path(self.parameterAsFile(parameters, "INPUT", context)), values.projected_crs()
        stated = stated_system(path)
        wkt = parse_crs(stated).to_wkt() if stated else wkt_of(crs) or None
        if wkt and units(parse_crs(wkt))[0] != 1.0:
            raise CrsError(
                f"{path.name} is in metres, but its coordinate system {stated or crs.authid()} is not: choose another "
                "CRS, or correct the file."
            )
        prepare_system(wkt)
        return Job(path, wkt, values.flag("EAST_FIRST"))

    def compute(
        self, job: Job, parameters: dict[str, Any], context: QgsProcessingContext, progress: Progress
    ) -> dict[str, Any]:
        """Read the file and write the layers."""
        from ...core.alignment.landxml_reading import read_landxml

        read = read_landxml(job.path, job.east_first, progress.span(0, READING))
        frame = replace(read[0].frame, crs_wkt=job.crs_wkt)
        alignments = tuple(replace(one, frame=frame) for one in read)
        _check_place(job, frame, progress)
        rest = (alignments, frame, parameters, context)
        writers = {
            "ELEMENTS": lambda: write_elements(self, "ELEMENTS", *rest),
            "AXIS": lambda: write_axes(self, "AXIS", *rest),
        }
        count = sum(len(alignment.elements) for alignment in alignments)
        written = write_each(writers, parameters, context)
        return {**written, "ALIGNMENT_COUNT": len(alignments), "ELEMENT_COUNT": count}


def _check_place(job: Job, frame: LocalFrame, progress: Progress) -> None:
    """Refuse easting and northing that are exchanged, as the area of the coordinate system shows; warn of other places.

    Raises
    ------
    AlignmentFileError
    """
    from ...core.clouds.crs import lies_in_area, name_of, parse_crs

    if job.crs_wkt is None:
        progress.warning(f"{job.path.name} states no coordinate system: choose CRS to see its tracks in their place.")
        return
    crs, (x, y, _) = parse_crs(job.crs_wkt), frame.origin
    if lies_in_area(crs, (x, y)):
        return
    if lies_in_area(crs, (y, x)):
        first, remedy = ("northing", "leave EAST_FIRST off") if job.east_first else ("easting", "set EAST_FIRST")
        raise AlignmentFileError(
            f"{job.path.name} lies in the area of {name_of(crs)} if its points are written {first} first: {remedy}."
        )
    progress.warning(f"{job.path.name} lies outside the area of {name_of(crs)}: check its coordinate system.")
