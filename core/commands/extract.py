"""The command `python -m rail_extract extract`: from tiles to GeoPackages, on local workers or a Dask cluster."""

from __future__ import annotations

import argparse
import math
import shutil
import sys
import tempfile
from dataclasses import fields
from importlib.util import find_spec
from pathlib import Path

from ..disk import check_closed, writing
from ..errors import ParameterError, RailExtractError
from ..fields import CENTERLINE_FIELDS, RAIL_FIELDS
from ..frpdf import DEVICES, ENGINES
from ..frpdf.models import choose
from ..pipeline import Parameters, extract_files
from ..progress import Estimating, Progress
from ..standards import DEFAULT, distinct_gauges, resolve

NEEDS = {"distributed": "distributed", "pyogrio": "pyogrio", "shapely": "shapely"}
"""Modules and packages of the extra "cluster"."""

INCOMPLETE = 2
"""Exit code of a run that has written results, but without some files or stretches."""

TOLD_OTHERWISE = (
    "gauge_m",
    "head_width_m",
    "passes",
    "engine",
    "device",
    "other_gauges_m",
    "quality_step_m",
    "keep_cleaned",
)
"""Parameters that no option of their own name gives."""

FORMER_NAMES = {"square_tiles": ("--stretch-tiles",)}
"""Names that options had in earlier versions; batch files still use them."""

