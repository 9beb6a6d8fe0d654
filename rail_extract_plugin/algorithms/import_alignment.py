"""Import Alignment: the alignments of a LandXML file as elements and axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import QgsProcessingFeatureSource

from ...core.errors import CrsError, ParameterError
from ...core.progress import Progress, Recording
from ..dialog import inputs, outputs
from ..dialog.definitions import Definitions
from ..dialog.parameter_values import ParameterValues
from ..systems import prepare_system
from ..writing.layers import layer_writers
from ..writing.reports import write_alignment_report
from ..writing.whole_files import write_each
from .base import ALIGNMENT_WORDS, RAIL_WORDS, RailAlgorithm
from .toolbox_groups import ALIGNMENT

if TYPE_CHECKING:
    from ...core.alignment.deviations import Deviations
    from ...core.alignment.elements import Alignment
    from ...core.frame import LocalFrame

READING = 0.7
"""Fraction of the progress bar at which the file is read."""


@dataclass(frozen=True)
class Job:
    """The file, its coordinate system as WKT, None without one, and how it is read and compared."""

    path: Path
    crs_wkt: str | None
    east_first: bool
    tracks: QgsProcessingFeatureSource | None
    quality: QgsProcessingFeatureSource | None
    rails: QgsProcessingFeatureSource | None
    command: str


class ImportAlignment(RailAlgorithm):
    """The algorithm ``railextract:importalignment``."""

    NAME = "importalignment"
    LABEL = "Import alignment"
    GROUP = ALIGNMENT
    TAGS = (*RAIL_WORDS, *ALIGNMENT_WORDS, "LandXML", "import", "design", "axis", "tamping")
    NEEDS = (("numpy",), ("scipy",), ("pyproj",))
    SUMMARY = "Reads the alignments of a LandXML file as an element table and as axes with kilometres."
    PICTURE = "alignment.svg"
    GUIDE = "alignment_files"
    HELP = (
        "Reads lines, arcs and clothoids, profiles with circles or parabolas, cant and station equations. Other "
        "transition curves are refused.\n\n"
        "The element table is that of Fit Alignment: it can be edited and exported. The axes have kilometres as M "
        "values: Station Along Axis takes them.\n\n"
        "With measured tracks that lie along the alignments, the run states how far they lie off them: slews, lifts, "
        "with track geometry or rails the cant, and a report with a diagram of each track."
    )

    def definitions(self) -> Definitions:
        """Return the parameters and outputs in the order of the interface."""
        return (
            *inputs.landxml(),
            inputs.tracks_beside_design(),
            *inputs.cant_beside_design(),
            outputs.elements(),
            outputs.axes(),
            outputs.further(outputs.on_demand(outputs.deviations())),
            outputs.on_demand(outputs.alignment_report()),
            *outputs.alignment_figures(),
        )

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters and the coordinate system of the file, in the main thread."""
        from ...core.alignment.landxml_reading import stated_system
        from ...core.clouds.crs import parse_crs, units
        from ..reading.line_layers import wkt_of

        path, crs = Path(values.text("INPUT")), values.projected_crs()
        tracks = values.lines("TRACKS") if values.filled("TRACKS") else None
        quality = values.table("QUALITY") if values.filled("QUALITY") else None
        rails = values.lines("RAILS") if values.filled("RAILS") else None
        if tracks is None and (quality or rails):
            raise ParameterError("QUALITY and RAILS state the cant of measured tracks: choose TRACKS.")
        if tracks is None and (values.wanted("DEVIATIONS") or values.wanted("REPORT")):
            raise ParameterError("DEVIATIONS and REPORT compare measured tracks with the alignments: choose TRACKS.")
        stated = stated_system(path)
        crs = tracks.sourceCrs() if tracks is not None and not crs.isValid() else crs
        wkt = parse_crs(stated).to_wkt() if stated else wkt_of(crs) or None
        if wkt and units(parse_crs(wkt))[0] != 1.0:
            raise CrsError(
                f"{path.name} is in metres, but its coordinate system {stated or crs.authid()} is not: choose another "
                "CRS, or correct the file."
            )
        prepare_system(wkt)
        command = values.command()
        return Job(path, wkt, values.flag("EAST_FIRST"), tracks, quality, rails, command)

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Read the file and write the layers."""
        from ...core.alignment.landxml_reading import read_landxml
        from ...core.fields import DEVIATIONS
        from ...core.output.design_files import check_place
        from ...core.output.layers import axes_layer, elements_layer, stations_layer

        progress = Recording(progress)
        read = read_landxml(job.path, job.east_first, progress.span(0, READING))
        frame = replace(read[0].frame, crs_wkt=job.crs_wkt)
        alignments = tuple(replace(one, frame=frame) for one in read)
        check_place(job.path.name, frame, job.east_first, progress)
        courses = _compared(job, alignments, frame, progress.span(READING, 1))
        deviations = [one for _, one in courses]
        facts = {"LandXML file": job.path.name, "Command": job.command}
        makers = {
            "ELEMENTS": lambda: elements_layer(alignments, progress),
            "AXIS": lambda: axes_layer(alignments),
            "DEVIATIONS": lambda: stations_layer(DEVIATIONS, deviations),
        }
        writers = {
            **layer_writers(values, makers, frame),
            "REPORT": lambda: write_alignment_report(values, courses, _name(job), facts, False, progress.warnings),
        }
        count = sum(len(alignment.elements) for alignment in alignments)
        written = write_each(writers, values)
        return {**written, "ALIGNMENT_COUNT": len(alignments), "ELEMENT_COUNT": count}


def _name(job: Job) -> str:
    """Return the name of the layer of tracks."""
    return job.tracks.sourceName() if job.tracks is not None else ""


def _compared(
    job: Job, alignments: Sequence[Alignment], frame: LocalFrame, progress: Progress
) -> list[tuple[Alignment, Deviations]]:
    """Return the deviations of each track with the alignment beside it; none without tracks."""
    from ...core.alignment.deviations import compared_with
    from ...core.alignment.measured import moved
    from ..reading.area_points import check_same_plane
    from ..reading.tracks_to_fit import read_tracks

    if job.tracks is None:
        return []
    tracks, theirs = read_tracks(job.tracks, job.quality, job.rails, progress, "TRACKS")
    check_same_plane("TRACKS", theirs.crs_wkt, "INPUT", frame)
    shift = theirs.shift_to(frame)
    return compared_with(alignments, [moved(one, shift) for one in tracks], progress)
