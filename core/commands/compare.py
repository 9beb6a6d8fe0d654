"""The command `python -m rail_extract compare`: the outputs of Compare Tracks."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from ..comparison.tracks import Survey, compare_surveys, doubts_of
from ..errors import ParameterError
from ..output.layers import differences_layer
from ..parameters import ComparisonParameters
from ..progress import Estimating
from ..report.comparison import build_comparison, describe_shift, verdict_on
from .options import REPORT, WRITING, Console, add_length, destinations_of, shapes_module


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("reference", metavar="REFERENCE", help="lines of the earlier survey, design or control")
    parser.add_argument("input", metavar="INPUT", help="lines of the other survey; FILE|layername=NAME names a layer")
    parser.add_argument(
        "--reference-rails", metavar="FILE", help="rails of the reference, if its lines are centerlines"
    )
    parser.add_argument("--rails", metavar="FILE", help="rails of the other survey")
    for name in ("reference", "input"):
        text = "standard error of lines that state none; 0 for a design"
        parser.add_argument(f"--{name}-sigma", type=float, metavar="MM", help=text)
    default = ComparisonParameters()
    add_length(parser, "--reach", default.reach_m, "largest distance at which two lines are the same")
    add_length(parser, "--step", default.step_m, "distance between stations")
    text = "a constant shift between the surveys counts as a movement, as it should against a design"
    parser.add_argument("--count-shift", action="store_true", help=text)
    output = parser.add_argument_group("outputs", "Existing files are replaced.")
    output.add_argument("--output", type=Path, metavar="FILE", help="GeoPackage for the differences")
    output.add_argument("--report", type=Path, metavar="FILE", help="HTML file for the report")


def run(args: argparse.Namespace) -> None:
    """Compare and write.

    Raises
    ------
    RailExtractError
        A parameter is wrong, a file can't be read, or an output can't be written.
    """
    if (args.rails is None) != (args.reference_rails is None):
        raise ParameterError(
            "Gauge and cant are compared between the rails of both: give --rails and --reference-rails."
        )
    outputs = destinations_of(args, {"output": (".gpkg",), "report": REPORT})
    features, geopackage = (shapes_module("compare", name) for name in ("features", WRITING))
    lines, frame = features.read_survey(args.reference, "REFERENCE", None)
    earlier = Survey(lines, sigma_m=_metres(args.reference_sigma))
    later = Survey(features.read_survey(args.input, "INPUT", frame)[0], sigma_m=_metres(args.input_sigma))
    if args.rails is not None:
        earlier = replace(earlier, rails=features.read_rails(args.reference_rails, "--reference-rails", frame))
        later = replace(later, rails=features.read_rails(args.rails, "--rails", frame))
    progress = Estimating(Console())
    settings = ComparisonParameters(args.reach, args.step, not args.count_shift)
    found = compare_surveys(earlier, later, settings, progress)
    for sentence in doubts_of(found):
        progress.warning(sentence)
    if "output" in outputs:
        geopackage.write_layers([differences_layer(found)], outputs["output"], frame)
    if "report" in outputs:
        facts = {"Date": f"{datetime.now():%Y-%m-%d %H:%M}", "Command": args.command_line}
        source = f"{args.input} against {args.reference}"
        outputs["report"].write_text(build_comparison(found, args.count_shift, source, facts))
    print(verdict_on(found))
    print(describe_shift(found))


def _metres(sigma_mm: float | None) -> float:
    return math.nan if sigma_mm is None else sigma_mm / 1000.0
