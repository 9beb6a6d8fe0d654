"""What the commands share: options of the cloud and its rails, and progress on the console."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

from ..alignment.km_text import HECTOMETRES, NOTATIONS
from ..clouds.points import Request, ask
from ..disk import Destination, writing
from ..errors import ParameterError
from ..jobs.shared import DECREASING, INCREASING
from ..parameters import DEFAULT_WORKERS, GEOMETRY, LEARNED, LEAVE_OUT, MAX_WORKERS, METHODS, Parameters
from ..progress import Progress
from ..standards import DEFAULT, Gauge, RailStandard, read_gauges
from ..tasks import Runner
from ..workers.runner import workers


def add_tiles_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the clouds."""
    text = (
        "point clouds, virtual point clouds, folders of tiles, or patterns such as tiles/*.laz; @FILE reads the "
        "names, one per line, from a file"
    )
    parser.add_argument("tiles", nargs="+", type=Path, metavar="TILE", help=text)


def add_standard_arguments(parser: argparse._ActionsContainer) -> None:
    """Declare the rail standard."""
    parser.add_argument("--standard", default=DEFAULT, help=f"rail standard (default: {DEFAULT})")
    parser.add_argument("--gauge", type=float, metavar="MM", help="gauge, instead of that of the standard")
    text = "railhead width, instead of that of the standard"
    parser.add_argument("--head-width", type=float, metavar="MM", help=text)


def add_cloud_arguments(parser: argparse._ActionsContainer) -> None:
    """Declare the rails and the coordinate system of the cloud, and the area to read, in a parser or in a group."""
    add_standard_arguments(parser)
    text = "further gauges to pair, such as 1000;1067, or 1000/66 with the width of the railhead"
    parser.add_argument("--other-gauges", default="", metavar="MM", help=text)
    parser.add_argument("--crs", help="coordinate system of tiles that state none, such as EPSG:25832")
    parser.add_argument(
        "--extent",
        metavar="XMIN,YMIN,XMAX,YMAX",
        help="read only the points in this rectangle, in units of the coordinate system; write --extent=-5,... if "
        "the first number is negative",
    )
    flags = ",".join(LEAVE_OUT)
    parser.add_argument(
        "--leave-out", default="", metavar="FLAGS", help=f"leave out points with these flags, of {flags}"
    )
    text = "read only the points in the polygons of this GeoPackage or GeoJSON file"
    parser.add_argument("--mask", type=Path, metavar="FILE", help=text)


def add_method_arguments(parser: argparse._ActionsContainer) -> None:
    """Declare what finds the rail points of a raw cloud, in a parser or in a group."""
    text = f"what finds the rail points of a raw cloud (default: {GEOMETRY})"
    parser.add_argument("--method", choices=METHODS, default=GEOMETRY, help=text)
    text = f"file that train-classifier has written, for --method {LEARNED} (default: those shipped)"
    parser.add_argument("--weights", type=Path, metavar="FILE", help=text)


def add_axis_arguments(parser: argparse._ActionsContainer) -> None:
    """Declare what states the kilometres of an axis, in a parser or in a group."""
    text = "kilometre at the first vertex of the axis; overrides M values"
    parser.add_argument("--start-km", type=float, metavar="KM", help=text)
    parser.add_argument("--decreasing", action="store_true", help="kilometres decrease from the start of the axis")
    text = "points of kilometre or hectometre posts; they override the start and M values"
    parser.add_argument("--posts", metavar="FILE", help=text)
    text = "field of the posts with the kilometre (default: the first of km, kilometre, km_text, station)"
    parser.add_argument("--post-field", metavar="NAME", help=text)
    text = "table of gaps and overlaps with the fields km_back and km_ahead"
    parser.add_argument("--jumps", metavar="FILE", help=text)
    text = f"how km_text writes kilometres (default: {HECTOMETRES})"
    parser.add_argument("--format", choices=tuple(NOTATIONS), default=HECTOMETRES, help=text)


def axis_of(args: argparse.Namespace) -> dict[str, Any]:
    """Return what the options say of an axis, by the names of its parameters."""
    values = {"AXIS": args.axis, "START_KM": args.start_km, "DIRECTION": DECREASING if args.decreasing else INCREASING}
    return {**values, "POSTS": args.posts, "POST_FIELD": args.post_field, "JUMPS": args.jumps, "FORMAT": args.format}


LAYER, TABLE, REPORT = (".gpkg", ".dxf", ".csv"), (".gpkg",), (".html", ".htm")
"""Suffixes of files: of layers, of layers that only a GeoPackage holds, and of reports."""

Outputs = Mapping[str, tuple[Sequence[str], str]]
"""The files that a command writes, by option: their suffixes, and what to say of them in the help."""


def add_outputs(parser: argparse.ArgumentParser, outputs: Outputs, required: str = "") -> None:
    """Declare the files to write, of which one may be `required`."""
    group = parser.add_argument_group("outputs", "Existing files are replaced. GeoPackages may be the same file.")
    for name, (_, text) in outputs.items():
        group.add_argument(f"--{name}", type=Path, required=name == required, metavar="FILE", help=text)


def destination_of(name: str, path: Path, suffixes: Sequence[str]) -> Destination:
    """Check that the file of the option `name` can be written, and make its folder.

    Raises
    ------
    ParameterError, DiskError
        It could not be written after the run.
    """
    if path.suffix.lower() not in suffixes:
        raise ParameterError(f"The option --{name} writes {suffixes[0]} files: give {path.name} this suffix.")
    make_folder_of(path)
    return Destination.at(path)


def make_folder_of(path: Path) -> None:
    """Make the folder of a file.

    Raises
    ------
    DiskError
        It can't be made.
    """
    with writing(path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)


