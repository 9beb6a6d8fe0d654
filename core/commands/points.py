"""The command `train-classifier`, which makes weights for `classify`."""

from __future__ import annotations

import argparse
import math
import os
import time
from pathlib import Path

from ..classify.settings import Settings
from ..disk import Destination
from ..errors import ParameterError
from ..frpdf import DEVICES
from ..labelling import training
from ..labelling.training import Plan, check_training
from ..parameters import DEFAULT_EPOCHS
from ..progress import Estimating
from ..report.training_card import build_card, facts_of
from ..standards import SEARCHED_CLASSES, resolve
from .options import (
    Console,
    add_cloud_arguments,
    add_tiles_argument,
    make_folder_of,
    numbers_in,
    request_of,
)


def train_classifier(parser: argparse.ArgumentParser) -> None:
    """Declare the command that trains a classifier of rail points."""
    add_tiles_argument(parser)
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
    parser.set_defaults(run=_train)


def _train(args: argparse.Namespace) -> None:
    """Train and write; `Cancelled` after the time."""
    if args.epochs < 1:
        raise ParameterError(f"--epochs must be 1 or more, not {args.epochs}.")
    if args.card is not None and os.path.realpath(args.card) == os.path.realpath(args.weights):
        raise ParameterError("--weights and --card are the same file: give each its own name.")
    plan = Plan(numbers_in(args.rail_classes, "--rail-classes", int), args.epochs, args.seed, args.device, args.start)
    check_training(args.weights, plan)
    standard = resolve(args.standard, args.gauge, args.head_width)
    outputs = []
    for path in filter(None, (args.weights, args.card)):
        make_folder_of(path)
        outputs.append(Destination.at(path))
    progress = Estimating(_Until(args.minutes))
    request = request_of(args, SEARCHED_CLASSES, progress)
    settings = Settings((standard.gauge_m,), standard.head_width_m)
    trained = training.train_classifier(request, settings, plan, outputs[0], progress)
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
