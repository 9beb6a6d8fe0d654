"""The commands that classify points: `classify`, `grow`, and `train-classifier`, which makes weights for the first."""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..checks.standard import warn_of_raw
from ..classify.guide import Guide
from ..classify.settings import Settings
from ..clouds.crs import MAX_COORDINATE
from ..clouds.points import Request, ask
from ..disk import Destination, writing
from ..errors import ParameterError
from ..frpdf import DEVICES
from ..grow.settings import GrowSettings
from ..labelling import training
from ..labelling.files import Choice, Output, Result, classify_files, plan_output
from ..labelling.finding import guide_of
from ..labelling.growing import grow_files
from ..labelling.training import Plan, check_training
from ..learned.model import weights_for
from ..output.layers import stops_layer
from ..parameters import DEFAULT_EPOCHS, DEFAULT_GUIDE_DISTANCE_M, GrowParameters, Parameters
from ..progress import Estimating, Progress
from ..report.training_card import build_card, facts_of
from ..scratch import scratch_folder
from ..standards import LAST_CLASS, RAIL_CLASS, SEARCHED_CLASSES, resolve
from ..tasks import InTurn
from .options import (
    LAYER,
    WRITING,
    Console,
    add_cloud_arguments,
    add_lengths,
    add_method_arguments,
    add_standard_arguments,
    add_tiles_argument,
    add_workers_argument,
    destination_of,
    gauges_of,
    lengths_of,
    make_folder_of,
    numbers_in,
    request_of,
    runner_of,
    vector_module,
)

LENGTHS = {
    "search": "largest distance of a seed from its rail, and of the rail from its course",
    "thickness": "width of the strip along the axis in which points belong to the rail",
    "window": "length of rail that is looked at as one",
    "min_height": "least height of the rail above its bed",
    "tolerance_z": "largest difference in height between the points of a head",
    "max_length": "length that is followed to either side of a seed",
}
"""Options of `grow` in metres, each an attribute of `GrowParameters` without its unit."""


def classify(parser: argparse.ArgumentParser) -> None:
    """Declare the command that finds the rail points of raw clouds."""
    _add_copy(parser)
    add_cloud_arguments(parser)
    text = "lines along the tracks, in a file such as GeoPackage or GeoJSON: search near them only"
    parser.add_argument("--guide", type=Path, metavar="FILE", help=text)
    text = f"how far the middle of a track may be from the guide (default: {DEFAULT_GUIDE_DISTANCE_M:g})"
    parser.add_argument("--guide-distance", type=float, default=DEFAULT_GUIDE_DISTANCE_M, metavar="M", help=text)
    text = "keep only tracks that have the guide within 0.5 m of their middle"
    parser.add_argument("--only-guided", action="store_true", help=text)
    add_method_arguments(parser)
    parser.add_argument("--pairs-only", action="store_true", help="leave out rails without a partner")
    _add_labels(parser, "the rail points that are found")
    add_workers_argument(parser)
    text = "keep the rail class of points that are not found; otherwise they become class 1"
    parser.add_argument("--no-reset", action="store_true", help=text)
    parser.set_defaults(run=_classify)


def _classify(args: argparse.Namespace) -> None:
    """Find the rail points and write the copy."""
    _check_rail_class(args)
    standard = resolve(args.standard, args.gauge, args.head_width)
    gauges = gauges_of(args, standard)
    gauges_m = tuple(gauge_m for gauge_m, _ in gauges)
    if args.only_guided and args.guide is None:
        raise ParameterError("--only-guided needs lines to compare tracks with: give --guide.")
    choice = Choice(args.rail_class, args.rails_only, not args.no_reset)
    weights = weights_for(args.method, args.weights)
    progress = Estimating(Console())
    planned = _planned(args, progress)
    request = request_of(args, SEARCHED_CLASSES, progress)
    guide = _guide(args, request)
    settings = Settings(gauges_m, standard.head_width_m, not args.pairs_only, guide, weights)
    with _beside(planned) as folder, runner_of(args) as runner:
        result = classify_files(request, settings, choice, planned, folder, runner, progress)
    parameters = Parameters(standard.gauge_m, standard.head_width_m).with_gauges(gauges[1:])
    warn_of_raw(request, result.figures, parameters, progress)
    _print(result)


def _guide(args: argparse.Namespace, request: Request) -> Guide | None:
    """Read the guide, if there is one."""
    if args.guide is None:
        return None
    lines = vector_module("--guide").read_lines(args.guide, request.zero.crs_wkt)
    return guide_of(request, lines, args.guide_distance, args.only_guided)


