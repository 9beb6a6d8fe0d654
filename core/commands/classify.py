"""The command `python -m rail_extract classify`: the outputs of Classify Rail Points."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..classify.guide import Guide
from ..classify.settings import Settings
from ..clouds.points import Request, ask
from ..disk import writing
from ..errors import ParameterError
from ..labelling.files import Choice, classify_files
from ..labelling.finding import guide_of
from ..learned.model import weights_for
from ..parameters import DEFAULT_GUIDE_DISTANCE_M
from ..progress import Estimating
from ..scratch import scratch_folder
from ..standards import SEARCHED_CLASSES, resolve
from .copies import add_label_arguments, add_tiles_arguments, check_rail_class, planned_output, print_figures
from .options import (
    Console,
    add_cloud_arguments,
    add_method_arguments,
    add_workers_argument,
    extent_of,
    gauges_of,
    limited,
    runner_of,
    shapes_module,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add_tiles_arguments(parser)
    add_cloud_arguments(parser)
    text = "lines along the tracks, in a file such as GeoPackage or GeoJSON: search near them only"
    parser.add_argument("--guide", type=Path, metavar="FILE", help=text)
    text = f"how far the middle of a track may be from the guide (default: {DEFAULT_GUIDE_DISTANCE_M:g})"
    parser.add_argument("--guide-distance", type=float, default=DEFAULT_GUIDE_DISTANCE_M, metavar="M", help=text)
    text = "keep only tracks that have the guide within 0.5 m of their middle"
    parser.add_argument("--only-guided", action="store_true", help=text)
    add_method_arguments(parser)
    parser.add_argument("--pairs-only", action="store_true", help="leave out rails without a partner")
    add_label_arguments(parser, "the rail points that are found")
    add_workers_argument(parser)
    text = "keep the rail class of points that are not found; otherwise they become class 1"
    parser.add_argument("--no-reset", action="store_true", help=text)


def run(args: argparse.Namespace) -> None:
    """Classify and write.

    Raises
    ------
    RailExtractError
        A parameter is wrong, a file can't be read, or the output can't be written.
    """
    check_rail_class(args)
    standard = resolve(args.standard, args.gauge, args.head_width)
    gauges_m = tuple(gauge_m for gauge_m, _ in gauges_of(args, standard))
    if args.only_guided and args.guide is None:
        raise ParameterError("--only-guided needs lines to compare tracks with: give --guide.")
    choice = Choice(args.rail_class, args.rails_only, not args.no_reset)
    weights = weights_for(args.method, args.weights)
    progress = Estimating(Console())
    planned = planned_output(args, progress)
    request = ask(args.tiles, SEARCHED_CLASSES, args.crs, extent_of(args.extent), progress)
    request = limited(request, args)
    guide = _guide(args, request)
    settings = Settings(gauges_m, standard.head_width_m, not args.pairs_only, guide, weights)
    with (
        writing(planned.file.parent),
        scratch_folder(planned.file.parent) as folder,
        runner_of(args) as runner,
    ):
        result = classify_files(request, settings, choice, planned, folder, runner, progress)
    print_figures(result.figures, result.point_count)


def _guide(args: argparse.Namespace, request: Request) -> Guide | None:
    """Read the guide, if there is one."""
    if args.guide is None:
        return None
    lines = shapes_module("--guide").read_lines(args.guide, request.zero.crs_wkt)
    return guide_of(request, lines, args.guide_distance, args.only_guided)