def destinations_of(args: argparse.Namespace, outputs: Outputs) -> dict[str, Destination]:
    """Check that the outputs can be written, and return the destinations of those that are asked for, by option.

    Raises
    ------
    ParameterError, DiskError
        An output could not be written after the run, or a file that is not a GeoPackage is given for two.
    """
    files: dict[Path, Destination] = {}
    found: dict[str, Destination] = {}
    for name, (suffixes, _) in outputs.items():
        path = getattr(args, name)
        if path is None:
            continue
        destination = destination_of(name, path, suffixes)
        if destination.file in files and path.suffix.lower() != ".gpkg":
            raise ParameterError(f"Only a GeoPackage holds several outputs: give --{name} a file other than {path}.")
        found[name] = files.setdefault(destination.file, destination)
    return found


def vector_module(option: str, name: str = "vectors") -> Any:
    """Return the module that reads vector files, or another one of this package that needs the same packages.

    Raises
    ------
    ParameterError
        The packages are not installed; `option` is what needs them.
    """
    try:
        return import_module(f".{name}", __package__)
    except ImportError as error:
        raise ParameterError(
            f"{option} needs the packages pyogrio and shapely: in a clone, run pip install .[cluster]."
        ) from error


WRITING = ".output.writing"
"""For `vector_module`: the module that writes vector files."""


def request_of(args: argparse.Namespace, codes: Sequence[int], progress: Progress, failures: Any = None) -> Request:
    """Return the request for the points of these classes that the options state.

    Raises
    ------
    RailExtractError
        A tile can't be read, an option is wrong, or the file of `--mask` has no polygons.
    """
    flags = tuple(word.strip().upper() for word in args.leave_out.split(",") if word.strip())
    if not set(flags) <= set(LEAVE_OUT):
        raise ParameterError(f'--leave-out "{args.leave_out}" should be flags of {", ".join(LEAVE_OUT)}.')
    request = ask(args.tiles, codes, args.crs, extent_of(args.extent), progress, unreadable=failures)
    mask = vector_module("--mask").read_mask(args.mask, request.zero.crs_wkt) if args.mask else None
    return replace(request, leave_out=flags, mask=mask)


def gauges_of(args: argparse.Namespace, standard: RailStandard, tolerance_m: float | None = None) -> tuple[Gauge, ...]:
    """Return the gauge of the standard and those of `--other-gauges`.

    Parameters
    ----------
    args : Namespace
    standard : RailStandard
    tolerance_m : float, optional
        Largest deviation of a track from its gauge, where the command has an option for it.

    Raises
    ------
    ParameterError
        The text contains something other than gauges, or they can't be distinguished.
    """
    own_m = Parameters.centerline_tolerance_m if tolerance_m is None else tolerance_m
    return read_gauges(args.other_gauges, "--other-gauges", standard, own_m, tolerance_m is not None)


def numbers_in(text: str, option: str, kind: type) -> tuple:
    """Return the distinct numbers in a text such as "10,11" or "1000;1067".

    Raises
    ------
    ParameterError
        The text holds something else.
    """
    try:
        return tuple(dict.fromkeys(kind(word) for word in text.replace(";", ",").split(",") if word.strip()))
    except ValueError:
        raise ParameterError(f'{option} "{text}" should be numbers such as 10 or 10,11.') from None


def extent_of(text: str | None) -> tuple[float, float, float, float] | None:
    """Return the numbers of `--extent`.

    Raises
    ------
    ParameterError
        The text does not hold four numbers.
    """
    if text is None:
        return None
    try:
        xmin, ymin, xmax, ymax = (float(word) for word in text.split(","))
    except ValueError:
        raise ParameterError(f'--extent "{text}" should be four numbers: xmin,ymin,xmax,ymax.') from None
    return xmin, ymin, xmax, ymax


def add_workers_argument(parser: argparse._ActionsContainer) -> None:
    """Declare the number of workers."""
    text = "processes that compute at a time; 0, the default, is one per core, as far as memory allows"
    parser.add_argument("--workers", type=int, default=DEFAULT_WORKERS, metavar="N", help=text)


def runner_of(args: argparse.Namespace) -> AbstractContextManager[Runner]:
    """Provide the runner with the workers that are asked for.

    Raises
    ------
    ParameterError
        No computer has that many.
    """
    if not 0 <= args.workers <= MAX_WORKERS:
        raise ParameterError(f"--workers must be a number from 0 to {MAX_WORKERS}, not {args.workers}.")
    return workers(args.workers)


class Console(Progress):
    """Prints steps, remaining time and warnings to the error output; Ctrl-C cancels it.

    Python drops the exception of a Ctrl-C that comes during a finalizer or some callbacks. The run then ends at its
    next check for cancellation.

    Parameters
    ----------
    word : callable
        Returns a message with the names of options for those of parameters.
    """

    def __init__(self, word: Callable[[str], str] = str) -> None:
        self._interrupted, self._word = False, word
        signal.signal(signal.SIGINT, self._interrupt)

    def _interrupt(self, *_: object) -> None:
        self._interrupted = True
        raise KeyboardInterrupt

    def is_cancelled(self) -> bool:
        """Return whether there was a Ctrl-C."""
        return self._interrupted

    def status(self, text: str) -> None:
        """Print the current activity."""
        print(text, file=sys.stderr, flush=True)

    def info(self, text: str) -> None:
        """Print what was done."""
        print(self._word(text), file=sys.stderr, flush=True)

    def warning(self, text: str) -> None:
        """Print a warning."""
        print(f"Warning: {self._word(text)}", file=sys.stderr, flush=True)
