"""The command `stations`."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from ..progress import Estimating
from .options import (
    TABLE,
    Console,
    add_axis_arguments,
    axis_of,
    destination_of,
    vector_module,
)


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
    axes, plane = kilometres.read_axes(axis_of(args), places.crs_wkt)
    fields, columns = kilometres.located(places, axes, plane, Estimating(Console()))
    kilometres.write_copy(output, places, fields, columns)
    known = sum(math.isfinite(km) for km in columns[[field.name for field in fields].index("km")])
    print(f"{known} of {len(places.ids)} features have a kilometre")
