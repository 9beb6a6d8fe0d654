"""The command `python -m rail_extract export-alignment`: the file of Export Alignment."""

from __future__ import annotations

import argparse
from pathlib import Path

from .. import VERSION
from ..output.design_files import FORMATS, check_designs, check_format, write_designs
from ..progress import Estimating
from ..standards import resolve
from .options import Console, add_standard_arguments, destination_of, shapes_module

CURVES = ("CIRCLES", "PARABOLAS")
"""Curves of the profile in LandXML."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("elements", metavar="ELEMENTS", help="element table of fit or import-alignment, also edited")
    parser.add_argument("output", type=Path, metavar="OUTPUT", help="file that ends in .xml (LandXML), .ifc or .dxf")
    add_standard_arguments(parser)
    text = f"curves of the profile in LandXML (default: {CURVES[0]})"
    parser.add_argument("--vertical-curves", choices=CURVES, default=CURVES[0], help=text)
    parser.add_argument("--crs", help="coordinate system of a table that states none, such as EPSG:25832")


def run(args: argparse.Namespace) -> None:
    """Read the table, check it and write the file.

    Raises
    ------
    RailExtractError
        The table can't be read or has a gap, or the file can't be written.
    """
    check_format(args.output)
    standard = resolve(args.standard, args.gauge, args.head_width)
    destination = destination_of("output", args.output, tuple(FORMATS))
    alignments = shapes_module("ELEMENTS", "features").read_elements(args.elements, "ELEMENTS", args.crs)
    check_designs(alignments, Estimating(Console()))
    with destination.replacing() as new:
        write_designs(new, alignments, standard, args.vertical_curves == CURVES[0], VERSION)
    print(f"{len(alignments)} alignments, {sum(len(one.elements) for one in alignments)} elements")
