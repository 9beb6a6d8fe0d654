"""The command `python -m rail_extract airborne`: the outputs of Track Centerlines from Airborne Lidar."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from ..airborne.files import survey_files
from ..airborne.proposals import Proposals, propose_guides
from ..airborne.run import Run
from ..airborne.survey import Guide, Survey
from ..clouds.points import Request, ask
from ..disk import Destination, writing
from ..errors import ParameterError
from ..output.layers import airborne_stations_layer, findings_layer, lines_layer
from ..parameters import AIRBORNE_CLASSES, AirborneParameters
from ..products import AIRBORNE, PROPOSED
from ..progress import Estimating
from ..report.airborne import airborne_findings, airborne_page, airborne_summary
from ..scratch import scratch_folder
from ..standards import RailStandard, resolve
from .options import (
    LAYERS,
    REPORT,
    TILES_HELP,
    WRITING,
    Console,
    add_cloud_arguments,
    add_lengths,
    add_workers_argument,
    destinations_of,
    extent_of,
    lengths_of,
    limited,
    numbers_in,
    runner_of,
    shapes_module,
)

SUFFIXES = {
    "centerlines": LAYERS,
    "stations": LAYERS,
    "findings": LAYERS,
    "proposed": LAYERS,
    "report": REPORT,
}
"""File name suffixes of each output."""

LENGTHS = {
    "reach": "largest distance of a track from its guide",
    "footprint": "diameter of the laser beam on the ground",
    "rail_height": "top of the rails above the bed between them",
}
"""Options in metres, each an attribute of `AirborneParameters` without its unit."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("tiles", nargs="+", type=Path, metavar="TILE", help=TILES_HELP)
    text = (
        "lines along the tracks, one for each, such as OpenStreetMap has them (GeoPackage, GeoJSON); without it, the "
        "cloud is searched and --proposed written"
    )
    parser.add_argument("--guide", type=Path, metavar="FILE", help=text)
    output = parser.add_argument_group("outputs", "Existing files are replaced. GeoPackages may be the same file.")
    output.add_argument("--centerlines", type=Path, help="GeoPackage (or .dxf, .csv) for the lines")
    output.add_argument(
        "--stations", type=Path, help="GeoPackage for a point every 10 m, with what is not seen and why"
    )
    output.add_argument("--findings", type=Path, help="GeoPackage for the places to look at")
    output.add_argument("--proposed", type=Path, help="GeoPackage for guides where there are none: lines to correct")
    output.add_argument("--report", type=Path, help="HTML file for the report")
    add_cloud_arguments(parser)
    classes = ",".join(map(str, AIRBORNE_CLASSES))
    parser.add_argument("--classes", default=classes, help=f"classes of the points to use (default: {classes})")
    add_lengths(parser, LENGTHS, AirborneParameters)
    add_workers_argument(parser)


def run(args: argparse.Namespace) -> None:
    """Find the tracks and write.

    Raises
    ------
    RailExtractError
        A parameter is wrong, a file can't be read, or an output can't be written.
    """
    standard = resolve(args.standard, args.gauge, args.head_width)
    parameters = parameters_of(args, standard)
    progress = Estimating(Console())
    _check_outputs(args)
    outputs = destinations_of(args, SUFFIXES)
    codes = numbers_in(args.classes, "--classes", int)
    request = limited(ask(args.tiles, codes, args.crs, extent_of(args.extent), progress), args)
    parent = next(iter(outputs.values())).file.parent
    with writing(parent), scratch_folder(parent) as folder, runner_of(args) as runner:
        job = Run(request, parameters, folder / "points", runner, progress)
        if args.guide is None:
            found = propose_guides(job)
        else:
            survey = survey_files(job, _guides(args.guide, request))
    if args.guide is None:
        _write_proposed(found, outputs["proposed"])
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
    for name in SUFFIXES:
        if (name == "proposed") == (args.guide is not None) and getattr(args, name) is not None:
            raise ParameterError(
                f"--{name} is written {'with' if args.guide is None else 'without'} --guide only: leave it out."
            )


def _write_proposed(found: Proposals, destination: Destination) -> None:
    """Write the proposed guides."""
    module = shapes_module("--proposed", WRITING)
    module.write_layers([lines_layer(PROPOSED, found.guides)], destination, found.frame)


def parameters_of(args: argparse.Namespace, standard: RailStandard) -> AirborneParameters:
    """Return the parameters that the options state."""
    return AirborneParameters(standard.gauge_m, standard.head_width_m, **lengths_of(args, LENGTHS))


def _guides(path: Path, request: Request) -> list[Guide]:
    """Read the guides in the coordinate system of the cloud."""
    return shapes_module("--guide").read_guides(path, request.zero.crs_wkt)


def _write(
    survey: Survey, outputs: Mapping[str, Destination], args: argparse.Namespace, standard: RailStandard
) -> None:
    """Write the outputs that were asked for; layers of the same file together."""
    module = shapes_module("--centerlines", WRITING)
    layers = [lines_layer(AIRBORNE, survey.lines)]
    if "stations" in outputs:
        layers.append(airborne_stations_layer(survey.tracks))
    if "findings" in outputs:
        layers.append(findings_layer(airborne_findings(survey)))
    module.write_all(layers, outputs, survey.frame)
    if "report" in outputs:
        facts = {"Rail": standard.label, "Command": args.command_line}
        outputs["report"].write_text(airborne_page(survey, args.tiles[0].name, facts))
