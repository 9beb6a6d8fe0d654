"""The command `python -m rail_extract extract`: the outputs of Extract Rails, from local workers or a cluster."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from ..clouds.readers import Extent
from ..disk import Destination
from ..errors import ParameterError, RailExtractError
from ..frpdf import DEVICES, ENGINES, MAX_PASSES
from ..frpdf.models import NAMES, choose
from ..learned.model import weights_for
from ..output.raster_file import header_for, on_one_grid, write_rasters
from ..parameters import DEFAULT_STEP_M, DEFAULT_WORKERS, LEARNED, MAX_WORKERS, STRIPS, Parameters
from ..pipeline import extract_files
from ..progress import Estimating, Progress, counted
from ..rails import RailNetwork
from ..report import Origin, summary
from ..scratch import scratch_folder
from ..standards import SEARCHED_CLASSES, RailStandard, resolve
from ..tasks import Runner
from ..workers.runner import workers
from .options import (
    LAYER,
    REPORT,
    Console,
    add_axis_arguments,
    add_cloud_arguments,
    add_method_arguments,
    add_outputs,
    add_tiles_argument,
    axis_of,
    destinations_of,
    gauges_of,
    numbers_in,
    request_of,
    vector_module,
)

LAYER_PACKAGES, RASTER_PACKAGES, CLUSTER_PACKAGES = (
    ("pyogrio", "shapely"),
    ("rasterio",),
    ("distributed", "cryptography"),
)
"""Modules of the extra "cluster", which have the names of their packages: for layers, for `--cleaned`, and for Dask."""

LAST_PORT = 65_535
"""Largest number of a port; 0 stands for any that is free."""

INCOMPLETE = 2
"""Exit code of a run that has written results in which some files or squares are missing."""

OUTPUTS = {
    "rails": (LAYER, "GeoPackage (or .dxf, .csv) for the rails"),
    "centerlines": (LAYER, "GeoPackage for the track centerlines"),
    "quality": (LAYER, "GeoPackage for the points with the track geometry"),
    "findings": (LAYER, "GeoPackage for the places to look at"),
    "cleaned": ((".tif", ".tiff"), "GeoTIFF for the rail raster as the network cleaned it"),
    "report": (REPORT, "HTML file for the report"),
}

NUMBERS = tuple(
    one for one in fields(Parameters) if isinstance(one.default, (float, type(None))) and one.name != "quality_step_m"
)
"""Parameters that are plain numbers, each with an option of its own name."""

POSITIVE = (
    "smoothing_xy_m",
    "smoothing_z_m",
    "tolerance_xy_m",
    "tolerance_z_m",
    "crown_radius_m",
    "centerline_tolerance_m",
    "step",
)
"""Parameters that can't be 0: nothing is smoothed over no length, and no point is within no distance."""


def extract(parser: argparse.ArgumentParser) -> None:
    """Declare the command."""
    add_tiles_argument(parser)
    add_outputs(parser, OUTPUTS, required="rails")
    _add_cloud(parser.add_argument_group("point cloud and rails"))
    kilometres = parser.add_argument_group("kilometres", "Fields of --quality and --findings, and in the report.")
    kilometres.add_argument("--axis", metavar="FILE", help="line layer that carries the kilometres")
    add_axis_arguments(kilometres)
    _add_method(parser.add_argument_group("method", "See docs/parameters.md."))
    _add_workers(parser.add_argument_group("workers"))
    parser.set_defaults(run=_run)


def _add_cloud(group: argparse._ArgumentGroup) -> None:
    """Declare what is read."""
    text = "find the rail points of a raw cloud first; --rail-classes is ignored"
    group.add_argument("--classify", action="store_true", help=text)
    add_method_arguments(group)
    text = "points or lines on railheads: extract the rails that grow from these; --rail-classes is ignored"
    group.add_argument("--seeds", type=Path, metavar="FILE", help=text)
    group.add_argument("--rail-classes", default="10", help="classes of rail points, such as 10,11 (default: 10)")
    text = "take all rail classes for one, for tracks whose rails are of different classes"
    group.add_argument("--merge-classes", action="store_true", help=text)
    add_cloud_arguments(group)


def _add_method(group: argparse._ArgumentGroup) -> None:
    """Declare the parameters of the method."""
    group.add_argument("--iterations", type=int, default=Parameters.passes, help="passes of the network (default: 2)")
    group.add_argument("--engine", choices=ENGINES, default=Parameters.engine, help="what runs the network")
    group.add_argument("--device", choices=DEVICES, default=Parameters.device, help="where the network runs")
    text = "weights of the network (default: AUTO, by gauge and railhead)"
    group.add_argument("--model", choices=NAMES, default=Parameters.model, help=text)
    for field in NUMBERS:
        unit = "degrees" if field.name.endswith("_deg") else "metres"
        default = "as the points require" if field.default is None else f"{field.default:g}"
        text = f"{_option(field.name)[2:].replace('-', '_').upper()} in {unit} (default: {default})"
        group.add_argument(_option(field.name), type=float, default=field.default, metavar="N", help=text)
    text = f"how strips, the passes of a scanner, are used (default: {Parameters.strips})"
    group.add_argument("--strips", choices=STRIPS, default=Parameters.strips, help=text)
    text = f"STEP of --quality, --findings and --report in metres (default: {DEFAULT_STEP_M:g})"
    group.add_argument("--step", type=float, default=DEFAULT_STEP_M, metavar="N", help=text)


