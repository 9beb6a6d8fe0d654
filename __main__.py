"""The commands of Rail Extract outside QGIS."""

from __future__ import annotations

import argparse
import importlib
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from .core.jobs import CALLS

PROGRAM = "python -m rail_extract"

JOB = "core.commands.jobs"

COMMANDS = {
    **{name.replace("_", "-"): (f"{JOB}.{name}", job.summary) for name, job in CALLS.items()},
    "extract": ("core.commands.extract.extract", CALLS["extract"].summary),
    "onnx": ("core.frpdf.onnx.add_arguments", "write the network for other runtimes"),
    "train": ("laboratory.training.train.add_arguments", "train the network on synthetic rasters"),
    "evaluate": ("laboratory.training.evaluate.add_arguments", "compare weights on a fixed set of synthetic rasters"),
    "scenes": ("laboratory.scenes.write.add_arguments", "write synthetic clouds with their true lines"),
}
"""Function and help of each command; the function declares the arguments, and as `run` what runs with them. Those of
the jobs have the names of the functions of Python.

`run(args)` may return an exit code, and raises a `RailExtractError` where something is wrong.
"""


INTERRUPTED = 130
"""Exit code of a command that Ctrl-C ended, as shells expect it."""


CANCELLED = "Cancelled; nothing was written."

NO_MEMORY = "Not enough memory: choose a smaller extent."


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code; only the module of this command is imported."""
    return _run(parse(sys.argv[1:] if arguments is None else list(arguments)))


def parse(arguments: list[str]) -> argparse.Namespace:
    """Return the arguments of a command; ends the program if there are others, or help is asked for."""
    parser = argparse.ArgumentParser(prog=PROGRAM, description=__doc__)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    listed = {name: command for name, command in COMMANDS.items() if _is_installed(command[0])}
    parsers = {
        name: commands.add_parser(name, help=text, description=text, fromfile_prefix_chars="@")
        for name, (_, text) in listed.items()
    }
    chosen = arguments[0] if arguments and arguments[0] in listed else None
    if chosen is None:
        parser.parse_args(arguments)
        parser.exit()
    module, _, declare = listed[chosen][0].rpartition(".")
    getattr(importlib.import_module(f".{module}", __package__), declare)(parsers[chosen])
    try:
        args = parser.parse_args(arguments)
    except (UnicodeDecodeError, RecursionError):
        parsers[chosen].error("a file that is given as @FILE is not text, or names itself")
    args.command_line = shlex.join([*PROGRAM.split(), *arguments])
    return args


def _is_installed(path: str) -> bool:
    """Return whether the package of a command exists: the plugin's zip does not include the laboratory."""
    return Path(__file__).with_name(path.split(".")[0]).is_dir()


def _run(args: argparse.Namespace) -> int:
    errors, kernels = (importlib.import_module(f".core.{name}", __package__) for name in ("errors", "kernels"))
    try:
        with kernels.one_thread(*kernels.blas()):
            return args.run(args) or 0
    except errors.RailExtractError as error:
        print(error, file=sys.stderr)
        return 1
    except MemoryError:
        print(NO_MEMORY, file=sys.stderr)
        return 1
    except errors.Cancelled as cancelled:
        print(str(cancelled) or CANCELLED, file=sys.stderr)
        return INTERRUPTED
    except KeyboardInterrupt:
        print(CANCELLED, file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
