"""The command `python -m rail_extract train-classifier`: the outputs of Train Rail Classifier."""

from __future__ import annotations

import argparse
import math
import os
import time
from pathlib import Path

from ..classify.settings import Settings
from ..clouds.points import ask
from ..disk import Destination, writing
from ..errors import ParameterError
from ..frpdf import DEVICES
from ..labelling.training import Plan, check_training, train_classifier
from ..parameters import DEFAULT_EPOCHS
from ..progress import Estimating
from ..report.training_card import build_card, facts_of
from ..standards import SEARCHED_CLASSES, resolve
from .options import TILES_HELP, Console, add_cloud_arguments, extent_of, limited, numbers_in


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("tiles", nargs="+", type=Path, metavar="TILE", help=TILES_HELP)
    text = (
        "file (.npz) for the weights; a folder next to it keeps an interrupted training, which the same call continues"
    )
    parser.add_argument("--weights", type=Path, required=True, help=text)
    parser.add_argument("--card", type=Path, help="HTML file for recall and precision by tile, curves and settings")
    parser.add_argument("--rail-classes", default="10", help="classes of rail points, such as 10,11 (default: 10)")
    add_cloud_arguments(parser)
    text = "weights to start from, such as models/rail_classifier.npz: fewer labels and epochs do"
    parser.add_argument("--start", type=Path, metavar="FILE", help=text)
    text = f"how many times each block with rails is learned from (default: {DEFAULT_EPOCHS})"
    parser.add_argument("--epochs", type=int, default=DEFAULT_EPOCHS, metavar="N", help=text)
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the random numbers (default: 0)")
    parser.add_argument("--device", choices=DEVICES, default="AUTO", help="where the network is trained")
    text = "stop after this time; the same call continues"
    parser.add_argument("--minutes", type=float, default=math.inf, metavar="N", help=text)


def run(args: argparse.Namespace) -> None:
    """Train and write.

    Raises
    ------
    RailExtractError
        A parameter is wrong, a file can't be read, or the labels are not enough to learn from.
    Cancelled
        The time is over.
    """
    if args.epochs < 1:
        raise ParameterError(f"--epochs must be 1 or more, not {args.epochs}.")
    if args.card is not None and os.path.realpath(args.card) == os.path.realpath(args.weights):
        raise ParameterError("--weights and --card are the same file: give each its own name.")
    plan = Plan(numbers_in(args.rail_classes, "--rail-classes", int), args.epochs, args.seed, args.device, args.start)
    check_training(args.weights, plan)
    standard = resolve(args.standard, args.gauge, args.head_width)
    outputs = []
    for path in filter(None, (args.weights, args.card)):
        with writing(path.parent):
            path.parent.mkdir(parents=True, exist_ok=True)
        outputs.append(Destination.at(path))
    progress = Estimating(_Until(args.minutes))
    request = ask(args.tiles, SEARCHED_CLASSES, args.crs, extent_of(args.extent), progress)
    request = limited(request, args)
    trained = train_classifier(
        request, Settings((standard.gauge_m,), standard.head_width_m), plan, outputs[0], progress
    )
    if args.card is not None:
        names = [header.path.name for header in request.headers]
        outputs[1].write_text(build_card(trained, names, facts_of(trained, plan, standard)))
    total = trained.total
    print(f"recall {total.recall:.3f}, precision {total.precision:.3f}, F1 {total.f1:.3f} of blocks kept back")


class _Until(Console):
    """Cancels after a time."""

    def __init__(self, minutes: float) -> None:
        super().__init__()
        self._end = time.monotonic() + 60 * minutes

    def is_cancelled(self) -> bool:
        """Return whether the time is over, or there was a Ctrl-C."""
        return super().is_cancelled() or time.monotonic() > self._end
