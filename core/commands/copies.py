"""What the commands that write a classified copy of a cloud share: its arguments, its place and its figures."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..disk import writing
from ..errors import ParameterError
from ..labelling.files import Output, plan_output
from ..progress import Progress
from ..rails import SearchFigures
from ..standards import LAST_CLASS, RAIL_CLASS
from .options import TILES_HELP


def add_tiles_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the tiles that are read, and the copy."""
    parser.add_argument("tiles", nargs="+", type=Path, metavar="TILE", help=TILES_HELP)
    text = "LAZ or LAS file; for several tiles, the name of their new folder, with .vpc added for the catalogue"
    parser.add_argument("--output", type=Path, required=True, help=text)


def add_label_arguments(parser: argparse.ArgumentParser, points: str) -> None:
    """Declare the class of the rail points, described as `points`, and whether only these are written."""
    text = f"class of {points} (default: {RAIL_CLASS})"
    parser.add_argument("--rail-class", type=int, default=RAIL_CLASS, metavar="N", help=text)
    parser.add_argument("--rails-only", action="store_true", help="write the rail points only")


def check_rail_class(args: argparse.Namespace) -> None:
    """Check the class of the rail points.

    Raises
    ------
    ParameterError
        It is not a class.
    """
    if not 0 <= args.rail_class <= LAST_CLASS:
        raise ParameterError(f"--rail-class must be a number from 0 to {LAST_CLASS}, not {args.rail_class}.")


def planned_output(args: argparse.Namespace, progress: Progress) -> Output:
    """Make the folder of the copy, and plan the copy; errors as for `files.plan_output`."""
    output = args.output if len(args.tiles) == 1 or args.output.suffix else args.output.with_suffix(".vpc")
    with writing(output.parent):
        output.parent.mkdir(parents=True, exist_ok=True)
    return plan_output(args.tiles, output, args.rail_class, progress)


def print_figures(figures: SearchFigures, point_count: int) -> None:
    """Print how much was found among `point_count` points."""
    print(f"{figures.points} of {point_count} points are on rails")
    print(f"{figures.paired_m:.0f} m of rails with a partner, {figures.single_m:.0f} m without")