def _add_workers(group: argparse._ArgumentGroup) -> None:
    """Declare what computes."""
    text = "use the Dask cluster at tls://HOST:PORT and not local workers; see docs/scaling.md on trust"
    group.add_argument("--scheduler", metavar="ADDRESS", help=text)
    group.add_argument("--tls-ca", type=Path, metavar="PEM", help="certificate of the cluster's authority")
    group.add_argument(
        "--tls-cert", type=Path, metavar="PEM", help="certificate of this computer, signed by the authority"
    )
    group.add_argument("--tls-key", type=Path, metavar="PEM", help="private key of this certificate")
    text = "show what local workers do at http://127.0.0.1:PORT, to all users of this computer (default: nowhere)"
    group.add_argument("--dashboard", type=int, metavar="PORT", help=text)
    text = "local workers; 0, the default, is one per core, or fewer if memory is short"
    group.add_argument("--workers", type=int, default=DEFAULT_WORKERS, metavar="N", help=text)
    group.add_argument("--work", type=Path, help="folder that keeps finished results, so that a restart continues")
    group.add_argument(
        "--square-tiles",
        "--stretch-tiles",  # the name in earlier versions, which batch files still use
        type=int,
        default=Parameters.square_tiles,
        metavar="N",
        help=f"side of the squares processed at a time, in raster tiles (default: {Parameters.square_tiles})",
    )


def _run(args: argparse.Namespace) -> int:
    """Extract and write; returns the exit code."""
    needed = [
        *LAYER_PACKAGES,
        *(RASTER_PACKAGES if args.cleaned else ()),
        *(CLUSTER_PACKAGES if _on_dask(args) else ()),
    ]
    missing = [package for package in needed if find_spec(package) is None]
    if missing:
        raise RailExtractError(f"Packages are missing ({', '.join(missing)}): in a clone, run pip install .[cluster].")
    if args.axis and not (args.quality or args.findings or args.report):
        raise ParameterError("--axis gives --quality, --findings and --report kilometres: name at least one of these.")
    standard = resolve(args.standard, args.gauge, args.head_width)
    parameters = _parameters(args, standard)
    origin = Origin(tuple(args.tiles), standard, parameters.gauges[1:], args.command_line, parameters)
    outputs = destinations_of(args, OUTPUTS)
    if args.work is not None:
        return _run_in(args.work, args, parameters, origin, outputs)
    # Next to the results, where workers on other computers find it too.
    with scratch_folder(outputs["rails"].file.parent) as folder:
        return _run_in(folder, args, parameters, origin, outputs)


def _parameters(args: argparse.Namespace, standard: RailStandard) -> Parameters:
    """Return the parameters that the options state.

    Raises
    ------
    ParameterError
        One is out of range or contradicts another.
    ModelError
        No weights fit the standard.
    """
    choose(standard.gauge_m, standard.head_width_m, args.model)
    gauges = gauges_of(args, standard, args.centerline_tolerance)
    numbers = {field.name: getattr(args, _option(field.name)[2:].replace("-", "_")) for field in NUMBERS}
    for name, value in {**numbers, "iterations": args.iterations, "step": args.step, "workers": args.workers}.items():
        if value is not None and not (math.isfinite(value) and value >= 0) or (name in POSITIVE and value == 0):
            raise ParameterError(f"The option {_option(name)} can't be {value}: give a larger number.")
    for name, value, largest in (("iterations", args.iterations, MAX_PASSES), ("workers", args.workers, MAX_WORKERS)):
        if value > largest:
            raise ParameterError(f"The option {_option(name)} can't be {value}: give {largest} or less.")
    return Parameters(
        standard.gauge_m,
        standard.head_width_m,
        args.iterations,
        args.engine,
        args.device,
        args.model,
        quality_step_m=args.step if args.quality or args.findings or args.report else None,
        square_tiles=args.square_tiles,
        keep_cleaned=args.cleaned is not None,
        strips=args.strips,
        **numbers,
    ).with_gauges(gauges[1:])


