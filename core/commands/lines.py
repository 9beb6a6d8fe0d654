"""The commands that take lines and alignments: `fit`, `export-alignment`, `import-alignment`, `compare`, `stations`."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from .. import VERSION
from ..alignment.deviations import compared_with
from ..alignment.elements import Alignment
from ..alignment.fit import fit_tracks
from ..alignment.landxml_reading import read_landxml, stated_system
from ..alignment.measured import moved
from ..clouds.crs import parse_crs, units
from ..comparison.tracks import Survey, compare_surveys, doubts_of
from ..errors import CrsError, ParameterError
from ..fields import DEVIATIONS
from ..output.design_files import FORMATS, check_designs, check_format, check_place, write_designs
from ..output.layers import axes_layer, differences_layer, elements_layer, stations_layer
from ..parameters import TRANSITIONS, ComparisonParameters, FitParameters
from ..progress import Estimating, Progress, Recording
from ..report import build_alignment_page
from ..report.comparison import build_comparison, describe_shift, verdict_on
from ..standards import resolve
from .options import (
    REPORT,
    TABLE,
    WRITING,
    Console,
    add_axis_arguments,
    add_length,
    add_outputs,
    add_standard_arguments,
    destination_of,
    destinations_of,
    vector_module,
)

CRS_HELP = "coordinate system of a {} that states none, such as EPSG:25832"

FIT_OUTPUTS = {
    "elements": (TABLE, "GeoPackage for the elements"),
    "deviations": (TABLE, "GeoPackage for slews, lifts and cant"),
    "report": (REPORT, "HTML file for the diagrams"),
}
IMPORT_OUTPUTS = {
    "elements": (TABLE, "GeoPackage for the element table"),
    "axis": (TABLE, "GeoPackage for axes with kilometres as M values"),
    "deviations": (TABLE, "GeoPackage for slews, lifts, cant of TRACKS"),
    "report": (REPORT, "HTML file for the diagrams of TRACKS"),
}
COMPARE_OUTPUTS = {
    "output": (TABLE, "GeoPackage for the differences"),
    "report": (REPORT, "HTML file for the report"),
}

CURVES = ("CIRCLES", "PARABOLAS")
"""Curves of the profile in LandXML."""


def fit(parser: argparse.ArgumentParser) -> None:
    """Declare the command that fits design elements."""
    parser.add_argument("lines", metavar="LINES", help="3D lines of tracks; FILE|layername=NAME names a layer")
    parser.add_argument("--quality", metavar="FILE", help="track geometry of these tracks, with the cant")
    parser.add_argument("--rails", metavar="FILE", help="rails of these tracks, with the cant")
    parser.add_argument("--fixed", metavar="FILE", help="corrected element table: what was changed is held")
    default = FitParameters()
    text = "how far the track may be off its design"
    add_length(parser, "--tolerance", 1000 * default.tolerance_m, text, "MM")
    add_length(parser, "--min-length", default.min_length_m, "least length of an element")
    text = f"whether the curvature may jump (default: {default.transitions})"
    parser.add_argument("--transitions", choices=TRANSITIONS, default=default.transitions, help=text)
    parser.add_argument("--no-round", action="store_true", help="do not propose round radii")
    add_outputs(parser, FIT_OUTPUTS, required="elements")
    parser.set_defaults(run=_fit)


def _fit(args: argparse.Namespace) -> None:
    """Fit and write."""
    vectors, writing = (vector_module("LINES", name) for name in ("vectors", WRITING))
    outputs = destinations_of(args, FIT_OUTPUTS)
    settings = FitParameters(args.tolerance / 1000.0, args.min_length, args.transitions, not args.no_round)
    tracks, frame = vectors.read_tracks(args.lines, args.quality, args.rails)
    progress = Recording(Estimating(Console()))
    held = [] if args.fixed is None else vectors.read_elements(args.fixed, "--fixed", progress=progress)
    fits = fit_tracks(tracks, frame, settings, {one.track_id: one for one in held}, progress)
    made = [elements_layer([fit.alignment for fit in fits])]
    if "deviations" in outputs:
        made.append(stations_layer(DEVIATIONS, [fit.deviations for fit in fits]))
    writing.write_all(made, outputs, frame)
    if "report" in outputs:
        courses = [(fit.alignment, fit.deviations) for fit in fits]
        facts = {"Command": args.command_line}
        outputs["report"].write_text(build_alignment_page(courses, args.lines, facts, True, progress.warnings))
    for one in fits:
        count = len(one.alignment.elements)
        print(f"Track {one.alignment.track_id}: {count} elements, root mean square {one.rms_mm:.2f} mm")


def export_alignment(parser: argparse.ArgumentParser) -> None:
    """Declare the command that writes files for design software."""
    parser.add_argument("elements", metavar="ELEMENTS", help="element table of fit or import-alignment, also edited")
    parser.add_argument("output", type=Path, metavar="OUTPUT", help="file that ends in .xml (LandXML), .ifc or .dxf")
    add_standard_arguments(parser)
    text = f"curves of the profile in LandXML (default: {CURVES[0]})"
    parser.add_argument("--vertical-curves", choices=CURVES, default=CURVES[0], help=text)
    parser.add_argument("--crs", help=CRS_HELP.format("table"))
    parser.set_defaults(run=_export_alignment)


def _export_alignment(args: argparse.Namespace) -> None:
    """Read the table, check it and write the file."""
    check_format(args.output)
    standard = resolve(args.standard, args.gauge, args.head_width)
    destination = destination_of("output", args.output, tuple(FORMATS))
    progress = Estimating(Console())
    alignments = vector_module("ELEMENTS").read_elements(args.elements, "ELEMENTS", args.crs, progress)
    check_designs(alignments, progress)
    with destination.replacing() as new:
        write_designs(new, alignments, standard, args.vertical_curves == CURVES[0], VERSION)
    _print_count(alignments)


def import_alignment(parser: argparse.ArgumentParser) -> None:
    """Declare the command that reads LandXML."""
    parser.add_argument("file", type=Path, metavar="FILE", help="LandXML file")
    parser.add_argument("--crs", help=CRS_HELP.format("file"))
    parser.add_argument("--east-first", action="store_true", help="the points of the file have the easting first")
    text = "measured centerlines: how far they lie off the alignments beside them"
    parser.add_argument("--tracks", metavar="LINES", help=text)
    parser.add_argument("--quality", metavar="FILE", help="track geometry of TRACKS, with the cant")
    parser.add_argument("--rails", metavar="FILE", help="rails of TRACKS, with the cant")
    add_outputs(parser, IMPORT_OUTPUTS)
    parser.set_defaults(run=_import_alignment)


def _import_alignment(args: argparse.Namespace) -> None:
    """Read the file and write."""
    outputs = destinations_of(args, IMPORT_OUTPUTS)
    if not outputs:
        raise ParameterError("Give --elements, --axis, --deviations or --report for what is wanted of the file.")
    if args.tracks is None and (args.quality or args.rails or {"deviations", "report"} & set(outputs)):
        raise ParameterError("--deviations and --report compare measured tracks with the alignments: give --tracks.")
    vectors, writing = (vector_module("import-alignment", name) for name in ("vectors", WRITING))
    progress = Recording(Estimating(Console()))
    tracks, own = vectors.read_tracks(args.tracks, args.quality, args.rails, "--tracks") if args.tracks else ([], None)
    alignments = _read_alignments(args, own and own.crs_wkt, progress)
    frame = alignments[0].frame
    courses = []
    if args.tracks:
        shift = vectors.shift_between("--tracks", own, frame)
        courses = compared_with(alignments, [moved(one, shift) for one in tracks], progress)
    makers = {
        "elements": lambda: elements_layer(alignments),
        "axis": lambda: axes_layer(alignments),
        "deviations": lambda: stations_layer(DEVIATIONS, [one for _, one in courses]),
    }
    writing.write_all([make() for name, make in makers.items() if name in outputs], outputs, frame)
    if "report" in outputs:
        facts = {"LandXML file": args.file.name, "Command": args.command_line}
        outputs["report"].write_text(build_alignment_page(courses, args.tracks, facts, False, progress.warnings))
    _print_count(alignments)


def _read_alignments(args: argparse.Namespace, tracks: str | None, progress: Progress) -> list[Alignment]:
    """Read the alignments of a LandXML file, given the coordinate system of the tracks for a file that states none."""
    system = stated_system(args.file) or args.crs or tracks
    wkt = parse_crs(system).to_wkt() if system else None
    if wkt and units(parse_crs(wkt))[0] != 1.0:
        raise CrsError(
            f"{args.file.name} is in metres, but its coordinate system {system} is not: choose another --crs, or "
            "correct the file."
        )
    read = read_landxml(args.file, args.east_first, progress)
    frame = replace(read[0].frame, crs_wkt=wkt)
    check_place(args.file.name, frame, args.east_first, progress)
    return [replace(one, frame=frame) for one in read]


def compare(parser: argparse.ArgumentParser) -> None:
    """Declare the command that compares surveys."""
    parser.add_argument("reference", metavar="REFERENCE", help="lines of the earlier survey, design or control")
    parser.add_argument("input", metavar="INPUT", help="lines of the other survey; FILE|layername=NAME names a layer")
    text = "rails of the reference, if its lines are centerlines"
    parser.add_argument("--reference-rails", metavar="FILE", help=text)
    parser.add_argument("--rails", metavar="FILE", help="rails of the other survey")
    for name in ("reference", "input"):
        text = "standard error of lines that state none; 0 for a design"
        parser.add_argument(f"--{name}-sigma", type=float, metavar="MM", help=text)
    default = ComparisonParameters()
    add_length(parser, "--reach", default.reach_m, "largest distance at which two lines are the same")
    add_length(parser, "--step", default.step_m, "distance between stations")
    text = "a constant shift between the surveys counts as a movement, as it should against a design"
    parser.add_argument("--count-shift", action="store_true", help=text)
    add_outputs(parser, COMPARE_OUTPUTS)
    parser.set_defaults(run=_compare)


def _compare(args: argparse.Namespace) -> None:
    """Compare and write."""
    if (args.rails is None) != (args.reference_rails is None):
        raise ParameterError(
            "Gauge and cant are compared between the rails of both: give --rails and --reference-rails."
        )
    outputs = destinations_of(args, COMPARE_OUTPUTS)
    vectors, writing = (vector_module("compare", name) for name in ("vectors", WRITING))
    lines, frame = vectors.read_survey(args.reference, "REFERENCE", None)
    earlier = Survey(lines, sigma_m=_metres(args.reference_sigma))
    later = Survey(vectors.read_survey(args.input, "INPUT", frame)[0], sigma_m=_metres(args.input_sigma))
    if args.rails is not None:
        earlier = replace(earlier, rails=vectors.read_rails(args.reference_rails, "--reference-rails", frame))
        later = replace(later, rails=vectors.read_rails(args.rails, "--rails", frame))
    progress = Estimating(Console())
    found = compare_surveys(earlier, later, ComparisonParameters(args.reach, args.step, not args.count_shift), progress)
    for sentence in doubts_of(found):
        progress.warning(sentence)
    if "output" in outputs:
        writing.write_layers([differences_layer(found)], outputs["output"], frame)
    if "report" in outputs:
        facts = {"Date": f"{datetime.now():%Y-%m-%d %H:%M}", "Command": args.command_line}
        source = f"{args.input} against {args.reference}"
        outputs["report"].write_text(build_comparison(found, args.count_shift, source, facts))
    print(verdict_on(found))
    print(describe_shift(found))


def stations(parser: argparse.ArgumentParser) -> None:
    """Declare the command that gives features their kilometres."""
    parser.add_argument("input", metavar="INPUT", help="any layer; FILE|layername=NAME names a layer of a file")
    parser.add_argument("axis", metavar="AXIS", help="line layer that carries the kilometres")
    parser.add_argument("output", type=Path, metavar="OUTPUT", help="GeoPackage for the features with kilometres")
    add_axis_arguments(parser)
    parser.set_defaults(run=_stations)


def _stations(args: argparse.Namespace) -> None:
    """Locate the features and write them with their kilometres."""
    vectors, kilometres = (vector_module("stations", name) for name in ("vectors", "kilometres"))
    output = destination_of("output", args.output, TABLE)
    places = vectors.read_features(args.input, "INPUT")
    axes, plane = kilometres.read_axes(args, places.crs_wkt)
    fields, columns = kilometres.located(places, axes, plane, Estimating(Console()))
    kilometres.write_copy(output, places, fields, columns)
    known = sum(math.isfinite(km) for km in columns[[field.name for field in fields].index("km")])
    print(f"{known} of {len(places.ids)} features have a kilometre")


def _metres(sigma_mm: float | None) -> float:
    return math.nan if sigma_mm is None else sigma_mm / 1000.0


def _print_count(alignments: Sequence[Alignment]) -> None:
    print(f"{len(alignments)} alignments, {sum(len(one.elements) for one in alignments)} elements")
