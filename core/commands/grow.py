"""The command `python -m rail_extract grow`: the outputs of Grow Rail Points from Seeds."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ..clouds.crs import MAX_COORDINATE
from ..clouds.points import ask
from ..disk import writing
from ..errors import ParameterError
from ..grow.settings import GrowSettings
from ..labelling.files import Choice
from ..labelling.growing import grow_files
from ..output.layers import stops_layer
from ..parameters import GrowParameters
from ..progress import Estimating
from ..scratch import scratch_folder
from ..standards import SEARCHED_CLASSES, resolve
from ..tasks import InTurn
from .copies import add_label_arguments, add_tiles_arguments, check_rail_class, planned_output, print_figures
from .options import WRITING, Console, add_lengths, add_standard_arguments, destination_of, lengths_of, shapes_module

LENGTHS = {
    "search": "largest distance of a seed from its rail, and of the rail from its course",
    "thickness": "width of the strip along the axis in which points belong to the rail",
    "window": "length of rail that is looked at as one",
    "min_height": "least height of the rail above its bed",
    "tolerance_z": "largest difference in height between the points of a head",
    "max_length": "length that is followed to either side of a seed",
}
"""Options in metres, each an attribute of `GrowParameters` without its unit."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add_tiles_arguments(parser)
    text = "points on railheads, or lines along them, in a file such as GeoPackage or GeoJSON"
    parser.add_argument("--seeds", type=Path, metavar="FILE", help=text)
    text = "a place on a railhead, in units of the coordinate system; may be given several times"
    parser.add_argument("--seed", action="append", default=[], metavar="X,Y", help=text)
    add_standard_arguments(parser)
    parser.add_argument("--crs", help="coordinate system of tiles that state none, such as EPSG:25832")
    text = "do not follow the other rail of the track"
    parser.add_argument("--single", action="store_true", help=text)
    add_lengths(parser, LENGTHS, GrowParameters)
    most = GrowParameters.max_outliers
    text = f"windows in a row in which the rail may not be seen (default: {most})"
    parser.add_argument("--max-outliers", type=int, default=most, metavar="N", help=text)
    add_label_arguments(parser, "the rail points")
    text = "GeoPackage (or .dxf, .csv) for the places where rails are not followed further, with the reason"
    parser.add_argument("--stops", type=Path, metavar="FILE", help=text)


def run(args: argparse.Namespace) -> None:
    """Grow and write.

    Raises
    ------
    RailExtractError
        A parameter is wrong, a file can't be read, no seed is on a rail, or the output can't be written.
    """
    check_rail_class(args)
    standard = resolve(args.standard, args.gauge, args.head_width)
    settings = GrowSettings(standard.gauge_m, standard.head_width_m, _parameters(args))
    progress = Estimating(Console())
    planned = planned_output(args, progress)
    stops = None if args.stops is None else destination_of("stops", args.stops)
    geopackage = None if stops is None else shapes_module("--stops", WRITING)
    request = ask(args.tiles, SEARCHED_CLASSES, args.crs, None, progress)
    choice = Choice(args.rail_class, args.rails_only, reset=False)
    seeds = _seeds(args, request.zero.crs_wkt)
    parent = planned.file.parent
    with writing(parent), scratch_folder(parent) as folder:
        result = grow_files(request, seeds, settings, choice, planned, folder, InTurn(), progress)
    if geopackage is not None:
        geopackage.write_layers([stops_layer(result.stops)], stops, request.zero)
    print_figures(result.figures, result.point_count)


def _parameters(args: argparse.Namespace) -> GrowParameters:
    """Return the parameters of the growth.

    Raises
    ------
    ParameterError
        A number is negative.
    """
    if args.max_outliers < 0:
        raise ParameterError(f"--max-outliers must be 0 or more, not {args.max_outliers}.")
    return GrowParameters(both=not args.single, max_outliers=args.max_outliers, **lengths_of(args, LENGTHS))


def _seeds(args: argparse.Namespace, crs_wkt: str | None) -> list[np.ndarray]:
    """Return the seeds, in the coordinate system of the cloud.

    Raises
    ------
    ParameterError
        There are none, or they can't be read.
    """
    seeds = [] if args.seeds is None else shapes_module("--seeds").read_seeds(args.seeds, crs_wkt)
    for text in args.seed:
        try:
            x, y = (float(word) for word in text.split(","))
            if not max(abs(x), abs(y)) <= MAX_COORDINATE:
                raise ValueError
        except ValueError:
            raise ParameterError(f'--seed "{text}" should be two numbers: x,y.') from None
        seeds.append(np.array([[x, y]]))
    if not seeds:
        raise ParameterError("A rail is followed from seeds: give --seeds or --seed.")
    return seeds
