"""What the commands share: options of an axis, and progress on the console."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from ..disk import Destination, writing
from ..errors import ParameterError
from ..jobs.shared import DECREASING, INCREASING
from ..kilometres.text import HECTOMETRES, NOTATIONS
from ..progress import Progress


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


TABLE = (".gpkg",)
"""Suffixes of files for layers that only a GeoPackage holds."""


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
