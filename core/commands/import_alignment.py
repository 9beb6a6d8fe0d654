"""The command `python -m rail_extract import-alignment`: the outputs of Import Alignment."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from ..alignment.deviations import compared_with
from ..alignment.landxml_reading import read_landxml, stated_system
from ..alignment.measured import moved
from ..clouds.crs import parse_crs, units
from ..errors import CrsError, ParameterError
from ..output.design_files import check_place
from ..output.layers import axes_layer, deviations_layer, elements_layer
from ..progress import Estimating
from ..report import build_alignment_page
from .fit import stated
from .options import REPORT, WRITING, Console, destinations_of, shapes_module

SUFFIXES = {"elements": (".gpkg",), "axis": (".gpkg",), "deviations": (".gpkg",), "report": REPORT}
"""File name suffixes of each output."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("file", type=Path, metavar="FILE", help="LandXML file")
    parser.add_argument("--crs", help="coordinate system of a file that states none, such as EPSG:25832")
    parser.add_argument("--east-first", action="store_true", help="the points of the file have the easting first")
    text = "measured centerlines: how far they lie off the alignments beside them"
    parser.add_argument("--tracks", metavar="LINES", help=text)
    parser.add_argument("--quality", metavar="FILE", help="track geometry of TRACKS, with the cant")
    parser.add_argument("--rails", metavar="FILE", help="rails of TRACKS, with the cant")
    output = parser.add_argument_group("outputs", "Existing files are replaced. GeoPackages may be the same file.")
    output.add_argument("--elements", type=Path, metavar="FILE", help="GeoPackage for the element table")
    output.add_argument("--axis", type=Path, metavar="FILE", help="GeoPackage for axes with kilometres as M values")
    output.add_argument("--deviations", type=Path, metavar="FILE", help="GeoPackage for slews, lifts, cant of TRACKS")
    output.add_argument("--report", type=Path, metavar="FILE", help="HTML file for the diagrams of TRACKS")


def run(args: argparse.Namespace) -> None:
    """Read the file and write.

    Raises
    ------
    RailExtractError
        The file can't be read, lies elsewhere, or an output can't be written.
    """
    outputs = destinations_of(args, SUFFIXES)
    if not outputs:
        raise ParameterError("Give --elements, --axis, --deviations or --report for what is wanted of the file.")
    if args.tracks is None and (args.quality or args.rails or {"deviations", "report"} & set(outputs)):
        raise ParameterError("--deviations and --report compare measured tracks with the alignments: give --tracks.")
    features, geopackage = (shapes_module("import-alignment", name) for name in ("features", WRITING))
    progress = Estimating(Console())
    tracks, own = features.read_tracks(args.tracks, args.quality, args.rails, "--tracks") if args.tracks else ([], None)
    system = stated_system(args.file) or args.crs or (own and own.crs_wkt)
    wkt = parse_crs(system).to_wkt() if system else None
    if wkt and units(parse_crs(wkt))[0] != 1.0:
        raise CrsError(
            f"{args.file.name} is in metres, but its coordinate system {system} is not: choose another --crs, or "
            "correct the file."
        )
    read = read_landxml(args.file, args.east_first, progress)
    frame = replace(read[0].frame, crs_wkt=wkt)
    alignments = [replace(one, frame=frame) for one in read]
    check_place(args.file.name, frame, args.east_first, progress)
    courses = []
    if args.tracks:
        shift = features.shift_between("--tracks", own, frame)
        courses = compared_with(alignments, [moved(one, shift) for one in tracks], progress)
    makers = {
        "elements": lambda: elements_layer(alignments),
        "axis": lambda: axes_layer(alignments),
        "deviations": lambda: deviations_layer([one for _, one in courses]),
    }
    geopackage.write_all([make() for name, make in makers.items() if name in outputs], outputs, frame)
    if "report" in outputs:
        facts = {**stated(wkt), "LandXML file": args.file.name, "Command": args.command_line}
        outputs["report"].write_text(build_alignment_page(courses, args.tracks, facts, False))
    print(f"{len(alignments)} alignments, {sum(len(one.elements) for one in alignments)} elements")