def _run_in(
    folder: Path,
    args: argparse.Namespace,
    parameters: Parameters,
    origin: Origin,
    outputs: Mapping[str, Destination],
) -> int:
    """Extract with a folder for finished results, then write."""
    codes = numbers_in(args.rail_classes, "--rail-classes", int)
    if args.classify and args.seeds is not None:
        raise ParameterError("--classify finds all rails, and --seeds those that are pointed at: give one of them.")
    raw = args.classify or args.seeds is not None
    weights = _weights(args)
    progress = Estimating(Console())
    with _runner(args, folder, progress) as runner:
        request = request_of(args, SEARCHED_CLASSES if raw else codes, progress, runner.failures)
        request = replace(request, merged=args.merge_classes and not raw)
        wkt = request.zero.crs_wkt
        seeds = vector_module("--seeds").read_seeds(args.seeds, wkt) if args.seeds else ()
        axes = vector_module("--axis", "kilometres").read_axes(axis_of(args), None, wkt)[0] if args.axis else None
        network = extract_files(request, folder.resolve(), parameters, runner, progress, args.classify, weights, seeds)
    if axes is not None:
        network = replace(network, geometry=axes.along(network.geometry, network.frame, progress))
    _write(network, origin, parameters.model, request.extent, outputs)
    for lines, what in ((network.rails, "rail"), (network.centerlines, "centerline")):
        print(f"{counted(len(lines), what)}, {sum(line.length_m for line in lines) / 1000:.3f} km")
    if network.geometry:
        print(summary(network, parameters.gauges_m)[0])
    for failure in network.failures:
        print(failure, file=sys.stderr)
    return INCOMPLETE if network.failures else 0


def _on_dask(args: argparse.Namespace) -> bool:
    """Return whether an option asks for what only Dask can do: a cluster, and what its local workers keep and show."""
    return bool(args.scheduler or args.workers or args.work is not None or args.dashboard is not None)


@contextmanager
def _runner(args: argparse.Namespace, folder: Path, progress: Progress) -> Iterator[Runner]:
    """Provide the runner: Dask if it is asked for, else processes of this computer."""
    files = _certificate_files(args, progress)
    if not _on_dask(args):
        with workers(DEFAULT_WORKERS) as runner:
            yield runner
        return
    from ..cluster.runner import DaskRunner
    from ..cluster.workers import Certificates, connect

    certificates = Certificates(*files) if files else None
    with connect(args.scheduler, args.workers or None, certificates, args.dashboard) as client:
        yield DaskRunner(client, folder)


def _weights(args: argparse.Namespace) -> Path | None:
    """Return the weights that find the rail points of a raw cloud, on any worker; None for geometry.

    Raises
    ------
    ParameterError, ModelError
        They can't be used.
    """
    if args.method == LEARNED and not args.classify:
        raise ParameterError("--method is for raw clouds: give --classify as well.")
    weights = weights_for(args.method, args.weights)
    return None if weights is None else weights.resolve()


def _certificate_files(args: argparse.Namespace, progress: Progress) -> tuple[Path, ...]:
    """Return authority, certificate and key for a scheduler; none for local workers, or for a tcp:// address.

    Raises
    ------
    ParameterError
        An option is missing, or has nothing to apply to.
    """
    files = args.tls_ca, args.tls_cert, args.tls_key
    secured = (args.scheduler or "").startswith("tls://")
    if secured and None in files:
        raise ParameterError("A scheduler at tls:// needs the options --tls-ca, --tls-cert and --tls-key.")
    if not secured and files != (None, None, None):
        raise ParameterError("The options --tls-ca, --tls-cert and --tls-key need a --scheduler at tls://.")
    if args.dashboard is not None and not 0 <= args.dashboard <= LAST_PORT:
        raise ParameterError(f"--dashboard must be a number from 0 to {LAST_PORT}, not {args.dashboard}.")
    if args.scheduler and args.dashboard is not None:
        raise ParameterError("The option --dashboard is for local workers: a running scheduler has its own.")
    if args.scheduler and not secured:
        progress.warning(
            f"{args.scheduler} is not secured: everybody who reaches it can run programs on its workers. "
            "docs/scaling.md describes tls://."
        )
    return files if secured else ()


def _write(
    network: RailNetwork, origin: Origin, model: str, extent: Extent | None, outputs: Mapping[str, Destination]
) -> None:
    """Write all outputs; one that fails does not stop the others.

    Raises
    ------
    RailExtractError
        An output could not be written.
    """
    from ..output.layers import network_layers
    from ..output.writing import by_file, write_layers

    layers = network_layers(network, outputs, origin.gauges_m)
    writers: list[Callable[[], None]] = [
        partial(write_layers, same, file, network.frame) for same, file in by_file(layers, outputs)
    ]
    if "report" in outputs:
        writers.append(lambda: outputs["report"].write_text(origin.report(network)))
    if "cleaned" in outputs and any(raster.tiles for raster in network.cleaned):
        writers.append(lambda: _write_cleaned(network, outputs["cleaned"], origin.standard, extent, model))
    errors: list[RailExtractError] = []
    for write in writers:
        try:
            write()
        except RailExtractError as error:
            errors.append(error)
    if errors:
        raise RailExtractError(" ".join(map(str, errors)))


def _write_cleaned(
    network: RailNetwork, destination: Destination, standard: RailStandard, extent: Extent | None, model: str
) -> None:
    """Write the cleaned rasters as Clean Rail Raster does."""
    rasters, frame = on_one_grid(network.cleaned, network.frame)
    header = header_for(rasters, network.cleaned_classes, frame, standard, extent, model)
    with destination.replacing() as new:
        write_rasters(new, header, rasters)


def _option(name: str) -> str:
    """Return the option of a parameter: its name in QGIS, which does not state the unit."""
    for unit in ("_m", "_deg"):
        name = name[: -len(unit)] if name.endswith(unit) else name
    return "--" + name.replace("_", "-")
