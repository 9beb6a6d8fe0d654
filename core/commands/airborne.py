"""The command `python -m rail_extract airborne`: the outputs of Track Centerlines from Airborne Lidar."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from ..airborne.files import survey_files
from ..airborne.proposals import propose_guides
from ..airborne.run import Run
from ..airborne.survey import Survey
from ..disk import Destination, writing
from ..errors import ParameterError
from ..fields import AIRBORNE, PROPOSED
from ..output.layers import airborne_stations_layer, findings_layer, lines_layer
from ..parameters import AIRBORNE_CLASSES, AirborneParameters
from ..progress import Estimating
from ..report.airborne import airborne_findings, airborne_page, airborne_summary
from ..scratch import scratch_folder
from ..standards import RailStandard, resolve
from .options import (
    LAYER,
    REPORT,
    WRITING,
    Console,
    add_cloud_arguments,
    add_lengths,
    add_outputs,
    add_tiles_argument,
    add_workers_argument,
    destinations_of,
    lengths_of,
    numbers_in,
    request_of,
    runner_of,
    vector_module,
)

OUTPUTS = {
    "centerlines": (LAYER, "GeoPackage (or .dxf, .csv) for the lines"),
    "stations": (LAYER, "GeoPackage for a point every 10 m, with what is not seen and why"),
    "findings": (LAYER, "GeoPackage for the places to look at"),
    "proposed": (LAYER, "GeoPackage for guides where there are none: lines to correct"),
    "report": (REPORT, "HTML file for the report"),
}

LENGTHS = {
    "reach": "largest distance of a track from its guide",
    "footprint": "diameter of the laser beam on the ground",
    "rail_height": "top of the rails above the bed between them",
}
"""Options in metres, each an attribute of `AirborneParameters` without its unit."""


def airborne(parser: argparse.ArgumentParser) -> None:
    """Declare the command."""
    add_tiles_argument(parser)
    text = (
        "lines along the tracks, one for each, such as OpenStreetMap has them (GeoPackage, GeoJSON); without it, the "
        "cloud is searched and --proposed written"
    )
    parser.add_argument("--guide", type=Path, metavar="FILE", help=text)
    add_outputs(parser, OUTPUTS)
    add_cloud_arguments(parser)
    classes = ",".join(map(str, AIRBORNE_CLASSES))
    parser.add_argument("--classes", default=classes, help=f"classes of the points to use (default: {classes})")
    add_lengths(parser, LENGTHS, AirborneParameters)
    add_workers_argument(parser)
    parser.set_defaults(run=_run)


def _run(args: argparse.Namespace) -> None:
    """Find the tracks and write."""
    standard = resolve(args.standard, args.gauge, args.head_width)
    parameters = AirborneParameters(standard.gauge_m, standard.head_width_m, **lengths_of(args, LENGTHS))
    progress = Estimating(Console())
    _check_outputs(args)
    outputs = destinations_of(args, OUTPUTS)
    request = request_of(args, numbers_in(args.classes, "--classes", int), progress)
    parent = next(iter(outputs.values())).file.parent
    with writing(parent), scratch_folder(parent) as folder, runner_of(args) as runner:
        job = Run(request, parameters, folder / "points", runner, progress)
        if args.guide is None:
            found = propose_guides(job)
        else:
            guides = vector_module("--guide").read_guides(args.guide, request.zero.crs_wkt)
            survey = survey_files(job, guides)
    if args.guide is None:
        layers = [lines_layer(PROPOSED, found.guides)]
        vector_module("--proposed", WRITING).write_all(layers, outputs, found.frame)
        print(found.summary)
        return
    _write(survey, outputs, args, standard)
    for sentence in airborne_summary(survey):
        print(sentence)


def _check_outputs(args: argparse.Namespace) -> None:
    """Check that the outputs are those of a fit along guides, or of a search for guides."""
    wanted = "proposed" if args.guide is None else "centerlines"
    if getattr(args, wanted) is None:
        ending = "to have guides proposed, or --guide to fit tracks" if args.guide is None else "for the lines"
        raise ParameterError(f"Give --{wanted} {ending}.")
    for name in OUTPUTS:
        if (name == "proposed") == (args.guide is not None) and getattr(args, name) is not None:
            raise ParameterError(
                f"--{name} is written {'with' if args.guide is None else 'without'} --guide only: leave it out."
            )


def _write(
    survey: Survey, outputs: Mapping[str, Destination], args: argparse.Namespace, standard: RailStandard
) -> None:
    """Write the outputs that were asked for; layers of the same file together."""
    layers = [lines_layer(AIRBORNE, survey.lines)]
    if "stations" in outputs:
        layers.append(airborne_stations_layer(survey.tracks))
    if "findings" in outputs:
        layers.append(findings_layer(airborne_findings(survey)))
    vector_module("--centerlines", WRITING).write_all(layers, outputs, survey.frame)
    if "report" in outputs:
        facts = {"Rail": standard.label, "Command": args.command_line}
        outputs["report"].write_text(airborne_page(survey, args.tiles[0].name, facts))
