"""Evaluate weights on a small fixed set of synthetic rasters, as a quick check during training.

The set depends only on its seeds, which no training uses: 132RE at 4 cm, the simpler families of layouts, severities
from 0.2 to 0.8, at which the corrupted rasters themselves have an F1 of at most 0.5. `benchmarks/frpdf.py` makes the
full comparison, with every family and severity.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from scipy import ndimage

from ...core.frpdf import DEFAULT_PASSES, FEEDBACK_THRESHOLD, OUTPUT_THRESHOLD, START
from ...core.frpdf.cleanup import UNTIL_STABLE, is_stable, max_passes
from ...core.frpdf.models import MODELS
from ..rasters.distortion import Pair
from ..rasters.pairs import BASE_RATIO, random_pair
from .networks import TrainedNetwork
from .scores import Scores, score

EVALUATION_SEED = 20251
"""Different from the seeds of training, which are small."""
SIDE = 512
COUNT = 48
SEVERITIES = (0.2, 0.8)
FAMILIES = ("plain", "curve", "parallel", "turnout", "connections")
MIN_PIECE_CELLS = 30
"""Smallest piece, in cells, that the row without a network keeps: about half a metre of rail."""

Cleaner = Callable[[np.ndarray], np.ndarray]
"""Maps a raster, (height, width) bool, to a cleaned one."""


class Passes(Protocol):
    """A network that runs one pass over a whole raster."""

    def probabilities(self, raster: np.ndarray, state: np.ndarray, number: int) -> np.ndarray:
        """Run pass `number`; see `networks.TrainedNetwork.probabilities`."""


@dataclass(frozen=True)
class Row:
    """A row of the table: name of the cleaner, counts, and seconds per raster."""

    name: str
    scores: Scores
    seconds: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("weights", type=Path, nargs="*", help=".npz files (default: the shipped models)")
    parser.add_argument("--count", type=int, default=COUNT, help=f"number of rasters to use (default {COUNT})")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Print the table."""
    pairs = evaluation_pairs(arguments.count)
    print(f"{len(pairs)} rasters of {SIDE} x {SIDE}, severity {SEVERITIES[0]} to {SEVERITIES[1]}, strict by cell")
    print(f"{'':28}{'FN':>9}{'FP':>9}{'TP':>9}{'precision':>11}{'recall':>8}{'F1':>7}{'s/raster':>10}")
    cleaners: list[tuple[str, Cleaner]] = [("input", lambda x: x), ("closing, pieces filtered", classical)]
    for path in arguments.weights or [model.path for model in MODELS]:
        network = TrainedNetwork("frpdf", path)
        for passes in range(1, DEFAULT_PASSES + 1):
            cleaners.append((f"{path.stem}, {passes} pass{'es' if passes > 1 else ''}", cleaner_of(network, passes)))
    for name, cleaner in cleaners:
        row = evaluate(name, cleaner, pairs)
        s = row.scores
        print(
            f"{row.name:28}{s.fn:9d}{s.fp:9d}{s.tp:9d}{s.precision:11.3f}{s.recall:8.3f}{s.f1:7.3f}{row.seconds:10.2f}",
            flush=True,
        )


def evaluation_pairs(count: int = COUNT) -> list[Pair]:
    """Draw `count` pairs of the fixed set."""
    severities = np.linspace(*SEVERITIES, COUNT)
    return [
        random_pair(
            np.random.default_rng([EVALUATION_SEED, number]),
            SIDE,
            severities[number],
            BASE_RATIO,
            FAMILIES[number % len(FAMILIES)],
        )
        for number in np.random.default_rng(EVALUATION_SEED).permutation(COUNT)[:count]
    ]


def evaluate(name: str, cleaner: Cleaner, pairs: list[Pair]) -> Row:
    """Clean all rasters and add up their counts for a row of the table."""
    total, started = Scores(), time.perf_counter()
    for pair in pairs:
        total += score(cleaner(pair.observed), pair.label)
    return Row(name, total, (time.perf_counter() - started) / len(pairs))


def classical(observed: np.ndarray) -> np.ndarray:
    """Clean a raster without a network: closing, and removal of small pieces."""
    closed = ndimage.binary_closing(np.pad(observed, 2), np.ones((3, 3)))[2:-2, 2:-2]
    pieces, count = ndimage.label(closed, np.ones((3, 3)))
    large = np.bincount(pieces.ravel(), minlength=count + 1) >= MIN_PIECE_CELLS
    large[0] = False
    return large[pieces]


def cleaner_of(network: Passes, passes: int) -> Cleaner:
    """Return a function that cleans a raster with a number of passes; 0 runs until the result is stable."""

    def clean(observed: np.ndarray) -> np.ndarray:
        seen, found = observed.astype(np.float32), observed
        state = np.full_like(seen, START)
        for number in range(max_passes(passes)):
            before, probability = found, network.probabilities(seen, state, number)
            state, found = (probability >= FEEDBACK_THRESHOLD).astype(np.float32), probability >= OUTPUT_THRESHOLD
            if passes == UNTIL_STABLE and number > 0 and is_stable((before != found).sum(), found.sum()):
                break
        return found

    return clean