def grow(parser: argparse.ArgumentParser) -> None:
    """Declare the command that follows rails from seeds."""
    _add_copy(parser)
    text = "points on railheads, or lines along them, in a file such as GeoPackage or GeoJSON"
    parser.add_argument("--seeds", type=Path, metavar="FILE", help=text)
    text = "a place on a railhead, in units of the coordinate system; may be given several times"
    parser.add_argument("--seed", action="append", default=[], metavar="X,Y", help=text)
    add_standard_arguments(parser)
    parser.add_argument("--crs", help="coordinate system of tiles that state none, such as EPSG:25832")
    text = "do not follow the other rail of the track"
    parser.add_argument("--single", action="store_true", help=text)
    add_lengths(parser, LENGTHS, GrowParameters)
    most = GrowParameters.max_outliers
    text = f"windows in a row in which the rail may not be seen (default: {most})"
    parser.add_argument("--max-outliers", type=int, default=most, metavar="N", help=text)
    _add_labels(parser, "the rail points")
    text = "GeoPackage (or .dxf, .csv) for the places where rails are not followed further, with the reason"
    parser.add_argument("--stops", type=Path, metavar="FILE", help=text)
    parser.set_defaults(run=_grow)


def _grow(args: argparse.Namespace) -> None:
    """Follow the rails and write the copy."""
    _check_rail_class(args)
    standard = resolve(args.standard, args.gauge, args.head_width)
    if args.max_outliers < 0:
        raise ParameterError(f"--max-outliers must be 0 or more, not {args.max_outliers}.")
    lengths = lengths_of(args, LENGTHS)
    parameters = GrowParameters(both=not args.single, max_outliers=args.max_outliers, **lengths)
    settings = GrowSettings(standard.gauge_m, standard.head_width_m, parameters)
    progress = Estimating(Console())
    planned = _planned(args, progress)
    stops = None if args.stops is None else destination_of("stops", args.stops, LAYER)
    written = None if stops is None else vector_module("--stops", WRITING)
    request = ask(args.tiles, SEARCHED_CLASSES, args.crs, None, progress)
    choice = Choice(args.rail_class, args.rails_only, reset=False)
    seeds = _seeds(args, request.zero.crs_wkt)
    with _beside(planned) as folder:
        result = grow_files(request, seeds, settings, choice, planned, folder, InTurn(), progress)
    if written is not None:
        written.write_layers([stops_layer(result.stops)], stops, request.zero)
    _print(result)


def _seeds(args: argparse.Namespace, crs_wkt: str | None) -> list[np.ndarray]:
    """Return the seeds, in the coordinate system of the cloud.

    Raises
    ------
    ParameterError
        There are none, or they can't be read.
    """
    seeds = [] if args.seeds is None else vector_module("--seeds").read_seeds(args.seeds, crs_wkt)
    for text in args.seed:
        try:
            x, y = (float(word) for word in text.split(","))
            if not max(abs(x), abs(y)) <= MAX_COORDINATE:
                raise ValueError
        except ValueError:
            raise ParameterError(f'--seed "{text}" should be two numbers: x,y.') from None
        seeds.append(np.array([[x, y]]))
    if not seeds:
        raise ParameterError("A rail is followed from seeds: give --seeds or --seed.")
    return seeds


def _add_copy(parser: argparse.ArgumentParser) -> None:
    """Declare the tiles that are read, and the copy."""
    add_tiles_argument(parser)
    text = "LAZ or LAS file; for several tiles, the name of their new folder, with .vpc added for the catalogue"
    parser.add_argument("--output", type=Path, required=True, help=text)


def _add_labels(parser: argparse.ArgumentParser, points: str) -> None:
    """Declare the class of the rail points, described as `points`, and whether only these are written."""
    text = f"class of {points} (default: {RAIL_CLASS})"
    parser.add_argument("--rail-class", type=int, default=RAIL_CLASS, metavar="N", help=text)
    parser.add_argument("--rails-only", action="store_true", help="write the rail points only")


def _check_rail_class(args: argparse.Namespace) -> None:
    """Check that the class of the rail points is one."""
    if not 0 <= args.rail_class <= LAST_CLASS:
        raise ParameterError(f"--rail-class must be a number from 0 to {LAST_CLASS}, not {args.rail_class}.")


def _planned(args: argparse.Namespace, progress: Progress) -> Output:
    """Make the folder of the copy, and plan the copy; errors as for `files.plan_output`."""
    output = args.output if len(args.tiles) == 1 or args.output.suffix else args.output.with_suffix(".vpc")
    make_folder_of(output)
    return plan_output(args.tiles, output, args.rail_class, progress)


@contextmanager
def _beside(planned: Output) -> Iterator[Path]:
    """Provide a folder for scratch files beside the copy."""
    with writing(planned.file.parent), scratch_folder(planned.file.parent) as folder:
        yield folder


def _print(result: Result) -> None:
    """Print how much was found."""
    print(f"{result.figures.points} of {result.point_count} points are on rails")
    print(f"{result.figures.paired_m:.0f} m of rails with a partner, {result.figures.single_m:.0f} m without")


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
