"""Commands of the core: `python -m rail_extract --help` lists them."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Sequence

COMMANDS = {
    "extract": ("core.commands.extract", "extract rails and track centerlines on many workers"),
    "train": ("laboratory.training.train", "train FRPDF on synthetic rasters"),
    "evaluate": ("laboratory.training.evaluate", "compare weights on a fixed set of synthetic rasters"),
    "onnx": ("core.frpdf.onnx", "write the network for other runtimes"),
    "scenes": ("laboratory.scenes.write", "write synthetic clouds with their true lines"),
}
"""Module and help of each command; a module offers `add_arguments(parser)` and `run(args)`, that may give a code."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code; only the chosen command's module is imported."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    parser = argparse.ArgumentParser(prog="python -m rail_extract", description=__doc__)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    parsers = {name: commands.add_parser(name, help=text, description=text) for name, (_, text) in COMMANDS.items()}
    chosen = arguments[0] if arguments and arguments[0] in COMMANDS else None
    if chosen is None:
        parser.parse_args(arguments)
        return 0
    module = importlib.import_module(f".{COMMANDS[chosen][0]}", __package__)
    module.add_arguments(parsers[chosen])
    return _run(module, parser.parse_args(arguments))


def _run(module, args: argparse.Namespace) -> int:
    errors = importlib.import_module(".core.errors", __package__)
    try:
        return module.run(args) or 0
    except errors.RailExtractError as error:
        print(error, file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