POSITIVE = (
    "smoothing_xy_m",
    "smoothing_z_m",
    "tolerance_xy_m",
    "tolerance_z_m",
    "crown_radius_m",
    "centerline_tolerance_m",
)
"""Parameters that can't be 0: nothing is smoothed over no length, and nothing lies within none."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument(
        "tiles",
        nargs="+",
        type=Path,
        metavar="TILE",
        help="LAS, LAZ, COPC or .vpc files, or folders of tiles",
    )
    parser.add_argument("--rails", type=Path, required=True, help="GeoPackage for the rails; replaced if it is there")
    parser.add_argument("--centerlines", type=Path, help="GeoPackage for the track centerlines; may be the same file")
    parser.add_argument("--rail-classes", default="10", help="classes that mean rail, such as 10,11 (default: 10)")
    parser.add_argument("--standard", default=DEFAULT, help=f"rail standard (default: {DEFAULT})")
    parser.add_argument("--gauge", type=float, metavar="MM", help="gauge in place of the standard's")
    parser.add_argument("--head-width", type=float, metavar="MM", help="railhead width in place of the standard's")
    parser.add_argument("--other-gauges", default="", metavar="MM", help="further gauges to pair, such as 1000;1067")
    parser.add_argument("--crs", help="coordinate system of tiles that state none, such as EPSG:25832")
    parser.add_argument("--iterations", type=int, default=Parameters.passes, help="passes of the network (default: 2)")
    parser.add_argument("--engine", choices=ENGINES, default=Parameters.engine, help="what runs the network")
    parser.add_argument("--device", choices=DEVICES, default=Parameters.device, help="where the network runs")
    for field in _plain_fields():
        unit = {"_m": "metres, ", "eg": "degrees, "}.get(field.name[-2:], "")
        text = f"as in QGIS ({unit}default: {field.default:g})"
        names = [_option(field.name), *FORMER_NAMES.get(field.name, ())]
        parser.add_argument(*names, type=type(field.default), default=field.default, metavar="N", help=text)
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="use the Dask cluster at tcp://... instead of workers here"
    )
    parser.add_argument("--workers", type=int, help="workers here (default: one a core, as far as memory suffices)")
    parser.add_argument("--work", type=Path, help="folder that keeps what is finished, for a restart")


def run(args: argparse.Namespace) -> int:
    """Extract and write; gives the exit code.

    Raises
    ------
    RailExtractError
        Nothing could be written.
    """
    missing = [package for module, package in NEEDS.items() if find_spec(module) is None]
    if missing:
        raise RailExtractError(f"Packages are missing ({', '.join(missing)}): in a clone, run pip install .[cluster].")
    parameters = parameters_of(args)
    for path in (args.rails, args.centerlines or args.rails):
        if path.suffix.lower() != ".gpkg":
            raise ParameterError(f"Results are GeoPackages: give {path.name} the ending .gpkg.")
        with writing(path.parent):
            path.parent.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=path.parent).close()
        check_closed(path)
    if args.work is not None:
        return _run_in(args.work, args, parameters)
    # Beside the results, for there workers elsewhere find it as well.
    folder = tempfile.mkdtemp(dir=args.rails.parent, prefix=".rail_extract_")
    try:
        return _run_in(Path(folder), args, parameters)
    finally:
        shutil.rmtree(folder, ignore_errors=True)  # workers of a cluster that are still at it may write meanwhile


def parameters_of(args: argparse.Namespace) -> Parameters:
    """Gather what the options tell.

    Raises
    ------
    ParameterError
        One is out of range or contradicts another.
    ModelError
        No weights fit the standard.
    """
    standard = resolve(args.standard, args.gauge, args.head_width)
    choose(standard.gauge_m, standard.head_width_m)
    others = _numbers(args.other_gauges, "--other-gauges", float)
    gauges_m = distinct_gauges((standard.gauge_m, *(mm / 1000 for mm in others)), args.centerline_tolerance)
    plain = {field.name: getattr(args, _option(field.name)[2:].replace("-", "_")) for field in _plain_fields()}
    workers = 0 if args.workers is None else args.workers - 1
    for name, value in {**plain, "iterations": args.iterations, "workers": workers}.items():
        if not (math.isfinite(value) and value >= 0) or (name in POSITIVE and value == 0):
            raise ParameterError(
                f"The option {_option(name)} can't be {getattr(args, name, value)}: give a larger number."
            )
    return Parameters(
        standard.gauge_m,
        standard.head_width_m,
        args.iterations,
        args.engine,
        args.device,
        other_gauges_m=gauges_m[1:],
        **plain,
    )


def _run_in(folder: Path, args: argparse.Namespace, parameters: Parameters) -> int:
    """Extract with a folder for what is finished."""
    from ..clouds.points import ask
    from ..cluster.runner import DaskRunner
    from ..cluster.workers import connect
    from .geopackage import write

    codes = _numbers(args.rail_classes, "--rail-classes", int)
    progress = Estimating(_Console())
    with connect(args.scheduler, args.workers) as client:
        runner = DaskRunner(client, folder)
        request = ask(args.tiles, codes, args.crs, progress=progress, unreadable=runner.failures)
        found = extract_files(request, folder.resolve(), parameters, runner, progress)
    layers = {"rails": (args.rails, found.rails, RAIL_FIELDS)}
    if args.centerlines is not None:
        layers["centerlines"] = (args.centerlines, found.centerlines, CENTERLINE_FIELDS)
    write(layers, found.frame)
    print(f"{len(found.rails)} rails, {sum(rail.length_m for rail in found.rails) / 1000:.3f} km")
    print(f"{len(found.centerlines)} centerlines, {sum(line.length_m for line in found.centerlines) / 1000:.3f} km")
    for failure in found.failures:
        print(failure, file=sys.stderr)
    return INCOMPLETE if found.failures else 0


def _plain_fields() -> list:
    return [field for field in fields(Parameters) if field.name not in TOLD_OTHERWISE]


def _option(name: str) -> str:
    """Name of the option for a parameter: that of the interface, which leaves the unit out."""
    for unit in ("_m", "_deg"):
        name = name[: -len(unit)] if name.endswith(unit) else name
    return "--" + name.replace("_", "-")


def _numbers(text: str, option: str, kind: type) -> tuple:
    """Numbers from a text such as "10,11" or "1000;1067".

    Raises
    ------
    ParameterError
        The text holds something else.
    """
    try:
        return tuple(dict.fromkeys(kind(word) for word in text.replace(";", ",").split(",") if word.strip()))
    except ValueError:
        raise ParameterError(f'{option} "{text}" should be numbers such as 10 or 10,11.') from None


class _Console(Progress):
    """Writes news of the remaining time, and what the user should look at, to the error output."""

    def status(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    def warning(self, text: str) -> None:
        print(f"Warning: {text}", file=sys.stderr, flush=True)
