"""The command `python -m rail_extract stations`: the output of Station Along Axis."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..progress import Estimating
from .options import Console, add_axis_arguments, axes_of, destination_of, shapes_module


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("input", metavar="INPUT", help="any layer; FILE|layername=NAME names a layer of a file")
    parser.add_argument("axis", metavar="AXIS", help="line layer that carries the kilometres")
    parser.add_argument("output", type=Path, metavar="OUTPUT", help="GeoPackage for the features with kilometres")
    add_axis_arguments(parser)


def run(args: argparse.Namespace) -> None:
    """Locate the features and write them with their kilometres.

    Raises
    ------
    RailExtractError
        A file can't be read, the axis states no kilometres, or the output can't be written.
    """
    features = shapes_module("stations", "features")
    output = destination_of("output", args.output, (".gpkg",))
    places = features.read_features(args.input, "INPUT")
    axes, plane = axes_of(args, places.crs_wkt)
    located = features.located(places, axes, plane, Estimating(Console()))
    features.write_copy(output, places, located.fields, located.columns)
    print(f"{located.known} of {len(places.ids)} features have a kilometre")
