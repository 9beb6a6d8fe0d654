"""The command `python -m rail_extract fit`: the outputs of Fit Alignment."""

from __future__ import annotations

import argparse
from datetime import datetime
from pathlib import Path

from .. import VERSION
from ..alignment.fit import fit_tracks
from ..output.layers import deviations_layer, elements_layer
from ..parameters import TRANSITIONS, FitParameters
from ..progress import Estimating
from ..report import build_alignment_page
from ..report.origin import title_of
from .options import REPORT, WRITING, Console, add_length, destinations_of, shapes_module

SUFFIXES = {"elements": (".gpkg",), "deviations": (".gpkg",), "report": REPORT}
"""File name suffixes of each output."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
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
    output = parser.add_argument_group("outputs", "Existing files are replaced. GeoPackages may be the same file.")
    output.add_argument("--elements", type=Path, required=True, metavar="FILE", help="GeoPackage for the elements")
    output.add_argument("--deviations", type=Path, metavar="FILE", help="GeoPackage for slews, lifts and cant")
    output.add_argument("--report", type=Path, metavar="FILE", help="HTML file for the diagrams")


def run(args: argparse.Namespace) -> None:
    """Fit and write.

    Raises
    ------
    RailExtractError
        A parameter is wrong, a file can't be read, no track can be fitted, or an output can't be written.
    """
    features, geopackage = (shapes_module("LINES", name) for name in ("features", WRITING))
    outputs = destinations_of(args, SUFFIXES)
    settings = FitParameters(args.tolerance / 1000.0, args.min_length, args.transitions, not args.no_round)
    tracks, frame = features.read_tracks(args.lines, args.quality, args.rails)
    fixed = {} if args.fixed is None else {one.track_id: one for one in features.read_elements(args.fixed, "--fixed")}
    fits = fit_tracks(tracks, frame, settings, fixed, Estimating(Console()))
    made = [elements_layer([fit.alignment for fit in fits])]
    if "deviations" in outputs:
        made.append(deviations_layer([fit.deviations for fit in fits]))
    geopackage.write_all(made, outputs, frame)
    if "report" in outputs:
        courses = [(fit.alignment, fit.deviations) for fit in fits]
        facts = {**stated(frame.crs_wkt), "Command": args.command_line}
        outputs["report"].write_text(build_alignment_page(courses, args.lines, facts, True))
    for fit in fits:
        count = len(fit.alignment.elements)
        print(f"Track {fit.alignment.track_id}: {count} elements, root mean square {fit.rms_mm:.2f} mm")


def stated(crs_wkt: str | None) -> dict[str, str]:
    """Return what a report states in every case."""
    return {
        "Date": f"{datetime.now():%Y-%m-%d %H:%M}",
        "Version": f"Rail Extract {VERSION}",
        "Coordinate system": title_of(crs_wkt),
    }
