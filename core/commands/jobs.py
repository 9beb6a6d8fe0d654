"""A job as a command: its options have the names of its parameters and outputs, in small letters with hyphens.

Steps, remaining time and warnings are printed on the console.
"""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from ..jobs import CALLS
from ..jobs import declaration as kinds
from ..jobs.declaration import Parameter
from ..jobs.result import Result
from ..jobs.values import Job
from ..progress import Estimating, Progress
from .files import FileValues, run_with_files


def __getattr__(name: str) -> Callable[[argparse.ArgumentParser], None]:
    """Return the function that declares the command of a job."""
    if name not in CALLS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return partial(declare, CALLS[name])


def declare(job: Job, parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of a job."""
    for one in job.parameters:
        _add(one, parser)
    group = parser.add_argument_group("outputs", "Existing files are replaced. GeoPackages may be the same file.")
    for output in job.outputs:
        group.add_argument(
            option(output), dest=output.name, required=output.required, metavar="FILE", help=_help(output)
        )
    if job.resumes:
        parser.add_argument("--work", type=Path, help="folder that keeps what is finished for later runs")
    parser.set_defaults(run=partial(_run, job))


def option(one: Parameter) -> str:
    """Return how a command line names a parameter or an output."""
    return one.name if is_positional(one) else f"--{one.name.lower().replace('_', '-')}"


def is_positional(one: Parameter) -> bool:
    """Return whether a parameter has no option, because it must be given."""
    return isinstance(one, kinds.Input) and one.required


def _add(one: Parameter, parser: argparse.ArgumentParser) -> None:
    """Declare the argument of a parameter, whose value is checked later, as a dialog does."""
    if isinstance(one, kinds.Flag):
        parser.add_argument(option(one), dest=one.name, action=argparse.BooleanOptionalAction, help=_help(one))
    elif is_positional(one):
        parser.add_argument(one.name, nargs="+" if isinstance(one, kinds.Cloud) else None, help=_help(one))
    elif isinstance(one, kinds.Place):
        parser.add_argument(option(one), dest=one.name, action="append", metavar="X,Y", help=_help(one))
    else:
        parser.add_argument(option(one), dest=one.name, metavar=_metavar(one), help=_help(one))


def _metavar(one: Parameter) -> str:
    """Return what stands for the value in the help."""
    if isinstance(one, kinds.Choice):
        return "NAME" if len(one.options) > kinds.FEW else "|".join(one.options)
    return "N" if isinstance(one, kinds.Number) else "FILE" if isinstance(one, kinds.Input) else "TEXT"


def _help(one: Parameter) -> str:
    """Return label, help and default of a parameter."""
    default = "" if one.default is None else f" (default: {one.default})"
    return f"{one.label}. {one.help}{default}".replace("%", "%%")


def _run(job: Job, args: argparse.Namespace) -> None:
    """Run with what was given, and print the result in words."""
    work = args.work if job.resumes else None
    run_and_print(job, partial(FileValues, job, given_to(job, args), args.command_line, work=work), console_of(job))


def given_to(job: Job, args: argparse.Namespace) -> dict[str, Any]:
    """Return what a command was given, by the names of parameters and outputs."""
    return {one.name: getattr(args, one.name) for one in (*job.parameters, *job.outputs)}


def console_of(job: Job) -> Progress:
    """Return the progress of a command, which names options."""
    return Estimating(Console(lambda sentence: job.reworded(sentence, option)))


def run_and_print(job: Job, make: Callable[[], FileValues], progress: Progress) -> Result:
    """Run a job with what a command was given, and print the result in words."""
    result = run_with_files(job, make, progress, option)
    for sentence in result.sentences:
        print(sentence)
    return result


class Console(Progress):
    """Prints steps, remaining time and warnings to the error output; Ctrl-C cancels it.

    Python drops the exception of a Ctrl-C that comes during a finalizer or some callbacks. The run then ends at its
    next check for cancellation. `word` returns a message with the names of options for those of parameters.
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
